"""Text of formulation ``free_flyer``."""

SOURCE = '''
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
