"""Formulation ``contact``: a free ball against the wall, with Pinocchio's own frictional contact solver.

In each step the wall is the plane tangent to it at the contact. Pinocchio's PGS or ADMM solver finds the impulse of the
step within its widest friction cone, which stands for unbounded friction.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Regularised, whole_steps
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.pinocchio.ball.integrators import QUATERNION
from proofroll.engines.pinocchio.ball.plane_contact import PlaneContact
from proofroll.engines.pinocchio.settings import PinocchioSettings

# Ratio of friction to its bound above which an impulse lies on the cone [1].
_ON_CONE = 1 - 1e-9
# Normal impulse, relative to that of gravity, that is round-off of the gap: the wall does not press.
_FAINT = 1e-9
# Fixed-point iteration for rolling resistance, which depends on the normal force: most iterations, and tolerance.
_REPEATS, _SETTLED = 10, 1e-13


class Kick(NamedTuple):
    """Impulse of the contact on the ball around the present time.

    Attributes:
        v: joint velocity after it, shape (6,).
        impulse: along the axes of the plane [N s], shape (3,).
        normal_force: mean over the span of the kick [N].
    """

    v: FloatArray
    impulse: FloatArray
    normal_force: float


class ContactSteps:
    """Velocity-level time stepping.

    With ``semi_implicit_euler`` the plane is that at the start of the step, and position and velocity belong to the
    same time. With ``leapfrog`` the velocity is half a step ahead of the position (the first kick is half as long), and
    the solver takes the plane's rate of turning into account, so that in the middle of the step the ball is on the wall
    and does not slip; this is of order 2.

    Attributes:
        contact: Pinocchio's model with its contact.
        dt: step [s].
        leapfrog: True if the velocity is ahead.
        solver, tolerance: Pinocchio's solver, and its tolerance.
        started: True after the first step.
        q, v: joint configuration and velocity.
    """

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        """Starts at time 0.

        Raises:
            Refused: Pinocchio's solver does not find the first impulse within its cone.
        """
        self._surface, self._f = body.surface, body.contact.rolling_resistance
        self.dt, self.leapfrog = float(settings.dt or 0.0), settings.integrator == "leapfrog"
        self.solver, self.tolerance = settings.solver or "pgs", float(settings.solver_tolerance or 0.0)
        self.contact = PlaneContact(body, self.solver, self.tolerance)
        self.q, self.v = self.contact.q0, self.contact.v0
        self.started, self._no_torque = False, np.zeros(6)
        self._lever = 0.5 * self.dt * body.ball.radius
        self._faint = _FAINT * body.ball.mass * float(np.linalg.norm(body.gravity)) * self.dt
        self._normal_force = 0.0  # start of the fixed-point iteration for rolling resistance
        self._time = 0.0
        try:
            self._normal_force = self.kick().normal_force
        except Diverged as error:
            raise Refused(str(error)) from None

    @property
    def span(self) -> float:
        """Duration of the next kick [s]."""
        return self.dt if self.started or not self.leapfrog else 0.5 * self.dt

    def advance(self, end: float) -> None:
        """Advances to ``end`` [s].

        Raises:
            Diverged: Pinocchio's solver does not find the impulse within its cone.
        """
        model, dt, start = self.contact.model, self.dt, self._time
        for number in range(whole_steps(start, end, dt)):
            self._time = start + number * dt
            self.v, _, self._normal_force = self.kick()
            self.started = True
            self.q = pin.integrate(model, self.q, dt * self.v)
        self._time = end

    def kick(self) -> Kick:
        """Impulse around the present time; changes nothing but scratch data."""
        contact, q, v, f = self.contact, self.q, self.v, self._f
        model, data, span = contact.model, contact.data, self.span
        pin.computeJointJacobians(model, data, q)
        place, velocity = q[:3].tolist(), v[:3].tolist()
        gap, *triad, rx, ry, rz = self._surface.moving_triad(*place, *velocity)
        jacobian = contact.pose(place, triad)
        to_joints = contact.inverse.dot(jacobian.T)
        delassus = pin.DelassusOperatorDense(jacobian.dot(to_joints))
        # Shifts of the contact point's velocity along e2, -e3 and -e1; the last closes the gap within the step.
        shift2, shift3, shift1 = 0.0, 0.0, gap / self.dt
        if self.leapfrog:
            # Change due to the normal's turning in half a step: a ω × ė1, and the curvature of the path.
            _, _, _, x2, y2, z2, x3, y3, z3 = triad
            vx, vy, vz = velocity
            wx, wy, wz = contact.turned.dot(v[3:]).tolist()
            tx, ty, tz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
            shift2 = self._lever * (x2 * tx + y2 * ty + z2 * tz)
            shift3 = -self._lever * (x3 * tx + y3 * ty + z3 * tz)
            shift1 -= 0.5 * self.dt * (rx * vx + ry * vy + rz * vz)
        shift = np.array((shift2, shift3, shift1))

        torque, normal_force, centred = self._no_torque, self._normal_force, self.leapfrog and self.started
        for number in range(_REPEATS):
            if f:
                torque = self.resistance(triad, velocity, normal_force)
            free = v + span * pin.aba(model, data, q, v, torque)
            impulse = self._solved(delassus, jacobian.dot(free) + shift)
            v_new = free + to_joints.dot(impulse)
            normal = impulse.item(2) / span
            # N may be right at once, but the direction of the resistance is not yet.
            if not f or (abs(normal - normal_force) <= _SETTLED * abs(normal) and (number or not centred)):
                break
            normal_force = normal
            # the resistance belongs to the present time, which with leapfrog is the middle of the kick
            if centred:
                velocity = (0.5 * (v + v_new)[:3]).tolist()
        return Kick(v_new, impulse, normal)

    def resistance(self, triad: Sequence[float], v: Sequence[float], normal_force: float) -> FloatArray:
        """Generalised force of rolling resistance on the joints, shape (6,), of a ball at ``v`` [m/s]."""
        x, y, z, *_ = triad
        vx, vy, vz = v
        torque, speed = np.zeros(6), math.sqrt(vx * vx + vy * vy + vz * vz)
        if speed > 0:
            f = self._f * normal_force / speed
            moment = np.array((f * (y * vz - z * vy), f * (z * vx - x * vz), f * (x * vy - y * vx)))
            torque[3:] = self.contact.turned.T.dot(moment)
        return torque

    def _solved(self, delassus: Any, free: FloatArray) -> FloatArray:
        """Impulse [N s], shape (3,); ``free``: contact velocity without impulse [m/s].

        Raises:
            Diverged: the solver does not find the impulse, or the impulse lies on the cone.
        """
        impulse, mu = self.contact.impulse(delassus, free), self.contact.friction
        if impulse is None:
            raise Diverged(
                f"Pinocchio's {self.solver} solver did not reach solver_tolerance={self.tolerance:g} at "
                f"{self._time:g} s"
            )
        F2, F3, N = impulse.tolist()
        if self._faint < N and math.hypot(F2, F3) >= _ON_CONE * mu * N:
            raise Diverged(f"at {self._time:g} s more friction is needed than {mu:g} times the normal force")
        return impulse


# Factor on the errors due to solver tolerance and round-off, above the largest measured on any scene.
_MARGIN = 10.0


class ContactRun(ContactSteps):
    """Run of formulation ``contact``; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        super().__init__(body, settings)
        self._body = body
        self._looked_at = self.contact.model.createData()  # for sampling, which leaves the running data alone

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`; the force is that of the step that starts or is centred here."""
        contact, kick, data = self.contact, self.kick(), self._looked_at
        # With leapfrog the velocity is half a step ahead after the first step.
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
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`; from the model, its contact and its torques now."""
        contact, kick = self.contact, self.kick()
        inertia, point, pose = contact.model.inertias[contact.ball], contact.point, contact.data.oMi[contact.ball]
        # At rest the resistance has no direction, so its lever is evaluated in motion.
        triad = self._body.surface.triad(*pose.translation.tolist())
        lever = float(np.linalg.norm(self.resistance(triad, triad[3:6], 1.0)))
        acceleration = (kick.v - self.v) / self.span
        return BallBuilt(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=contact.model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(point.joint2_placement.translation)),
            rolling_resistance=lever,
            mu_static=contact.friction,
            mu_kinetic=contact.friction,
            # The plane is at the contact; the distance of the wall from it enters the solver separately.
            gap=float(contact.point_data.c1Mc2.translation[2] + self._body.surface.gap(pose.translation)),
            acceleration=acceleration[:3],
            angular_acceleration=pose.rotation @ acceleration[3:],
            regularised=_softened(self._body, self),
            terms=terms_held(resists=lever, turns=contact.model.joints[contact.ball].nq == QUATERNION),
        )


def _softened(body: RollingBall, steps: ContactSteps) -> dict[str, Regularised]:
    """Entries of :attr:`proofroll.elements.ball_on_surface.sampling.BallBuilt.regularised`."""
    dt = steps.dt
    # velocity error that the solver leaves beyond round-off
    impulse = 0.0 if steps.solver == "pgs" else steps.tolerance
    natural = natural_acceleration(body)
    # Velocity errors: what the solver leaves, and the round-off of the position over a step.
    size = body.ball.radius + float(np.linalg.norm(body.p0))
    epsilon = float(np.finfo(float).eps)
    velocity = impulse + epsilon * size / dt
    rough = _MARGIN * velocity / (dt * natural)
    if not steps.leapfrog:
        # The wall does not press yet but by the round-off of gravity across it, and friction is bounded by that.
        rough += steps.contact.friction * epsilon * float(np.linalg.norm(body.gravity)) / natural
    reasons = ["round-off of the position, divided by the square of the step, is acceleration"]
    if impulse:
        reasons.append("impulses are found to solver_tolerance")
    missing = dict.fromkeys(("acceleration", "angular acceleration", "N", "F2", "F3"), 0.0)
    if not steps.leapfrog:  # leapfrog tells the solver how the wall curves during a step
        missing = {name: value / natural for name, value in _missing_bend(body).items()}
        if max(missing.values()) > rough:
            reasons.append("for the length of a step the wall is a plane, and at time 0 it does not yet bend the path")
    because = "; ".join(reasons)
    result = {name: Regularised(value + rough, because) for name, value in missing.items()}
    mu = steps.contact.friction
    because = f"the friction cone of Pinocchio's solver needs a number, here {mu:g}"
    return result | {f"1 / {kind} friction": Regularised(1 / mu, because) for kind in ("static", "kinetic")}


def _missing_bend(body: RollingBall) -> dict[str, float]:
    """Parts due to the wall's curvature of the initial accelerations and forces, all in m/s².

    Angular acceleration is multiplied by the radius, forces are divided by the mass.
    """
    acceleration, force = initial_response(body)
    turning = initial_angular_acceleration(body)
    # Gravity is along the wall, so nothing presses a ball on the plane: it falls.
    N, F2, F3 = np.abs(force @ body.surface.frame(body.u0)) / body.ball.mass
    return {
        "acceleration": float(np.max(np.abs(acceleration - body.gravity))),
        "angular acceleration": float(np.max(np.abs(turning))) * body.ball.radius,
        "N": float(N),
        "F2": float(F2),
        "F3": float(F3),
    }
