"""Results of the formulation ``contact``: state, reactions, the model read back, and its softening."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from proofroll.core.engine import Regularised
from proofroll.core.events import Event
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
    newton_euler,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.pinocchio.contact import UNBOUNDED_FRICTION, ContactSteps
from proofroll.engines.pinocchio.integrators import QUATERNION
from proofroll.engines.pinocchio.settings import PinocchioSettings

# Errors that the solver's tolerance and round-off explain, over what was measured at most on either scene.
_MARGIN = 10.0


class ContactRun(ContactSteps):
    """See :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        super().__init__(body, settings)
        self._body = body
        self._looked_at = self.contact.model.createData()  # for sampling, which leaves the running data alone

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`; the force is that of the step beginning or centred here."""
        contact, kick, data = self.contact, self.kick(), self._looked_at
        # The velocity runs ahead by half a step with leapfrog, once it has begun to run.
        v = 0.5 * (self.v + kick.v) if self.leapfrog and self.started else self.v
        pin.forwardKinematics(contact.model, data, self.q, v)
        velocity = pin.getVelocity(contact.model, data, contact.ball, pin.LOCAL_WORLD_ALIGNED)
        pose = data.oMi[contact.ball]
        return BallSample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1),
            force=contact.axes @ kick.impulse / self.span,
            sticking=kick.status == "stick" if self.bounded else None,
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`; from the model, its contact and its torques now."""
        contact, kick = self.contact, self.kick()
        inertia, point, pose = contact.model.inertias[contact.ball], contact.point, contact.data.oMi[contact.ball]
        # At rest the resistance has no direction, so its lever is looked at in motion.
        triad = self._body.surface.triad(*pose.translation.tolist())
        lever = float(np.linalg.norm(self.resistance(triad, triad[3:6], 1.0)))
        acceleration = (kick.v - self.v) / self.span
        return BallBuilt(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=contact.model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(point.joint2_placement.translation)),
            rolling_resistance=lever,
            mu_static=contact.friction(self.mu_static),
            mu_kinetic=contact.friction(self.mu_kinetic),
            # The plane is posed at the contact; how far the wall is from there, the solver is told besides.
            gap=float(contact.point_data.c1Mc2.translation[2] + self._body.surface.gap(pose.translation)),
            acceleration=acceleration[:3],
            angular_acceleration=pose.rotation @ acceleration[3:],
            regularised=_softened(self._body, self),
            terms=terms_held(
                resists=lever,
                slips=contact.friction(self.mu_static) != UNBOUNDED_FRICTION[self.solver],
                turns=contact.model.joints[contact.ball].nq == QUATERNION,
            ),
        )

    def events(self) -> tuple[Event, ...]:
        """See :class:`proofroll.core.engine_abilities.LocatesEvents`; none with unbounded friction."""
        return tuple(self.happened) if self.bounded else ()


def _softened(body: RollingBall, steps: ContactSteps) -> dict[str, Regularised]:
    """Entries of :attr:`proofroll.elements.ball_on_surface.sampling.BallBuilt.regularised`."""
    dt = steps.dt
    impulse = 0.0 if steps.solver == "pgs" else steps.tolerance  # what the solver leaves of a velocity, but round-off
    natural = natural_acceleration(body)
    # Velocities are wrong by what the solver leaves and by the round-off of the position over a step.
    size = body.ball.radius + float(np.linalg.norm(body.p0))
    velocity = impulse + float(np.finfo(float).eps) * size / dt
    rough = _MARGIN * velocity / (dt * natural)
    reasons = ["round-off of the position, divided by the square of the step, is acceleration"]
    if impulse:
        reasons.append("impulses are found to solver_tolerance")
    missing = dict.fromkeys(("acceleration", "angular acceleration", "N", "F2", "F3"), 0.0)
    if not steps.leapfrog:  # which tells the solver how the wall bends during a step
        missing = {name: value / natural for name, value in _missing_bend(body).items()}
        if max(missing.values()) > rough:
            reasons.append("for the length of a step the wall is a plane, and at time 0 it does not yet bend the path")
    if slip := float(np.linalg.norm(body.slip0)):
        # An impulse opposes the slip at the end of its step, whose direction may have changed by then.
        turned = _MARGIN * dt * float(np.linalg.norm(initial_response(body)[1])) / body.ball.mass / slip
        turned *= (1 + 1 / body.ball.inertia_ratio) * min(body.contact.mu_kinetic, 1.0)
        missing = {name: value + turned for name, value in missing.items()}
        reasons.append("an impulse opposes the slip at its end, which turns")
    because = "; ".join(reasons)
    result = {name: Regularised(value + rough, because) for name, value in missing.items()}
    if not steps.bounded:
        because = f"the friction cone of Pinocchio's solver needs a number, here {steps.mu_static:g}"
        result |= {f"1 / {kind} friction": Regularised(1 / steps.mu_static, because) for kind in ("static", "kinetic")}
    return result


def _missing_bend(body: RollingBall) -> dict[str, float]:
    """Accelerations [m/s²], angular times the radius and forces over the mass, that the bend of the wall makes."""
    acceleration, force = initial_response(body)
    turning = initial_angular_acceleration(body)
    e1 = body.surface.normal(body.p0)
    # In the equations of motion the bend is multiplied by the spin, and nothing else is.
    flat = replace(body, w0=np.zeros(3))
    flat_acceleration, flat_turning, flat_force = body.gravity, np.zeros(3), np.zeros(3)
    # A plane that would have to pull does nothing; round-off is no push.
    if -newton_euler(flat, flat.p0, flat.v0, flat.w0)[2] @ e1 > 1e-9 * float(np.linalg.norm(force)):
        flat_acceleration, flat_force = initial_response(flat)
        flat_turning = initial_angular_acceleration(flat)
    N, F2, F3 = np.abs((force - flat_force) @ body.surface.frame(body.u0)) / body.ball.mass
    return {
        "acceleration": float(np.max(np.abs(acceleration - flat_acceleration))),
        "angular acceleration": float(np.max(np.abs(turning - flat_turning))) * body.ball.radius,
        "N": float(N),
        "F2": float(F2),
        "F3": float(F3),
    }
