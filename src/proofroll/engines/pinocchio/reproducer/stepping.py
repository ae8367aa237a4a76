"""Text of the integrators of the formulations with rows: fixed steps, or scipy's DOP853."""

from __future__ import annotations

import inspect

from proofroll.core.program_text import assigned
from proofroll.engines.pinocchio.ball_with_rows import BallWithRows
from proofroll.engines.pinocchio.integrators import PATIENCE, SHORT
from proofroll.engines.pinocchio.reproducer.mechanism_loop import steps
from proofroll.engines.pinocchio.settings import PinocchioSettings

_FIXED = '''
MOVING = np.array([1.0] * (model.nv - 3) + [float(ORIENTATION)] * 3)  # what moves the configuration


def pressed(q, v):
    """Acceleration with which a step starts, if the wall presses."""
    result = acceleration(q, v)
    if normal_force() < -FAINT:
        raise RuntimeError("the wall would have to pull the ball")
    return result


def rate(q, displacement, v):
    """Of the displacement of a configuration from q."""
    if INTEGRATOR == "rk4":
        return MOVING * v
    return np.linalg.solve(pin.dIntegrate(model, q, displacement, pin.ARG1), MOVING * v)


def step(q, v, start, h):
    """One step from the acceleration at its start."""
    if INTEGRATOR == "semi_implicit_euler":
        v = v + h * start
        return pin.integrate(model, q, h * MOVING * v), v
    rates, accelerations = [MOVING * v], [start]
    for reach in (h / 2, h / 2, h):
        displacement, stage_v = reach * rates[-1], v + reach * accelerations[-1]
        rates.append(rate(q, displacement, stage_v))
        accelerations.append(acceleration(pin.integrate(model, q, displacement), stage_v))
    weights = (1, 2, 2, 1)
    q = pin.integrate(model, q, h / 6 * sum(k * x for k, x in zip(weights, rates)))
    return q, v + h / 6 * sum(k * x for k, x in zip(weights, accelerations))


def states(times):
    """Configuration and velocity at each time."""
    q, v, done = np.array(START_Q), np.array(START_V), 0
    start = None
    for t in times:
        while done < round(t / STEP_SIZE):
            q, v = step(q, v, pressed(q, v) if start is None else start, STEP_SIZE)
            if PROJECTION:
                q, v = project(q, v)
            start, done = pressed(q, v), done + 1
        yield q, v
'''

_ADAPTIVE = '''
PLACES = model.nq if ORIENTATION else model.nq - 4  # without the orientation no more than the place is integrated


def split(y):
    """Configuration and velocity."""
    q = np.array(START_Q)
    q[:PLACES] = y[:PLACES]
    return (pin.normalize(model, q) if ORIENTATION else q), y[PLACES:]


def derivative(t, y):
    """Of configuration and velocity together, the quaternion by its rate."""
    q, v = split(y)
    moved = pin.tangentMap(model, q) @ v if ORIENTATION else v[:PLACES]
    return np.concatenate([moved, acceleration(q, v)])


short = 0


def accept(solver):
    """Counts steps that are too short, puts the state back on the rows, and looks whether the wall presses."""
    global short
    faster = max(1.0, float(np.max(np.abs(solver.y[PLACES:]) / V_SCALE)))
    short = short + 1 if solver.step_size * faster < SHORT * Q_SCALE[0] / V_SCALE[0] else 0
    if short > PATIENCE:
        raise RuntimeError(f"the steps became too short at {solver.t:g} s: the forces jump there")
    if PROJECTION:
        q, v = project(*split(solver.y))
        solver.y = np.concatenate([q[:PLACES], v])
        solver.f = derivative(solver.t, solver.y)
    if normal_force() < -FAINT:
        raise RuntimeError("the wall would have to pull the ball")


def states(times):
    """Configuration and velocity at each time."""
    start = np.concatenate([START_Q[:PLACES], START_V])
    atol = 1e-2 * RTOL * np.concatenate([Q_SCALE[:PLACES], V_SCALE])
    solver = DOP853(derivative, 0.0, start, np.inf, rtol=RTOL, atol=atol)
    return (split(y) for y in steps(solver, times, accept))
'''

_RUN = '''

def run(times):
    """Centre, velocity and angular velocity of the ball in the world at each time."""
    look = model.createData()
    try:
        for q, v in states(times):
            pin.forwardKinematics(model, look, q, v)
            velocity = pin.getVelocity(model, look, ball, pin.LOCAL_WORLD_ALIGNED)
            yield look.oMi[ball].translation.copy(), velocity.linear.copy(), velocity.angular.copy()
    except np.linalg.LinAlgError as error:
        raise RuntimeError(f"the equations became singular ({error})") from None
'''


def source(settings: PinocchioSettings) -> str:
    """``states(times)`` and ``run(times)`` for what a formulation defines."""
    return (f"\n\n{inspect.getsource(steps)}\n{_ADAPTIVE}" if settings.integrator == "dop853" else _FIXED) + _RUN


def numbers(mechanism: BallWithRows, settings: PinocchioSettings) -> str:
    """Assignments: the start, and how it is integrated."""
    start = {"START_Q": mechanism.q0, "START_V": mechanism.v0, "FAINT": mechanism.faint}
    wanted = {"ORIENTATION": bool(settings.orientation), "PROJECTION": settings.projection}
    if settings.integrator == "dop853":
        scales = {"Q_SCALE": mechanism.q_scale, "V_SCALE": mechanism.v_scale}
        return assigned(**start, **wanted, **scales, RTOL=settings.rtol, SHORT=SHORT, PATIENCE=PATIENCE)
    return assigned(**start, **wanted, STEP_SIZE=settings.dt, INTEGRATOR=settings.integrator)
