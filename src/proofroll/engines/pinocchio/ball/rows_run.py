"""Formulations ``composite`` and ``free_flyer``: a ball with constraint rows, and the integrator of its motion."""

import math

import numpy as np
import pinocchio as pin

from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.pinocchio.ball.ball_with_rows import BallWithRows
from proofroll.engines.pinocchio.ball.composite import Composite
from proofroll.engines.pinocchio.ball.free_flyer import FreeFlyer
from proofroll.engines.pinocchio.ball.integrators import (
    Adaptive,
    SemiImplicitEuler,
    TangentIntegrator,
    TangentRungeKutta4,
)
from proofroll.engines.pinocchio.ball.stick_slip import AdaptiveStickSlip, StickSlipEuler, StickSlipRungeKutta4
from proofroll.engines.pinocchio.settings import PinocchioSettings

# For unbounded friction, and for bounded friction.
_INTEGRATORS = {
    "dop853": (Adaptive, AdaptiveStickSlip),
    "semi_implicit_euler": (SemiImplicitEuler, StickSlipEuler),
    "rk4": (TangentRungeKutta4, StickSlipRungeKutta4),
    "rk4_dexpinv": (TangentRungeKutta4, StickSlipRungeKutta4),
}


class RowsRun:
    """Run of a ball with constraint rows; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        """Starts at time 0; ``settings.orientation`` decides if the orientation is integrated, not the scene."""
        kind = Composite if settings.formulation == "composite" else FreeFlyer
        self.mechanism: BallWithRows = kind(body, bool(settings.orientation))
        self.motion: TangentIntegrator
        rolling, slipping = _INTEGRATORS[settings.integrator]
        if math.isfinite(body.contact.mu_static):
            self.motion = slipping(self.mechanism, settings, body.contact)
        else:
            self.motion = rolling(self.mechanism, settings)
        self._looked_at = self.mechanism.model.createData()  # for sampling, which leaves the running data alone

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.motion.advance(t)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`; no orientation unless it is integrated."""
        model, ball, data = self.mechanism.model, self.mechanism.ball, self._looked_at
        force = self.motion.reaction(data)[1]
        velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[ball]
        return BallSample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1) if self.motion.turns else None,
            force=force,
            sticking=self.motion.sticking,
        )

    def events(self) -> tuple[Event, ...]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`; with unbounded friction only lift-off."""
        return tuple(self.motion.events)

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`: from the model, and from rows and torques at the present state."""
        mechanism, q, v = self.mechanism, self.motion.q, self.motion.v
        model, data, ball = mechanism.model, mechanism.model.createData(), mechanism.ball
        inertia = model.inertias[ball]
        # In both formulations the spin comes last, in orthonormal axes: there the row of slip has the norm a, and
        # rolling resistance the norm f. At rest the resistance has no direction, so it is evaluated for a motion along
        # that row.
        row = mechanism.rows(data, q, v).rows[-2].copy()
        torque = mechanism.rows(data, q, row).resistance
        mu_kinetic = None  # None: friction is unbounded
        if self.motion.mu_static is not None:
            mu_kinetic = float(np.linalg.norm(mechanism.friction(1.0, np.array([1.0, 0.0]))))
        acceleration = self.motion.reaction(data)[0]
        pin.forwardKinematics(model, data, q, v, acceleration)
        of_ball = pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
        return BallBuilt(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(row[-3:])),
            rolling_resistance=float(np.linalg.norm(torque[-3:])),
            mu_static=self.motion.mu_static,
            mu_kinetic=mu_kinetic,
            gap=mechanism.gap(q),
            acceleration=of_ball.linear.copy(),
            angular_acceleration=of_ball.angular.copy(),
            terms=terms_held(resists=torque.any(), slips=mu_kinetic is not None, turns=self.motion.turns),
        )
