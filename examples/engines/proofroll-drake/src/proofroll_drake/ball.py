"""A ball with Drake's mass matrix, bias and Jacobian of the contact point; constraints and integration are ours.

Rolling is three rows on the acceleration of the body's point at the contact, and scipy integrates. So agreement shows
Drake's dynamics, not its contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, RotationalInertia, SpatialInertia
from scipy.integrate import solve_ivp

from proofroll.adapter import (
    ROLLS,
    BallBuilt,
    BallSample,
    Diverged,
    MechanismCapability,
    RollingBall,
    RunOnBody,
    Scene,
    on_body,
    resistance_moment,
    rolling_ball,
    terms_held,
)
from proofroll_drake.settings import DrakeSettings

PROVIDES: frozenset[str] = ROLLS | {MechanismCapability.ORIENTATION}
INHERENT = {MechanismCapability.ORIENTATION: "a free body of Drake has one"}


class DrakeBall:
    """Run of a ball; see :class:`proofroll.core.engine.Engine` for the methods.

    The state is Drake's: quaternion, position of the centre, angular velocity, velocity.
    """

    def __init__(self, body: RollingBall, settings: DrakeSettings) -> None:
        self._ball, self._rtol, self._t = body, settings.rtol, 0.0
        self._plant = plant = MultibodyPlant(0.0)
        plant.mutable_gravity_field().set_gravity_vector(body.gravity)
        J, m = body.ball.inertia, body.ball.mass
        inertia = SpatialInertia.MakeFromCentralInertia(m, np.zeros(3), RotationalInertia(J, J, J))
        self._body = plant.AddRigidBody(body.ball.name, inertia)
        plant.Finalize()
        self._context = plant.CreateDefaultContext()
        plant.SetFreeBodyPose(self._context, self._body, RigidTransform(body.p0))
        plant.SetVelocities(self._context, np.concatenate([body.w0, body.v0]))
        self._x = np.array(plant.GetPositionsAndVelocities(self._context))

    @classmethod
    def build(cls, scene: Scene, settings: DrakeSettings) -> RunOnBody:
        """See :class:`proofroll.core.engine.Engine`."""
        return on_body(cls(rolling_ball(scene), settings), scene)

    def _solved(self, x: Any) -> tuple[Any, Any]:
        """Accelerations (angular first) in the world, and force of the wall on the ball [N]."""
        plant, context, ball = self._plant, self._context, self._ball
        plant.SetPositionsAndVelocities(context, x)
        p, w, v = x[4:7], x[7:10], x[10:13]
        e1 = ball.surface.normal(p)
        R = plant.EvalBodyPoseInWorld(context, self._body).rotation().matrix()
        at = R.T @ (ball.ball.radius * e1)
        world = plant.world_frame()
        rows = plant.CalcJacobianTranslationalVelocity(
            context, JacobianWrtVariable.kV, self._body.body_frame(), at, world, world
        )
        bent = -ball.ball.radius * np.cross(w, ball.surface.normal_gradient(p) @ v)
        M = plant.CalcMassMatrix(context)
        push = plant.CalcGravityGeneralizedForces(context) - plant.CalcBiasTerm(context)
        # the moment of rolling resistance is linear in the normal force, -e1 · R
        resistance = np.zeros((6, 3))
        f = ball.contact.rolling_resistance
        resistance[:3] = np.outer(resistance_moment(f, -1.0, e1, v), e1) if f else 0.0
        matrix = np.block([[M, -rows.T - resistance], [rows, np.zeros((3, 3))]])
        found = np.linalg.solve(matrix, np.concatenate([push, bent]))
        return found[:6], found[6:]

    def _rates(self, _: float, x: Any) -> Any:
        self._plant.SetPositionsAndVelocities(self._context, x)
        return np.concatenate([self._plant.MapVelocityToQDot(self._context, x[7:]), self._solved(x)[0]])

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        if t == self._t:
            return
        scale = np.concatenate([np.ones(7), np.maximum(1.0, np.abs(self._x[7:]))])
        found = solve_ivp(
            self._rates, (self._t, t), self._x, method="DOP853", rtol=max(self._rtol, 3e-14), atol=self._rtol * scale
        )
        if not found.success:
            raise Diverged(f"{found.message} (t = {found.t[-1]:g} s)")
        self._t, self._x = t, found.y[:, -1]
        self._x[:4] /= np.linalg.norm(self._x[:4])

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        x = self._x
        return BallSample(x[4:7].copy(), x[10:13].copy(), x[7:10].copy(), x[:4].copy(), self._solved(x)[1])

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        inertia = self._body.default_spatial_inertia()
        f = self._ball.contact.rolling_resistance
        rates = self._solved(self._x)[0]
        return BallBuilt(
            mass=float(inertia.get_mass()),
            inertia=np.array(inertia.CalcRotationalInertia().CalcPrincipalMomentsOfInertia()),
            gravity=np.array(self._plant.gravity_field().gravity_vector()),
            rolling_resistance=f,
            acceleration=rates[3:],
            angular_acceleration=rates[:3],
            terms=terms_held(resists=f, turns=True),
        )
