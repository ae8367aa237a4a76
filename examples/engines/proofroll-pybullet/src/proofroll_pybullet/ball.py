"""A free ball against a static plane that is posed before each step, tangent to the wall at the contact.

PyBullet has no smooth concave wall. Its own contact solver finds the impulses of the normal force and of friction in a
cone, with the wall's normal at the start of the step (semi-implicit Euler, first order).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.adapter import (
    ALL_OF_A_BALL,
    BallBuilt,
    BallSample,
    Diverged,
    MechanismCapability,
    Regularised,
    RollingBall,
    RunOnBody,
    Scene,
    natural_acceleration,
    on_body,
    rolling_ball,
    terms_held,
    whole_steps,
)
from proofroll_pybullet.settings import PybulletSettings
from proofroll_pybullet.world import World

PROVIDES: frozenset[str] = ALL_OF_A_BALL
INHERENT = {MechanismCapability.ORIENTATION: "every rigid body of PyBullet has one"}
# Coefficient that stands for unbounded friction; larger ones would cost the solver digits in double precision.
UNBOUNDED = 1e6
_FLAT = "for the length of a step the wall is a plane, and the first step does not yet know that it bends"
_NUMBER = f"PyBullet's cone needs a number, here {UNBOUNDED:g}"


class PybulletBall:
    """Run of a ball; see :class:`proofroll.core.engine.Engine` for the methods."""

    def __init__(self, body: RollingBall, settings: PybulletSettings) -> None:
        self._body, self._settings, self._steps = body, settings, 0
        self._world = World(body.gravity.tolist(), settings)
        self._ball = self._sphere(UNBOUNDED)
        shape = self._world.createCollisionShape(self._world.GEOM_PLANE, planeNormal=[0, 0, 1])
        self._plane = self._world.createMultiBody(0, shape)
        self._world.changeDynamics(self._plane, -1, lateralFriction=1)
        if settings.preset == "matched":
            self._world.changeDynamics(
                self._ball, -1, linearDamping=0, angularDamping=0, restitution=0, maxJointVelocity=1e9,
                activationState=self._world.ACTIVATION_STATE_DISABLE_SLEEPING,
            )  # fmt: skip
        self._world.resetBaseVelocity(self._ball, body.v0.tolist(), body.w0.tolist())
        self._normal_force = 0.0
        if body.contact.rolling_resistance:
            self._normal_force = self._first_normal_force()

    @classmethod
    def build(cls, scene: Scene, settings: PybulletSettings) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`."""
        return on_body(cls(rolling_ball(scene), settings), scene)

    def _sphere(self, mu: float) -> int:
        body = self._body
        shape = self._world.createCollisionShape(self._world.GEOM_SPHERE, radius=body.ball.radius)
        ball: int = self._world.createMultiBody(body.ball.mass, shape, basePosition=body.p0.tolist())
        inertia = [body.ball.inertia] * 3
        self._world.changeDynamics(ball, -1, localInertiaDiagonal=inertia, lateralFriction=mu)
        return ball

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        dt = self._settings.dt
        for _ in range(whole_steps(self._steps * dt, t, dt)):
            self._step()
            self._steps += 1

    def _step(self) -> None:
        """Makes one step: poses the plane at the wall, and applies the moment of rolling resistance."""
        p, _ = self._pose()
        surface = self._body.surface
        gap, *e1 = surface.nearby(*p)
        if not math.isfinite(gap):
            raise Diverged(f"PyBullet's ball is nowhere at t = {self._steps * self._settings.dt:g} s")
        reach = self._body.ball.radius + gap
        foot = [x + reach * n for x, n in zip(p, e1, strict=True)]
        self._world.resetBasePositionAndOrientation(self._plane, foot, _upright(*e1))
        if self._body.contact.rolling_resistance:
            torque = self._resistance(np.array(e1))
            self._world.applyExternalTorque(self._ball, -1, torque.tolist(), self._world.WORLD_FRAME)
        self._world.stepSimulation()
        if self._body.contact.rolling_resistance:
            self._normal_force = self._contact()[0]

    def _resistance(self, e1: Any) -> Any:
        """Moment of rolling resistance [N m] with the normal force of the last step; limited so as to stop the ball."""
        ball, f = self._body.ball, self._body.contact.rolling_resistance
        v = np.array(self._velocities()[0])
        speed = float(np.linalg.norm(v))
        if not speed:
            return np.zeros(3)
        most = (1 + ball.inertia_ratio) * ball.mass * ball.radius * speed / self._settings.dt
        return min(f * self._normal_force, most) * np.cross(e1, v) / speed

    def _first_normal_force(self) -> float:
        """Normal force of a first step, which is then undone [N]."""
        state = self._world.saveState()
        self._step()
        self._world.restoreState(state)
        self._world.removeState(state)
        return self._normal_force

    def _contact(self) -> tuple[float, Any]:
        """Normal force and friction on the ball in the last step [N]."""
        points = self._world.getContactPoints(self._ball, self._plane)
        if not points:
            return 0.0, np.zeros(3)
        _, _, _, _, _, _, _, _, _, N, f1, d1, f2, d2 = points[0]
        return float(N), f1 * np.array(d1) + f2 * np.array(d2)

    def _pose(self) -> tuple[Sequence[float], Sequence[float]]:
        """Centre [m] and orientation, scalar last."""
        return self._world.getBasePositionAndOrientation(self._ball)

    def _velocities(self) -> tuple[Sequence[float], Sequence[float]]:
        """Velocity of the centre [m/s], and angular velocity [rad/s]."""
        return self._world.getBaseVelocity(self._ball)

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`; the force is that of the last step, and none at time 0."""
        p, q = self._pose()
        v, w = self._velocities()
        force = None
        if self._steps:
            N, friction = self._contact()
            plane = self._world.getBasePositionAndOrientation(self._plane)[1]
            normal = np.array(self._world.getMatrixFromQuaternion(plane)).reshape(3, 3)[:, 2]
            force = N * normal + friction
        return BallSample(np.array(p), np.array(v), np.array(w), np.roll(q, 1), force)

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        told = self._world.getDynamicsInfo(self._ball, -1)
        mu = float(told[1]) * float(self._world.getDynamicsInfo(self._plane, -1)[1])
        shape = self._world.getCollisionShapeData(self._ball, -1)[0]
        f = self._body.contact.rolling_resistance
        soft = {f"1 / {kind} friction": Regularised(1 / UNBOUNDED, _NUMBER) for kind in ("static", "kinetic")}
        soft["acceleration"] = Regularised(min(1.0, self._bend()), _FLAT)
        return BallBuilt(
            mass=float(told[0]),
            inertia=np.array(told[2], dtype=np.float64),
            gravity=self._world.gravity(),
            ball_radius=float(shape[3][0]),
            rolling_resistance=f,
            mu_static=mu,
            mu_kinetic=mu,
            terms=terms_held(resists=f, turns=True),
            regularised=soft,
        )

    def _bend(self) -> float:
        """Bound of the acceleration from the wall's curvature at time 0, over the natural acceleration [1]."""
        body = self._body
        turning = float(np.linalg.norm(body.surface.normal_gradient(body.p0) @ body.v0))
        fastest = float(np.linalg.norm(body.v0)) + body.ball.radius * float(np.linalg.norm(body.w0))
        return turning * fastest / natural_acceleration(body)


def _upright(x: float, y: float, z: float) -> list[float]:
    """Quaternion, scalar last, that turns the z axis to the opposite of a unit vector."""
    if z > 0:  # each formula is singular on the other half of the sphere only
        half = math.sqrt(0.5 * (1 + z))
        return [half, 0.0, -x / (2 * half), y / (2 * half)]
    half = math.sqrt(0.5 * (1 - z))
    return [y / (2 * half), -x / (2 * half), 0.0, half]
