"""Text of the formulations with rows, ``composite`` and ``free_flyer``."""

from __future__ import annotations

import numpy as np

from proofroll.core.program_text import assigned
from proofroll.elements.ball_on_surface.model import RollingBall

COMPOSITE = '''
model = pin.Model()
model.gravity.linear = np.array(GRAVITY)
carriage = 0
for kind, axis in GENERATORS:
    joint = pin.JointModelRevoluteUnaligned if kind == "rotation" else pin.JointModelPrismaticUnaligned
    carriage = model.addJoint(carriage, joint(np.array(axis)), pin.SE3.Identity(), f"u{carriage + 1}")
placement = pin.SE3(np.array(CARRIAGE_AXES), np.array(CARRIAGE_PLACE))
ball = model.addJoint(carriage, pin.JointModelSpherical(), placement, "ball")
model.appendBodyToJoint(ball, pin.Inertia(MASS, np.zeros(3), INERTIA * np.eye(3)), pin.SE3.Identity())
data = model.createData()
pressing = 0.0


def rows_at(q, v):
    """e1, rows of rolling (v + a w x e1 = 0), their drift, and rolling resistance per unit of N."""
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    jacobian = pin.getJointJacobian(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    bias = pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).vector
    e1, e2, e3 = (data.oMi[carriage].rotation @ np.array(CARRIAGE_AXES)).T
    e1_rate = np.cross(pin.getVelocity(model, data, carriage, pin.LOCAL_WORLD_ALIGNED).angular, e1)
    turning = RADIUS * np.cross(velocity.angular, e1_rate)
    directions = np.array([[*e2, *(RADIUS * e3)], [*e3, *(-RADIUS * e2)]])
    drift = directions @ bias + np.array([e2 @ turning, e3 @ turning])
    speed = np.linalg.norm(velocity.linear)
    moment = np.cross(e1, velocity.linear) * (LEVER / speed if speed else 0.0)
    return e1, directions @ jacobian, drift, jacobian[3:].T @ moment


def acceleration(q, v):
    """Of the joints; the spherical joint transmits N, which no acceleration of the joints can change."""
    global pressing
    e1, rows, drift, resistance = rows_at(q, v)
    pressing = -float(e1 @ (data.oMi[ball].rotation @ data.f[ball].linear))
    return np.array(pin.forwardDynamics(model, data, pressing * resistance, rows, drift))


def normal_force():
    """Of the last call of acceleration [N]."""
    return pressing


def project(q, v):
    """The state put back on the rows: the velocity by an impulse; the joints hold the ball on the wall."""
    return q, np.array(pin.impulseDynamics(model, data, v, rows_at(q, v)[1]))
'''

FREE_FLYER = '''
model = pin.Model()
model.gravity.linear = np.array(GRAVITY)
ball = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
model.appendBodyToJoint(ball, pin.Inertia(MASS, np.zeros(3), INERTIA * np.eye(3)), pin.SE3.Identity())
data = model.createData()
multipliers = np.zeros(3)


def rows_at(q, v):
    """Rows of the wall and of rolling (v + a w x e1 = 0), their drift, and rolling resistance per unit of N."""
    pin.forwardKinematics(model, data, q, v, np.zeros(6))
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    jacobian = pin.getJointJacobian(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    bias = pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).vector
    e1, e2, e3 = frame(q[:3])
    e1_rate = normal_rate(q[:3], velocity.linear)
    turning = RADIUS * np.cross(velocity.angular, e1_rate)
    directions = np.array([[*e1, 0.0, 0.0, 0.0], [*e2, *(RADIUS * e3)], [*e3, *(-RADIUS * e2)]])
    drift = directions @ bias + np.array([e1_rate @ velocity.linear, e2 @ turning, e3 @ turning])
    speed = np.linalg.norm(velocity.linear)
    moment = np.cross(e1, velocity.linear) * (LEVER / speed if speed else 0.0)
    return directions @ jacobian, drift, jacobian[3:].T @ moment


def acceleration(q, v):
    """Of the joint. The multipliers are the components of the wall's force along e1, e2 and e3."""
    rows, drift, resistance = rows_at(q, v)
    if LEVER:
        # Rolling resistance follows N, an unknown here; forwardDynamics does not allow that.
        matrix = np.block([[data.M, -rows.T], [rows, np.zeros((3, 3))]])
        matrix[:6, 6] += resistance
        solution = np.linalg.solve(matrix, -np.concatenate([data.nle, drift]))
        result, multipliers[:] = solution[:6], solution[6:]
    else:
        result = np.array(pin.forwardDynamics(model, data, np.zeros(6), rows, drift))
        multipliers[:] = data.lambda_c
    if not ORIENTATION:  # axes that are held fixed instead of turning with the ball
        result[:3] += np.cross(v[3:], v[:3])
    return result


def normal_force():
    """Of the last call of acceleration [N]."""
    return -multipliers[0]


def project(q, v):
    """The state put back on the rows: the centre along the normal, the velocity by an impulse."""
    q = q.copy()
    q[:3] += gap(q[:3]) * frame(q[:3])[0]
    return q, np.array(pin.impulseDynamics(model, data, v, rows_at(q, v)[0]))
'''


def carriage(body: RollingBall) -> str:
    """Assignments that ``composite`` alone needs: the joints along the wall."""
    generators = [(generator.kind, list(generator.axis)) for generator in body.surface.generators or ()]
    origin = np.zeros(2)
    axes, place = body.surface.frame(origin), body.surface.position(origin)
    return assigned(GENERATORS=generators, CARRIAGE_AXES=axes, CARRIAGE_PLACE=place)
