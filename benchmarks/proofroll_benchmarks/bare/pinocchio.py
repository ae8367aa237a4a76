"""Pinocchio without the adapter: its kinematics, dynamics and contact solver, with the cylinder's directions by hand.

The models with rows are built here; the plane and its solver come from the adapter's builder. Rows with rolling run
under scipy's DOP853, as the adapter's preset ``matched`` does. The loop of mechanisms is
:mod:`mechanism_loop`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.joint_kinds import FACTS
from proofroll.engines.pinocchio.ball.plane_contact import PlaneContact
from proofroll.engines.pinocchio.smooth.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.smooth.mechanism_run import MechanismRun
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder, is_mechanism
from proofroll_benchmarks.bare.mechanism_loop import MechanismLoop
from proofroll_benchmarks.bare.steps import dop853


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    if is_mechanism(scene):
        return _mechanism(scene, settings)
    body = in_vertical_cylinder(scene)
    if settings.formulation == "contact":
        if settings.solver != "pgs":
            raise Refused("there is no bare loop with the ADMM solver")
        return Bare(_contact(body, settings), 1e-9, "the geometry is rounded otherwise, and the solver stops at 1e-12")
    if settings.integrator != "dop853" or not settings.projection:
        raise Refused("there is a bare loop only with dop853 and projection")
    if settings.orientation or MechanismCapability.ORIENTATION in scene.requires:
        raise Refused("there is no bare loop that follows the ball's orientation")
    rows = (_Composite if settings.formulation == "composite" else _FreeFlyer)(body)
    return Bare(
        _rows_run(rows, settings),
        1e-9,
        "the geometry is rounded otherwise, so the steps differ within their tolerance",
    )


def _mechanism(scene: Scene, settings: Any) -> Bare:
    if settings.formulation == "impulses":
        raise Refused("there is no bare loop of contacts between bodies")
    mechanism_run = MechanismRun(mechanism_of(scene), settings)
    loop, frames = _loop_of(mechanism_run, settings), mechanism_run.tree.body

    def run(times: FloatArray) -> FloatArray:
        last = loop.last(times)
        loop.place(last[: loop.model.nq], last[loop.model.nq :])
        return np.array([loop.data.oMf[frame].translation for frame in frames])

    return Bare(run, 1e-11, "the same steps; sums are in another order")


def _loop_of(run: MechanismRun, settings: Any) -> MechanismLoop:
    """The loop without the adapter, on the model of a run at time 0.

    Raises:
        Refused: the mechanism has actuators, couplings, or drives in time.
    """
    if run.tree.mechanism.actuators or run.tree.mechanism.couplings or run.tree.varies:
        raise Refused("there is no bare loop with actuators, couplings or drives in time")
    tree, constraints = run.tree, run.dynamics if isinstance(run.dynamics, ConstraintDynamics) else None
    adaptive = settings.integrator == "dop853"
    return MechanismLoop(
        tree.model,
        np.concatenate([tree.q0, tree.v0]),
        [
            (a, b, FACTS[loop.kind].translations, FACTS[loop.kind].rotations)
            for loop, (a, b) in zip(tree.mechanism.loops, tree.loops, strict=True)
        ],
        [(a, b, spring.stiffness, spring.damping, spring.length) for spring, a, b in tree.springs],
        [(stiffness, rest, q.start, v.start) for stiffness, rest, q, v in tree.sprung],
        tree.drive,
        tree.damping,
        run.rank,
        bool(settings.projection and run.rank),
        0.0 if adaptive else settings.dt or 0.0,
        settings.rtol or 0.0 if adaptive else 0.0,
        (constraints.constraints, pin.ProximalSettings(*constraints.proximal)) if constraints and tree.loops else None,
    )


def _ball(body: RollingBall) -> Any:
    return pin.Inertia(body.ball.mass, np.zeros(3), body.ball.inertia * np.eye(3))


class _Composite:
    """Revolute and prismatic joint of a massless carriage, and a spherical joint in it: two rows of rolling.

    The spherical joint stays as it is, for the inertia of a ball is the same about all axes. So the joint's own axes
    are the local ones, along which the Jacobian and the rows of rolling do not change.
    """

    def __init__(self, body: RollingBall) -> None:
        self.c, self.a = body.surface.length_scales[0], body.ball.radius
        self.f, self.m = body.contact.rolling_resistance, body.ball.mass
        self.model = pin.Model()
        self.model.gravity.linear = body.gravity
        turn = self.model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "gamma")
        rise = self.model.addJoint(turn, pin.JointModelPZ(), pin.SE3.Identity(), "z")
        centre = pin.SE3(np.eye(3), np.array([self.c, 0.0, 0.0]))
        self.ball = self.model.addJoint(rise, pin.JointModelSpherical(), centre, "ball")
        self.model.appendBodyToJoint(self.ball, _ball(body), pin.SE3.Identity())
        self.data = self.model.createData()
        self.rest = np.zeros(5)
        self.directions = np.array([[0.0, 1.0, 0.0, 0.0, 0.0, self.a], [0.0, 0.0, 1.0, 0.0, -self.a, 0.0]])
        self.moving, self.q = 2, np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        jacobian = np.array(pin.computeJointJacobian(self.model, self.data, self.q, self.ball))
        self.rows, self.by_moment = self.directions @ jacobian, jacobian[3:].T.copy()
        self.v = np.array([*body.udot0, *(body.w0 - [0.0, 0.0, body.udot0[0]])])
        a, speed = self.a, float(np.linalg.norm(body.v0))
        self.sizes = np.array([a / self.c, a, speed / self.c, speed, *[speed / a] * 3])

    def respond(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Joint acceleration; multipliers in ``data.lambda_c``."""
        model, data = self.model, self.data
        pin.forwardKinematics(model, data, q, v, self.rest)
        pin.crba(model, data, q)
        pin.nonLinearEffects(model, data, q, v)
        drift = self.directions.dot(pin.getClassicalAcceleration(model, data, self.ball, pin.LOCAL).vector)
        drift[1] += self.a * v[0] * v[2]  # a ω1 γ̇, for the axis of γ̇ is e3
        torque = self.rest
        if self.f:
            turn, rise = v[:2].tolist()
            scale = self.f * self.m * self.c * turn * turn / math.hypot(self.c * turn, rise)
            torque = self.by_moment.dot(np.array([0.0, -scale * rise, scale * self.c * turn]))
        return np.array(pin.forwardDynamics(model, data, torque, self.rows, drift))

    def project(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """The velocities without slip."""
        pin.crba(self.model, self.data, q)
        return np.array(pin.impulseDynamics(self.model, self.data, v, self.rows))

    def centre(self, q: FloatArray) -> FloatArray:
        """Centre of the ball [m]."""
        return np.array([self.c * math.cos(q[0]), self.c * math.sin(q[0]), q[1]])


class _FreeFlyer:
    """Six freedoms and three rows, that of the wall first. The ball is not turned, so its axes are the world's."""

    def __init__(self, body: RollingBall) -> None:
        self.c, self.a, self.f = body.surface.length_scales[0], body.ball.radius, body.contact.rolling_resistance
        self.model = pin.Model()
        self.model.gravity.linear = body.gravity
        self.ball = self.model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
        self.model.appendBodyToJoint(self.ball, _ball(body), pin.SE3.Identity())
        self.data = self.model.createData()
        self.rest = np.zeros(6)
        self.directions = np.zeros((3, 6))
        self.directions[1, 5], self.directions[2, 2] = self.a, 1.0
        self.matrix = np.zeros((9, 9))
        self.moving, self.q = 3, np.array([*body.p0, 0.0, 0.0, 0.0, 1.0])
        self.v = np.concatenate([body.v0, body.w0])
        a, speed = self.a, float(np.linalg.norm(body.v0))
        self.sizes = np.array([a, a, a, *[speed] * 3, *[speed / a] * 3])

    def aim(self, q: FloatArray) -> tuple[float, float]:
        """The rows where the ball is, and e1; the joint has the velocities of the ball, with no Jacobian between."""
        x, y = q[:2].tolist()
        r, D, a = math.sqrt(x * x + y * y), self.directions, self.a
        ex, ey = x / r, y / r
        D[0, 0], D[0, 1] = ex, ey
        D[1, 0], D[1, 1] = -ey, ex
        D[2, 3], D[2, 4] = a * ey, -a * ex
        return ex, ey

    def rows(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rows, their drift, and the moment of rolling resistance on the joint per newton of normal force."""
        model, data, D, a = self.model, self.data, self.directions, self.a
        pin.crba(model, data, q)
        pin.nonLinearEffects(model, data, q, v)
        ex, ey = self.aim(q)
        vx, vy, vz, wx, wy, wz = v.tolist()
        turning = (vy * ex - vx * ey) / self.c
        bx, by, bz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx  # ω × v
        lateral = a * turning * (wx * ex + wy * ey)
        drift = np.array((ex * bx + ey * by + turning * turning * self.c, ex * by - ey * bx, bz + lateral))
        if not self.f:
            return D, drift, self.rest
        scale = self.f / math.sqrt(vx * vx + vy * vy + vz * vz)
        # e1 × v
        moment = np.array([scale * ey * vz, -scale * ex * vz, scale * (ex * vy - ey * vx)])
        return D, drift, np.concatenate([self.rest[:3], moment])

    def respond(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration in the world's axes."""
        rows, drift, moment = self.rows(q, v)
        if not self.f:
            acceleration = np.array(pin.forwardDynamics(self.model, self.data, self.rest, rows, drift))
        else:
            matrix = self.matrix
            matrix[:6, :6], matrix[6:, :6], matrix[:6, 6:] = self.data.M, rows, -rows.T
            matrix[:6, 6] += moment
            solution = np.linalg.solve(matrix, np.concatenate([-self.data.nle, -drift]))
            acceleration = solution[:6]
        # The joint accelerates in axes that turn with the ball.
        vx, vy, vz, wx, wy, wz = v.tolist()
        acceleration[0] += wy * vz - wz * vy
        acceleration[1] += wz * vx - wx * vz
        acceleration[2] += wx * vy - wy * vx
        return acceleration

    def project(self, q: FloatArray, v: FloatArray) -> FloatArray:
        """The velocities without slip; the centre is put back on the wall."""
        x, y = q[:2].tolist()
        q[:2] *= self.c / math.sqrt(x * x + y * y)
        pin.crba(self.model, self.data, q)
        self.aim(q)
        return np.array(pin.impulseDynamics(self.model, self.data, v, self.directions))

    def centre(self, q: FloatArray) -> FloatArray:
        """Centre of the ball [m]."""
        return np.array(q[:3])


def _rows_run(mechanism: _Composite | _FreeFlyer, settings: Any) -> Callable[[FloatArray], FloatArray]:
    q, n = mechanism.q, mechanism.moving

    def rates(_: float, y: FloatArray) -> FloatArray:
        q[:n], v = y[:n], y[n:]
        return np.concatenate([v[:n], mechanism.respond(q, v)])

    def accepted(solver: DOP853, _: float) -> None:
        q[:n] = solver.y[:n]
        v = mechanism.project(q, solver.y[n:])
        solver.y = np.concatenate([q[:n], v])
        solver.f = rates(solver.t, solver.y)

    def run(times: FloatArray) -> FloatArray:
        start = np.concatenate([q[:n], mechanism.v])
        # A hundredth of the natural sizes, for components in turning axes pass through zero all the time.
        atol = 1e-2 * settings.rtol * mechanism.sizes
        solver = DOP853(rates, 0.0, start, np.inf, rtol=settings.rtol, atol=atol)
        dop853(solver, times, accepted)
        return mechanism.centre(q)

    return run


def _contact(body: RollingBall, settings: Any) -> Callable[[FloatArray], FloatArray]:  # noqa: PLR0915 -- one loop, as a user writes it down
    """Velocity-level steps, each with the plane tangent to the cylinder at the ball."""
    a, c, dt, f = body.ball.radius, body.surface.length_scales[0], settings.dt, body.contact.rolling_resistance
    leapfrog = settings.integrator == "leapfrog"
    known = PlaneContact(body, "pgs", settings.solver_tolerance)
    model, data, ball, inverse, point, point_data = (
        known.model, known.data, known.ball, known.inverse, known.point, known.point_data
    )  # fmt: skip
    axes, torque, shift = np.zeros((3, 3)), np.zeros(6), np.zeros(3)
    axes[2, 1] = -1.0
    arm, foot = np.zeros(3), np.zeros(3)
    on_wall, on_ball = point.joint1_placement, point.joint2_placement  # what is written there is in the contact

    def solve(delassus: Any, free: FloatArray) -> FloatArray:
        """Impulse [N s]."""
        impulse = known.impulse(delassus, free)
        if impulse is None:
            raise Diverged("Pinocchio's solver did not converge")
        F1, F2, N = impulse.tolist()
        if N <= 0:
            raise Diverged("the ball leaves the wall, for which there is no bare loop")
        if math.hypot(F1, F2) >= known.friction * N * (1 - 1e-9):
            raise Diverged("more friction is needed than the cone has")
        return impulse

    def run(times: FloatArray) -> FloatArray:
        q, v, span, normal_force = known.q0, known.v0, 0.5 * dt if leapfrog else dt, 0.0
        count = round(float(times[-1]) / dt)
        for number in range(count):
            pin.computeJointJacobians(model, data, q)
            turned = data.oMi[ball].rotation
            x, y, z = q[:3].tolist()
            r = math.sqrt(x * x + y * y)
            ex, ey = x / r, y / r
            axes[0, 0], axes[1, 0], axes[0, 2], axes[1, 2] = -ey, ex, -ex, -ey
            arm[0], arm[1] = a * ex, a * ey
            foot[0], foot[1], foot[2] = x + a * ex, y + a * ey, z
            on_wall.rotation, on_wall.translation = axes, foot
            on_ball.rotation, on_ball.translation = turned.T.dot(axes), turned.T.dot(arm)
            point.calc(model, data, point_data)
            jacobian = point.jacobian(model, data, point_data)
            to_joints = inverse.dot(jacobian.T)
            delassus = pin.DelassusOperatorDense(jacobian.dot(to_joints))
            vx, vy, vz = v[:3].tolist()
            shift[1], shift[2] = 0.0, (c - r) / dt
            if leapfrog:
                wx, wy, _ = turned.dot(v[3:]).tolist()
                turning = (vy * ex - vx * ey) / r
                # Along -e3 the term a ω × ė1, along -e1 the bend of the path.
                shift[1] = -0.5 * dt * a * turning * (wx * ex + wy * ey)
                shift[2] -= 0.5 * dt * turning * turning * r
            along = (vx, vy, vz)
            for _ in range(10):
                if f:
                    ux, uy, uz = along
                    scale = f * normal_force / math.sqrt(ux * ux + uy * uy + uz * uz)
                    moment = np.array([scale * ey * uz, -scale * ex * uz, scale * (ex * uy - ey * ux)])
                    torque[3:] = turned.T.dot(moment)
                free = v + span * pin.aba(model, data, q, v, torque)
                impulse = solve(delassus, jacobian.dot(free) + shift)
                after = free + to_joints.dot(impulse)
                normal = float(impulse[2]) / span
                if not f or abs(normal - normal_force) <= 1e-13 * abs(normal):
                    break
                normal_force = normal
                along = tuple((0.5 * (v + after)[:3]).tolist()) if leapfrog and number else (vx, vy, vz)
            normal_force = normal
            v = after
            q = pin.integrate(model, q, dt * v)
            span = dt
        return np.array(q[:3])

    return run
