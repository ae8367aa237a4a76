"""Pinocchio without the adapter: its kinematics, dynamics and contact solver, with the cylinder's directions by hand.

The model with rows of rolling is built here, and runs under scipy's DOP853, as the adapter's preset ``matched`` does.
Of mechanisms, loops and impulses are proofroll's on Pinocchio's terms, and so they are here.
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
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.engines.pinocchio.contact.impulses import ImpulseSteps
from proofroll.engines.pinocchio.smooth.constraint_dynamics import ConstraintDynamics
from proofroll.engines.pinocchio.smooth.joint_tree import JointTree
from proofroll.engines.pinocchio.smooth.null_space import LoopRows, NullSpace
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll_benchmarks.bare import Bare, in_vertical_cylinder
from proofroll_benchmarks.bare.steps import dop853, rk4


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
    """Proofroll's equations on Pinocchio's terms in a plain loop; of contacts, its steps."""
    mechanism = mechanism_of(scene)
    if settings.formulation == "impulses":
        return _impulses(mechanism, settings)
    tree = JointTree(mechanism)
    if tree.varies:
        raise Refused("there is no bare loop with signals that change in time")
    model, data, rows, nq = tree.model, tree.model.createData(), LoopRows(tree), tree.model.nq
    mu, turns, start = settings.proximal, nq != tree.model.nv, np.concatenate([tree.q0, tree.v0])
    dynamics = NullSpace(tree, rows) if mu is None else ConstraintDynamics(tree, mu)

    def rates(y: FloatArray) -> FloatArray:
        q, v = y[:nq], y[nq:]
        if not turns:
            return np.concatenate([v, dynamics.acceleration(data, q, v)])
        q = pin.normalize(model, q)
        return np.concatenate([pin.tangentMap(model, q) @ v, dynamics.acceleration(data, q, v)])

    def after(y: FloatArray) -> FloatArray:
        q, v = pin.normalize(model, y[:nq]) if turns else y[:nq], y[nq:]
        if settings.projection and rows.rank:
            q, v = rows.eliminated(data, q, v)
        return np.concatenate([q, v])

    def accepted(solver: DOP853, _: float) -> None:
        solver.y = after(solver.y)
        solver.f = rates(solver.y)

    def last(times: FloatArray) -> FloatArray:
        if settings.integrator != "dop853":
            return rk4(rates, start, times, settings.dt, after)
        solver = DOP853(lambda _, y: rates(y), 0.0, start, np.inf, rtol=settings.rtol, atol=settings.rtol)
        dop853(solver, times, accepted)
        return np.asarray(solver.y)

    def run(times: FloatArray) -> FloatArray:
        return _origins(tree, last(times)[:nq])

    return Bare(run, 1e-11, "the same steps; sums are in another order")


def _impulses(mechanism: Mechanism, settings: Any) -> Bare:
    tree = JointTree(mechanism, apart=True)
    steps = ImpulseSteps(tree, settings)

    def run(times: FloatArray) -> FloatArray:
        for number in range(round(float(times[-1]) / settings.dt)):
            steps.t = number * settings.dt
            steps.step()
            if not np.isfinite(steps.v.sum()):
                raise Diverged("the state is not finite")
        return _origins(tree, steps.q)

    return Bare(run, 1e-9, "times are rounded otherwise")


def _origins(tree: JointTree, q: FloatArray) -> FloatArray:
    """Origins of all bodies [m]."""
    data = tree.model.createData()
    pin.framesForwardKinematics(tree.model, data, q)
    return np.array([data.oMf[frame].translation for frame in tree.body])


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
