"""The projection method behind proofroll's engine protocol."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

import proofroll
from proofroll.engine import Built, Sample
from proofroll.engines.projection.geometry import geometry_of
from proofroll.engines.projection.integrators import INTEGRATORS
from proofroll.engines.projection.method import ProjectedBall
from proofroll.engines.projection.orientation import EulerAngles, Orientation, RotatingFrame
from proofroll.engines.projection.settings import PRESETS, ProjectionSettings
from proofroll.errors import Diverged
from proofroll.scene import Capability, RollingBall, Scene
from proofroll.surfaces import FloatArray

_ORIENTATIONS: Mapping[str, type[Orientation]] = {"euler": EulerAngles, "rotating_frame": RotatingFrame}


class Projection:
    """Blajer's projection method on any surface that guides a ball."""

    name: ClassVar[str] = "projection"
    provides: ClassVar[frozenset[Capability]] = frozenset(
        {Capability.ROLLING, Capability.CURVED_SURFACE, Capability.ROLLING_RESISTANCE}
    )
    settings: ClassVar[type[ProjectionSettings]] = ProjectionSettings
    presets: ClassVar[Mapping[str, Mapping[str, ProjectionSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """The method is part of proofroll."""
        return proofroll.__version__

    @classmethod
    def build(cls, scene: Scene, settings: ProjectionSettings) -> Self:
        """See :class:`proofroll.engine.Engine`."""
        return cls(scene.rolling, settings)

    def __init__(self, body: RollingBall, settings: ProjectionSettings) -> None:
        self._surface = body.surface
        self._orientation = _ORIENTATIONS[settings.formulation]()
        self._coordinates = 2 + self._orientation.size
        self._ball = ProjectedBall(body, geometry_of(body.surface), self._orientation)
        self._eliminate = settings.elimination
        integrator = INTEGRATORS[settings.integrator]
        self._fixed_step = settings.dt if integrator.resolution == "dt" else 0.0
        frame = body.surface.frame(body.u0)
        angles, r = self._orientation.start(frame, frame.T @ body.w0)
        self._integrator = integrator(
            self._ball.rates,
            self._accept,
            np.concatenate([body.u0, angles, body.udot0, r]),
            _scales(body, self._orientation.size),
            getattr(settings, integrator.resolution),
        )

    def _accept(self, t: float, x: FloatArray) -> FloatArray:
        n = self._coordinates
        if not math.isfinite(float(x.sum())):
            raise Diverged(f"the state is not finite (NaN or overflow) at t = {t:.6g} s")
        self._orientation.check(t, x[2:n], x[n + 2 :], self._fixed_step)
        return self._ball.eliminated(x) if self._eliminate else x

    def advance(self, t: float) -> None:
        """See :class:`proofroll.engine.Engine`."""
        start = self._integrator.t
        try:
            with np.errstate(over="ignore", invalid="ignore"):  # found by _accept, and raised as Diverged
                self._integrator.advance(t)
        except ArithmeticError as error:
            raise Diverged(f"{error}, between t = {start:.6g} s and {t:.6g} s") from None

    def sample(self) -> Sample:
        """See :class:`proofroll.engine.Engine`."""
        x = self._integrator.x
        kin = self._ball.kinematics(x)
        response = self._ball.response(kin)
        frame = kin.local.frame
        return Sample(
            p_WB=self._surface.position(x[:2]),
            v_WB=frame @ kin.v[:3],
            w_WB=frame @ kin.v[3:],
            q_WB=self._orientation.quaternion(x[2 : self._coordinates]),
            force=frame @ self._ball.contact_force(response),
        )

    def built(self) -> Built:
        """See :class:`proofroll.engine.Engine`."""
        ball = self._ball
        kin = ball.kinematics(self._integrator.x)
        acceleration = kin.D @ ball.response(kin).acceleration + kin.drift
        return Built(
            mass=float(ball.mass[0]),
            inertia=ball.mass[3:].copy(),
            gravity=kin.local.frame @ (ball.weight(kin)[:3] / ball.mass[:3]),
            ball_radius=float(ball.rows[0, 5]),
            rolling_resistance=ball.rolling_resistance,
            acceleration=kin.local.frame @ acceleration[:3],
        )


def _scales(body: RollingBall, angles: int) -> FloatArray:
    """Natural size of each component of the state, against which an adaptive step measures absolute errors.

    The lengths are of the order of the ball's radius, the speeds of the initial one or of a fall by one radius.
    """
    a = body.ball.radius
    speed = math.hypot(
        float(np.linalg.norm(body.v0)),
        a * float(np.linalg.norm(body.w0)),
        math.sqrt(a * float(np.linalg.norm(body.gravity))),
    )
    per_metre = 1 / np.asarray(body.surface.length_scales)
    velocities = [*(speed * per_metre), *np.full(3, speed / a)]
    return np.array([*(a * per_metre), *np.ones(angles), *(velocities if speed else np.ones(5))])
