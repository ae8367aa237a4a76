"""Writes the program that shows what Pinocchio does with a ball on a wall, without proofroll."""

from __future__ import annotations

import math

from proofroll.engines.pinocchio.contact import UNBOUNDED_FRICTION
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.errors import Refused
from proofroll.reproducing import assigned, ball_numbers, refuse_terms, wall_source
from proofroll.scene import RollingBall

_CURVATURE = '''

def normal_rate(p, v):
    """Rate of e1 at a ball at p that moves with v."""
    reach = 1e-6 * RADIUS / max(float(np.linalg.norm(v)), 1e-300)
    return (frame(p + reach * v)[0] - frame(p - reach * v)[0]) / (2 * reach)
'''

_FREE_FLYER = '''
model = pin.Model()
model.gravity.linear = np.array(GRAVITY)
ball = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
model.appendBodyToJoint(ball, pin.Inertia(MASS, np.zeros(3), INERTIA * np.eye(3)), pin.SE3.Identity())
data = model.createData()


def acceleration(q, v):
    """Of the joint, with one row for the wall and two for rolling (v + a w x e1 = 0), and their drift."""
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    jacobian = pin.getJointJacobian(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    bias = pin.getClassicalAcceleration(model, data, ball, pin.LOCAL_WORLD_ALIGNED).vector
    e1, e2, e3 = frame(q[:3])
    e1_rate = normal_rate(q[:3], velocity.linear)
    turning = RADIUS * np.cross(velocity.angular, e1_rate)
    directions = np.array([[*e1, 0.0, 0.0, 0.0], [*e2, *(RADIUS * e3)], [*e3, *(-RADIUS * e2)]])
    drift = directions @ bias + np.array([e1_rate @ velocity.linear, e2 @ turning, e3 @ turning])
    result = pin.forwardDynamics(model, data, np.zeros(model.nv), directions @ jacobian, drift)
    return np.array(result)


def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time; the classical Runge-Kutta method."""
    q, v, done, h = np.array([*POSITION, 0.0, 0.0, 0.0, 1.0]), np.array([*VELOCITY, *SPIN]), 0, STEP_SIZE
    look = model.createData()
    for t in times:
        while done < round(t / h):
            rates, accelerations = [v], [acceleration(q, v)]
            if data.lambda_c[0] > FAINT:
                raise RuntimeError("the wall would have to pull the ball")
            for reach in (h / 2, h / 2, h):
                stage_v = v + reach * accelerations[-1]
                stage_q = pin.integrate(model, q, reach * rates[-1])
                rates.append(stage_v)
                accelerations.append(acceleration(stage_q, stage_v))
            weights = (1, 2, 2, 1)
            q = pin.integrate(model, q, h / 6 * sum(k * rate for k, rate in zip(weights, rates)))
            v = v + h / 6 * sum(k * rate for k, rate in zip(weights, accelerations))
            done += 1
        pin.forwardKinematics(model, look, q, v)
        velocity = pin.getVelocity(model, look, ball, pin.LOCAL_WORLD_ALIGNED)
        yield look.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()
'''

