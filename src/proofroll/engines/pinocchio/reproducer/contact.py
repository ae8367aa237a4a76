"""Text of formulation ``contact``."""

from __future__ import annotations

import math

from proofroll.core.program_text import assigned
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.pinocchio.contact import UNBOUNDED_FRICTION
from proofroll.engines.pinocchio.settings import PinocchioSettings

SOURCE = '''
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
if SOLVER == "pgs":
    solver, options, result = pin.PGSConstraintSolver(3), pin.PGSSolverSettings(), pin.PGSSolverResult()
else:
    solver, options, result = pin.ADMMConstraintSolver(3), pin.ADMMSolverSettings(), pin.ADMMSolverResult()
    options.max_iterations = 10000
for name in ("feasibility", "complementarity"):
    for bound in ("absolute", "relative"):
        setattr(options, f"{bound}_{name}_tol", TOLERANCE)

inverse = np.triu(pin.computeMinverse(model, data, np.array([*POSITION, 0.0, 0.0, 0.0, 1.0])))
inverse = inverse + np.triu(inverse, 1).T  # the same in every configuration
# What a step leaves behind: how the contact was, its normal force, and whether it has pressed yet.
contact = {"status": "stick", "N": 0.0, "pressed": False}


def solve(delassus, at_contact):
    """Impulse of the contact in the cone of friction, and whether it sticks, slips or is open."""
    mu = STATIC if contact["status"] == "stick" else KINETIC
    for coefficient in (mu, KINETIC):
        point.setFriction(coefficient)
        result.reset()
        if not solver.solve(delassus, at_contact, constraints, constraint_data, options, result):
            raise RuntimeError(f"Pinocchio's solver {SOLVER} did not reach its tolerance of {TOLERANCE:g}")
        impulse = np.array(result.retrieveConstraintImpulses())
        friction, press = float(np.hypot(impulse[0], impulse[1])), float(impulse[2])
        if coefficient == mu:
            status = "slip" if friction >= mu * press * (1 - 1e-9) else "stick"
            if not press > FAINT * STEP_SIZE:
                status = "lift_off"
        if status != "slip" or KINETIC == mu:
            break
    if status == "slip" and not BOUNDED:
        raise RuntimeError(f"more friction is needed than {mu:g} times the normal force")
    return impulse, status


def kick(q, v, span, centred):
    """Velocity after the impulse of the contact with the plane that touches the wall where the ball does.

    Second, what it leaves behind. With ``centred`` the position is that of the middle of the span.
    """
    pin.computeAllTerms(model, data, q, v)
    velocity = pin.getVelocity(model, data, ball, pin.LOCAL_WORLD_ALIGNED)
    p, turned = data.oMi[ball].translation, data.oMi[ball].rotation.copy()
    e1, e2, e3 = frame(p)
    axes = np.array([e2, -e3, -e1]).T  # the last one from the wall into the ball
    point.joint1_placement = pin.SE3(axes, p + RADIUS * e1)
    point.joint2_placement = pin.SE3(turned.T @ axes, turned.T @ (RADIUS * e1))
    point.calc(model, data, constraint_data[0].extract())
    jacobian = point.jacobian(model, data, constraint_data[0].extract())
    shift = np.array([0.0, 0.0, gap(p) / STEP_SIZE])
    if LEAPFROG:
        e1_rate = normal_rate(p, velocity.linear)
        slip_rate = RADIUS * np.cross(velocity.angular, e1_rate)
        slip_rate = slip_rate - (e1 @ slip_rate) * e1 + (e1_rate @ velocity.linear) * e1
        shift += STEP_SIZE / 2 * (axes.T @ slip_rate)
    delassus = pin.DelassusOperatorDense(jacobian @ inverse @ jacobian.T)
    moving, N = velocity.linear.copy(), contact["N"]
    for number in range(10):  # rolling resistance follows the normal force, against the velocity at the time of q
        speed = float(np.linalg.norm(moving))
        moment = np.cross(e1, moving) * (LEVER * N / speed if speed else 0.0)
        free = v + span * pin.aba(model, data, q, v, np.concatenate([np.zeros(3), turned.T @ moment]))
        impulse, status = solve(delassus, jacobian @ free + shift)
        after, found = free + inverse @ (jacobian.T @ impulse), float(impulse[2]) / span
        if not LEVER or (abs(found - N) <= 1e-13 * abs(found) and (number or not centred)):
            break
        N = found
        if centred:
            moving = (v + after)[:3] / 2
    if status == "lift_off" and not contact["pressed"]:
        status = contact["status"]  # a plane does not press before the ball has moved into it
    return after, {"status": status, "N": found, "pressed": contact["pressed"] or bool(impulse.any())}


def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    q, v, done = np.array([*POSITION, 0.0, 0.0, 0.0, 1.0]), np.array([*VELOCITY, *SPIN]), 0
    first = STEP_SIZE / 2 if LEAPFROG else STEP_SIZE
    found = kick(q, v, first, False)[1]
    contact["N"] = found["N"]
    if BOUNDED and found["status"] == "slip":
        contact["status"] = "slip"
    look = model.createData()
    for t in times:
        while done < round(t / STEP_SIZE):
            v, left = kick(q, v, STEP_SIZE if done else first, LEAPFROG and done > 0)
            contact.update(left)
            q = pin.integrate(model, q, STEP_SIZE * v)
            done += 1
        # With leapfrog the velocity is half a step ahead: the present one is the mean of two.
        now = (v + kick(q, v, STEP_SIZE, True)[0]) / 2 if LEAPFROG and done else v
        pin.forwardKinematics(model, look, q, now)
        velocity = pin.getVelocity(model, look, ball, pin.LOCAL_WORLD_ALIGNED)
        yield look.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()
'''


def numbers(body: RollingBall, settings: PinocchioSettings) -> str:
    """Assignments that this formulation alone needs: friction, and what solves for the impulse."""
    weight = body.ball.mass * float((body.gravity @ body.gravity) ** 0.5)
    bounded = math.isfinite(body.contact.mu_static)
    unbounded = UNBOUNDED_FRICTION[settings.solver or "pgs"]
    static, kinetic = (body.contact.mu_static, body.contact.mu_kinetic) if bounded else (unbounded, unbounded)
    return assigned(
        STEP_SIZE=settings.dt,
        FAINT=1e-9 * weight,
        STATIC=static,
        KINETIC=kinetic,
        TOLERANCE=settings.solver_tolerance,
        SOLVER=settings.solver,
        LEAPFROG=settings.integrator == "leapfrog",
        BOUNDED=bounded,
    )
