"""The adapter between proofroll and Pinocchio."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
import pinocchio as pin

from proofroll.engine import Built, Sample
from proofroll.engines.pinocchio.composite import Composite
from proofroll.engines.pinocchio.free_flyer import FreeFlyer
from proofroll.engines.pinocchio.integrators import Integrator, integrator
from proofroll.engines.pinocchio.mechanism import Mechanism
from proofroll.engines.pinocchio.settings import PRESETS, PinocchioSettings
from proofroll.scene import Capability, Scene


class Pinocchio:
    """See :class:`proofroll.engine.Engine`."""

    name: ClassVar[str] = "pinocchio"
    provides: ClassVar[frozenset[Capability]] = frozenset(
        {Capability.ROLLING, Capability.CURVED_SURFACE, Capability.ROLLING_RESISTANCE}
    )
    settings: ClassVar[type[Any]] = PinocchioSettings
    presets: ClassVar[Mapping[str, Mapping[str, PinocchioSettings]]] = PRESETS

    def __init__(self, mechanism: Mechanism, motion: Integrator, orientation: bool) -> None:
        self._mechanism = mechanism
        self._motion = motion
        self._orientation = orientation
        self._t = 0.0

    @staticmethod
    def version() -> str:
        """See :class:`proofroll.engine.Engine`."""
        return str(pin.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: PinocchioSettings) -> Self:
        """See :class:`proofroll.engine.Engine`."""
        kind = Composite if settings.formulation == "composite" else FreeFlyer
        mechanism = kind(scene.rolling, settings.orientation)
        return cls(mechanism, integrator(mechanism, settings), settings.orientation)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.engine.Engine`."""
        self._motion.advance(self._t, t)
        self._t = t

    def sample(self) -> Sample:
        """See :class:`proofroll.engine.Engine`; no orientation where it is not integrated."""
        model, ball, q, v = self._mechanism.model, self._mechanism.ball, self._motion.q, self._motion.v
        data = model.createData()
        force = self._mechanism.reaction(data, q, v)[1]
        velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[ball]
        return Sample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) if self._orientation else None,
            force=force,
        )

    def built(self) -> Built:
        """See :class:`proofroll.engine.Engine`: from the model, and from its rows and torques at the state now."""
        mechanism, q, v = self._mechanism, self._motion.q, self._motion.v
        model, data, ball = mechanism.model, mechanism.model.createData(), mechanism.ball
        inertia = model.inertias[ball]
        # In both formulations the spin is last, in orthonormal axes: the row of slip has the length a there, and
        # rolling resistance the length f (at rest it has no direction, and nothing can be read).
        radius = float(np.linalg.norm(mechanism.rolling_row(data, q, v)[-3:]))
        torque = mechanism.resistance(data, q, v)
        f = 0.0 if torque is None else float(np.linalg.norm(torque[-3:])) or None
        acceleration = mechanism.reaction(data, q, v)[0]
        pin.forwardKinematics(model, data, q, v, acceleration)
        return Built(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=model.gravity.linear.copy(),
            ball_radius=radius,
            rolling_resistance=f,
            acceleration=pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).linear.copy(),
        )