_CONTACT = '''
model = pin.Model()
model.gravity.linear = np.array(GRAVITY)
carriage = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "centre")
ball = model.addJoint(carriage, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
model.appendBodyToJoint(ball, pin.Inertia(MASS, np.zeros(3), INERTIA * np.eye(3)), pin.SE3.Identity())
data = model.createData()
point = pin.PointContactConstraintModel(model, 0, pin.SE3.Identity(), ball, pin.SE3.Identity())
constraints, constraint_data = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
constraints.append(pin.ConstraintModel(point))
constraint_data.append(constraints[0].createData())
point = constraints[0].extract()  # refers to the one in the vector
point.setFriction(FRICTION)
if SOLVER == "pgs":
    solver, options, result = pin.PGSConstraintSolver(3), pin.PGSSolverSettings(), pin.PGSSolverResult()
else:
    solver, options, result = pin.ADMMConstraintSolver(3), pin.ADMMSolverSettings(), pin.ADMMSolverResult()
    options.max_iterations = 10000
for name in ("feasibility", "complementarity"):
    for bound in ("absolute", "relative"):
        setattr(options, f"{bound}_{name}_tol", TOLERANCE)


def kick(q, v, span):
    """Velocity after the impulse of the contact with the plane that touches the wall where the ball does."""
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    p, turned = data.oMi[ball].translation, data.oMi[ball].rotation
    e1, e2, e3 = frame(p)
    axes = np.array([e2, -e3, -e1]).T  # the last one from the wall into the ball
    point.joint1_placement = pin.SE3(axes, p + RADIUS * e1)
    point.joint2_placement = pin.SE3(turned.T @ axes, turned.T @ (RADIUS * e1))
    point.calc(model, data, constraint_data[0].extract())
    jacobian = point.jacobian(model, data, constraint_data[0].extract())
    inverse = np.triu(pin.computeMinverse(model, data, q))
    inverse = inverse + np.triu(inverse, 1).T
    free = v + span * pin.aba(model, data, q, v, np.zeros(model.nv))
    at_contact = jacobian @ free + np.array([0.0, 0.0, gap(p) / STEP_SIZE])
    if LEAPFROG:
        e1_rate = normal_rate(p, velocity.linear)
        slip_rate = RADIUS * np.cross(velocity.angular, e1_rate)
        slip_rate = slip_rate - (e1 @ slip_rate) * e1 + (e1_rate @ velocity.linear) * e1
        at_contact += STEP_SIZE / 2 * (axes.T @ slip_rate)
    result.reset()
    delassus = pin.DelassusOperatorDense(jacobian @ inverse @ jacobian.T)
    if not solver.solve(delassus, at_contact, constraints, constraint_data, options, result):
        raise RuntimeError(f"Pinocchio's solver {SOLVER} did not reach its tolerance of {TOLERANCE:g}")
    impulse = np.array(result.retrieveConstraintImpulses())
    friction, press = float(np.hypot(impulse[0], impulse[1])), float(impulse[2])
    if not BOUNDED and press > FAINT * STEP_SIZE and friction >= FRICTION * press * (1 - 1e-9):
        raise RuntimeError(f"more friction is needed than {FRICTION:g} times the normal force")
    return free + inverse @ (jacobian.T @ impulse)


def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    q, v, done = np.array([*POSITION, 0.0, 0.0, 0.0, 1.0]), np.array([*VELOCITY, *SPIN]), 0
    look = model.createData()
    for t in times:
        while done < round(t / STEP_SIZE):
            v = kick(q, v, STEP_SIZE / 2 if LEAPFROG and done == 0 else STEP_SIZE)
            q = pin.integrate(model, q, STEP_SIZE * v)
            done += 1
        # With leapfrog the velocity is half a step ahead: the present one is the mean of two.
        now = (v + kick(q, v, STEP_SIZE)) / 2 if LEAPFROG and done else v
        pin.forwardKinematics(model, look, q, now)
        velocity = pin.getVelocity(model, look, ball, pin.LOCAL_WORLD_ALIGNED)
        yield look.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()
'''


def source(body: RollingBall, settings: PinocchioSettings) -> str:
    """See :class:`proofroll.engine.Reproduces`.

    Args:
        body: the scene's.
        settings: of the adapter.

    Raises:
        Refused: the scene or the settings have something that the program has not.
    """
    contact = settings.formulation == "contact"
    refuse_terms(body, friction=contact)
    if settings.integrator == "dop853":
        raise Refused("its adaptive steps are scipy's, not Pinocchio's")
    if settings.formulation == "composite":
        raise Refused("there is no program for this formulation yet; free_flyer with the same integrator has one")
    if not contact and (settings.integrator != "rk4" or settings.projection or not settings.orientation):
        raise Refused("the program has integrator=rk4, projection=false and orientation=true alone")
    weight = body.ball.mass * float((body.gravity @ body.gravity) ** 0.5)
    numbers = ball_numbers(body) | {"STEP_SIZE": float(settings.dt or 0.0), "FAINT": 1e-9 * weight}
    lines = ""
    if contact:
        bounded = math.isfinite(body.contact.mu_static)
        friction = body.contact.mu_static if bounded else UNBOUNDED_FRICTION[settings.solver or "pgs"]
        numbers |= {"FRICTION": friction, "TOLERANCE": float(settings.solver_tolerance or 0.0)}
        lines = f"SOLVER = {settings.solver!r}\nLEAPFROG = {settings.integrator == 'leapfrog'}\nBOUNDED = {bounded}\n"
    return (
        "import numpy as np\nimport pinocchio as pin\n\n"
        + assigned(**numbers)
        + lines
        + wall_source(body)
        + _CURVATURE
        + (_CONTACT if contact else _FREE_FLYER)
    )
