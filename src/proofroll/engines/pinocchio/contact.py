"""Formulation ``contact``: a free ball against the wall through Pinocchio's own solver of contact with friction.

The wall is presented as a plane, posed anew in each step tangent to it at the contact; Pinocchio's PGS or ADMM solver
finds the impulse of the step in its friction cone. The ball has a translation joint with a spherical joint in it: with
a free-flyer joint the velocity of the centre has components in the ball's turning axes, and a step of semi-implicit
Euler multiplies it by the square root of 1 + (ω dt)², so that a fast ball blows up at any useful step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.engine import Built, Sample, whole_steps
from proofroll.engines.pinocchio.contact_tolerances import softened
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.errors import Diverged, Refused
from proofroll.events import Event, EventKind
from proofroll.scene import Capability, RollingBall
from proofroll.surfaces import FloatArray

# Pinocchio's cone needs a number where friction is unbounded. PGS takes any; the iterations of ADMM grow with it.
UNBOUNDED_FRICTION = {"pgs": 1e6, "admm": 1e2}
# Numbers of a joint's configuration if it is an orientation.
_QUATERNION = 4
# Pinocchio's limit of 1000 is met at tight tolerances where the normal force is small.
_ADMM_ITERATIONS = 10_000
# An impulse nearer to the cone than this is on it [-].
_ON_CONE = 1e-9
# A normal impulse smaller than this part of gravity's is round-off of the gap: the wall does not press.
_FAINT = 1e-9
# The moment of rolling resistance follows the normal force, and is found by repetition.
_REPEATS, _SETTLED = 10, 1e-13


class Kick(NamedTuple):
    """What the contact does to the ball around the present time.

    Attributes:
        before, v: joint velocity before and after it, shape (6,).
        span: duration [s].
        axes: of the plane, as columns in the world.
        impulse: along them [N s], shape (3,).
        status: ``stick``, ``slip``, or ``liftoff`` where the wall does not press.
    """

    before: FloatArray
    v: FloatArray
    span: float
    axes: FloatArray
    impulse: FloatArray
    status: EventKind

    @property
    def force(self) -> FloatArray:
        """Of the wall on the ball in the world, mean over the span [N], shape (3,)."""
        return np.asarray(self.axes @ self.impulse / self.span)


class ContactRun:
    """Velocity-level time stepping; see :class:`proofroll.engine.Engine` for the methods.

    With ``semi_implicit_euler`` the plane is that at the start of the step, and position and velocity belong to the
    same time. With ``leapfrog`` the velocity runs half a step ahead of the position (the first kick is half as long),
    and the rate at which the plane turns is given to the solver, so that at the middle of the step the ball is on the
    wall and does not slip; that is of order 2.
    """

    def __init__(self, body: RollingBall, settings: PinocchioSettings) -> None:
        """At time 0.

        Raises:
            Refused: Pinocchio's solver does not find the first impulse.
        """
        self._body, self._settings = body, settings
        self._surface, self._f = body.surface, body.contact.rolling_resistance
        self._no_torque = np.zeros(6)
        self._dt = float(settings.dt or 0.0)
        self._solver_kind, self._tolerance = settings.solver or "pgs", float(settings.solver_tolerance or 0.0)
        self._leapfrog = settings.integrator == "leapfrog"
        self.model = pin.Model()
        self.model.gravity.linear = body.gravity
        carriage = self.model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "centre")
        self._ball = self.model.addJoint(carriage, pin.JointModelSpherical(), pin.SE3.Identity(), body.ball.name)
        inertia = pin.Inertia(body.ball.mass, np.zeros(3), body.ball.inertia * np.eye(3))
        self.model.appendBodyToJoint(self._ball, inertia, pin.SE3.Identity())
        self._data, self._scratch = self.model.createData(), self.model.createData()
        self._q = np.concatenate([body.p0, [0.0, 0.0, 0.0, 1.0]])
        self._v = np.concatenate([body.v0, body.w0])
        self._started = False
        # A ball in these joints has the same mass matrix in every configuration. Pinocchio fills the upper triangle.
        inverse = np.triu(pin.computeMinverse(self.model, self._data, self._q))
        self._inverse = inverse + np.triu(inverse, 1).T
        self._faint = _FAINT * body.ball.mass * float(np.linalg.norm(body.gravity)) * self._dt

        point = pin.PointContactConstraintModel(self.model, 0, pin.SE3.Identity(), self._ball, pin.SE3.Identity())
        self._models, self._datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
        self._models.append(pin.ConstraintModel(point))
        self._datas.append(self._models[0].createData())
        # Both refer to what is in the vectors; to extract them again takes longer than to solve for the impulse.
        self._point, self._point_data = self._models[0].extract(), self._datas[0].extract()
        self._bounded = math.isfinite(body.contact.mu_static)
        unbounded = UNBOUNDED_FRICTION[self._solver_kind]
        self._mu_static = body.contact.mu_static if self._bounded else unbounded
        self._mu_kinetic = body.contact.mu_kinetic if self._bounded else unbounded
        self._solver, self._options, self._result = _solver(self._solver_kind, self._tolerance)

        self._status: EventKind = "stick"
        self._pressed = False
        self._normal_force = 0.0
        self._events: list[Event] = []
        self._time = 0.0
        try:
            kick = self._kick()
        except Diverged as error:
            raise Refused(str(error)) from None
        if self._bounded and kick.status == "slip":
            self._status = "slip"
            self._events.append(Event("slip", 0.0, 0.0, 0.0))

    def advance(self, start: float, end: float) -> None:
        """From ``start`` to ``end`` [s].

        Raises:
            Diverged: Pinocchio's solver did not find the impulse.
        """
        for number in range(whole_steps(start, end, self._dt)):
            self._time = start + number * self._dt
            kick = self._kick()
            if kick.status != self._status:
                before = max(self._time - self._dt, 0.0)
                self._events.append(Event(kick.status, 0.5 * (before + self._time), before, self._time))
            self._status, self._started = kick.status, True
            self._pressed = self._pressed or bool(kick.impulse.any())
            self._v = kick.v
            self._q = pin.integrate(self.model, self._q, self._dt * kick.v)
        self._time = end

    def _kick(self) -> Kick:
        """The impulse around the present time. Changes nothing but scratch data."""
        model, data, q, v = self.model, self._data, self._q, self._v
        span = self._dt if self._started or not self._leapfrog else 0.5 * self._dt
        pin.computeAllTerms(model, data, q, v)
        velocity, pose = pin.getVelocity(model, data, self._ball, pin.LOCAL_WORLD_ALIGNED), data.oMi[self._ball]
        back, v_WB = pose.rotation.T, velocity.linear.tolist()
        x, y, z = place = pose.translation.tolist()
        triad = self._surface.triad(x, y, z)
        axes = self._pose(place, back, triad)
        self._point.calc(model, data, self._point_data)
        jacobian = self._point.jacobian(model, data, self._point_data)
        to_joints = self._inverse.dot(jacobian.T)
        delassus = pin.DelassusOperatorDense(jacobian.dot(to_joints))
        shift = np.array(self._shift(place, v_WB, velocity.angular.tolist(), triad))

        f, torque, normal_force = self._f, self._no_torque, self._normal_force
        velocity_now, centred = v_WB, self._leapfrog and self._started
        for number in range(_REPEATS):
            if f:
                torque = self._resistance(triad, back, velocity_now, normal_force)
            free = v + span * pin.aba(model, data, q, v, torque)
            impulse, status = self._solve(delassus, jacobian.dot(free) + shift)
            after = free + to_joints.dot(impulse)
            found = float(impulse[2]) / span
            # On a plane N is right at once, but the direction of the resistance is not yet.
            if not f or (abs(found - normal_force) <= _SETTLED * abs(found) and (number or not centred)):
                break
            normal_force = found
            # the resistance is that at the present time, which with leapfrog is the middle of the kick
            if centred:
                velocity_now = (0.5 * (v + after)[:3]).tolist()
        self._normal_force = found  # only where the next repetition starts
        if status == "liftoff" and not self._pressed:
            status = self._status  # a plane does not press before the ball has moved into it
        return Kick(v, after, span, axes, impulse, status)

    def _pose(self, p: Sequence[float], back: FloatArray, triad: Sequence[float]) -> FloatArray:
        """Poses the plane, and returns its axes as columns, the last one from the wall into the ball.

        Args:
            p: centre of the ball [m].
            back: rotation from the world into the ball's axes.
            triad: components of e1, e2, e3.
        """
        x1, y1, z1, x2, y2, z2, x3, y3, z3 = triad
        x, y, z = p
        a = self._body.ball.radius
        arm = np.array((a * x1, a * y1, a * z1))
        axes = np.array((x2, -x3, -x1, y2, -y3, -y1, z2, -z3, -z1)).reshape(3, 3)
        self._point.joint1_placement = pin.SE3(axes, np.array((x + a * x1, y + a * y1, z + a * z1)))
        self._point.joint2_placement = pin.SE3(back.dot(axes), back.dot(arm))
        return axes

    def _shift(
        self, p: Sequence[float], v: Sequence[float], w: Sequence[float], triad: Sequence[float]
    ) -> tuple[float, float, float]:
        """What is added to the velocity of the contact point, along the axes of the plane, e2, -e3 and -e1 [m/s].

        That the gap closes within the step; and with leapfrog what the turning of the normal adds in half a step,
        a ω × ė1 and the bend of the path.
        """
        x, y, z = p
        closing = self._surface.nearby(x, y, z)[0] / self._dt
        if not self._leapfrog:
            return 0.0, 0.0, closing
        _, _, _, x2, y2, z2, x3, y3, z3 = triad
        vx, vy, vz = v
        rx, ry, rz = self._surface.normal_rate((x, y, z), (vx, vy, vz))
        wx, wy, wz = w
        tx, ty, tz = wy * rz - wz * ry, wz * rx - wx * rz, wx * ry - wy * rx
        half = 0.5 * self._dt
        lever = half * self._body.ball.radius
        return (
            lever * (x2 * tx + y2 * ty + z2 * tz),
            -lever * (x3 * tx + y3 * ty + z3 * tz),
            closing - half * (rx * vx + ry * vy + rz * vz),
        )

    def _resistance(
        self, triad: Sequence[float], back: FloatArray, v: Sequence[float], normal_force: float
    ) -> FloatArray:
        """Rolling resistance on the joints [N m], shape (6,); zero where the ball, at ``v`` [m/s], rests."""
        x, y, z, *_ = triad
        vx, vy, vz = v
        torque, speed = np.zeros(6), math.sqrt(vx * vx + vy * vy + vz * vz)
        if speed > 0:
            f = self._f * normal_force / speed
            torque[3:] = back.dot(np.array((f * (y * vz - z * vy), f * (z * vx - x * vz), f * (x * vy - y * vx))))
        return torque

    def _solve(self, delassus: Any, free: FloatArray) -> tuple[FloatArray, EventKind]:
        """The impulse [N s] for the velocity of the contact point that it would have without, each shape (3,)."""
        mu = self._mu_static if self._status == "stick" else self._mu_kinetic
        impulse = self._impulse(delassus, free, mu)
        status = self._judged(impulse, mu)
        if status == "slip" and not self._bounded:
            raise Diverged(f"at {self._time:g} s more friction is needed than {mu:g} times the normal force")
        if status == "slip" and mu != self._mu_kinetic:
            impulse = self._impulse(delassus, free, self._mu_kinetic)
        return impulse, status

    def _judged(self, impulse: FloatArray, mu: float) -> EventKind:
        F2, F3, N = impulse.tolist()
        if not self._faint < N:
            return "liftoff"
        on_cone = math.hypot(F2, F3) >= mu * N * (1 - _ON_CONE)
        return "slip" if on_cone else "stick"

    def _impulse(self, delassus: Any, free: FloatArray, mu: float) -> FloatArray:
        self._point.setFriction(mu)
        # No guess from the last step: the answer must not depend on what was looked at in between.
        self._result.reset()
        found = self._solver.solve(delassus, free, self._models, self._datas, self._options, self._result)
        if not found:
            raise Diverged(
                f"Pinocchio's {self._solver_kind} solver did not reach solver_tolerance={self._tolerance:g} "
                f"at {self._time:g} s"
            )
        return np.array(self._result.retrieveConstraintImpulses())

    def _now(self, kick: Kick) -> FloatArray:
        """Joint velocity at the present time, shape (6,)."""
        if not (self._leapfrog and self._started):
            return kick.before
        return np.asarray(0.5 * (kick.before + kick.v))

    def sample(self) -> Sample:
        """See :class:`proofroll.engine.Engine`; the force is that of the step beginning or centred here."""
        kept = self._normal_force
        kick = self._kick()
        self._normal_force = kept
        pin.forwardKinematics(self.model, self._scratch, self._q, self._now(kick))
        velocity = pin.getVelocity(self.model, self._scratch, self._ball, pin.LOCAL_WORLD_ALIGNED)
        pose = self._scratch.oMi[self._ball]
        return Sample(
            p_WB=pose.translation.copy(),
            v_WB=velocity.linear.copy(),
            w_WB=velocity.angular.copy(),
            q_WB=np.roll(pin.Quaternion(pose.rotation).coeffs(), 1),
            force=kick.force,
            sticking=kick.status == "stick" if self._bounded else None,
        )

    def built(self) -> Built:
        """See :class:`proofroll.engine.Engine`: from the model, and from its contact and torques at the state now."""
        kept = self._normal_force
        kick = self._kick()
        self._normal_force = kept
        inertia = self.model.inertias[self._ball]
        pose, point = self._data.oMi[self._ball], self._point_data
        f = 0.0
        if self._f:
            # At rest it has no direction, so it is looked at in motion: along the first axis of the plane.
            along = self._point.joint1_placement.rotation[:, 0].tolist()
            triad = self._surface.triad(*pose.translation.tolist())
            f = float(np.linalg.norm(self._resistance(triad, pose.rotation.T, along, 1.0)))
        acceleration = (kick.v - kick.before) / kick.span
        return Built(
            mass=float(inertia.mass),
            inertia=np.linalg.eigvalsh(inertia.inertia),
            gravity=self.model.gravity.linear.copy(),
            ball_radius=float(np.linalg.norm(self._point.joint2_placement.translation)),
            rolling_resistance=f,
            mu_static=self._friction(self._mu_static),
            mu_kinetic=self._friction(self._mu_kinetic),
            # The plane is posed at the contact; how far the wall is from there, the solver is told besides.
            gap=float(point.c1Mc2.translation[2] + self._body.surface.gap(pose.translation)),
            acceleration=acceleration[:3],
            angular_acceleration=pose.rotation @ acceleration[3:],
            regularised=softened(
                self._body,
                bends=self._leapfrog,
                dt=self._dt,
                impulse=0.0 if self._solver_kind == "pgs" else self._tolerance,
                unbounded=None if self._bounded else UNBOUNDED_FRICTION[self._solver_kind],
            ),
            terms=frozenset(self._terms(f)),
        )

    def _terms(self, f: float) -> Iterator[Capability]:
        """What there is besides rolling: the torque's lever f [m], the cone, and a joint that turns the ball."""
        if f:
            yield Capability.ROLLING_RESISTANCE
        if self._friction(self._mu_static) != UNBOUNDED_FRICTION[self._solver_kind]:
            yield Capability.BOUNDED_FRICTION
        if self.model.joints[self._ball].nq == _QUATERNION:
            yield Capability.ORIENTATION

    def _friction(self, mu: float) -> float:
        """What the cone of the constraint holds if it is given ``mu``, as before each impulse."""
        self._point.setFriction(mu)
        return float(self._point.getFriction())

    def events(self) -> tuple[Event, ...]:
        """See :class:`proofroll.engine.LocatesEvents`; none with unbounded friction."""
        return tuple(self._events) if self._bounded else ()


def _solver(kind: str, tolerance: float) -> tuple[Any, Any, Any]:
    """Solver, its options and its result for one contact."""
    if kind == "pgs":
        solver, options, result = pin.PGSConstraintSolver(3), pin.PGSSolverSettings(), pin.PGSSolverResult()
    else:
        solver, options, result = pin.ADMMConstraintSolver(3), pin.ADMMSolverSettings(), pin.ADMMSolverResult()
        options.max_iterations = _ADMM_ITERATIONS
    for name in ("feasibility", "complementarity"):
        for bound in ("absolute", "relative"):
            setattr(options, f"{bound}_{name}_tol", tolerance)
    return solver, options, result
