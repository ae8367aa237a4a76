"""Pinocchio without the adapter: its kinematics, dynamics and contact solver, with the cylinder's directions by hand.

The model with rows of rolling is built here, and runs under scipy's DOP853, as the adapter's preset ``matched`` does.
The loop of mechanisms is :mod:`mechanism_loop`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.integrate import DOP853

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.joint_kinds import FACTS
from proofroll.engines.pinocchio.smooth.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.smooth.mechanism_run import MechanismRun
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder
from proofroll_benchmarks.bare.mechanism_loop import MechanismLoop
from proofroll_benchmarks.bare.steps import dop853


def prepare(scene: Scene, settings: Any) -> Bare:
    """See :mod:`proofroll_benchmarks.bare`."""
    if settings.formulation != "composite":
        return _mechanism(scene, settings)
    body = in_vertical_cylinder(scene)
    if settings.integrator != "dop853" or not settings.projection:
        raise Refused("there is a bare loop only with dop853 and projection")
    if settings.orientation or MechanismCapability.ORIENTATION in scene.requires:
        raise Refused("there is no bare loop that follows the ball's orientation")
    return Bare(
        _rows_run(_Composite(body), settings),
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


def _rows_run(mechanism: _Composite, settings: Any) -> Callable[[FloatArray], FloatArray]:
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
