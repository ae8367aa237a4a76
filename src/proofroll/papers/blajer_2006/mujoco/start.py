"""Initial state of a ball, and the depth at which a soft contact carries its load."""

from collections.abc import Callable
from functools import cache
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.mujoco.chart import Chart
from proofroll.papers.blajer_2006.mujoco.settings import ChartSettings

# Evaluations until the resistance's torque, which uses the normal force of the evaluation before, has converged.
EVALUATIONS = 3
# Relative tolerance of the settled depth.
_DEPTH = 1e-14
# Steps of false position before the search goes on by bisection.
_FALSE_POSITION = 15
# A start "at depth zero" is this part of the radius inside: at zero, round-off would decide whether there is a contact.
_TOUCHING = 1e-13


def put_ball(model: Any, data: Any, body: RollingBall, depth: float) -> None:
    """Writes the initial state with the ball ``depth`` [m] inside the wall into ``data``; computes no forces.

    MuJoCo's contact point lies midway between the two surfaces, at a - depth/2 from the centre; the ball rolls
    without slip there. The orientation is the identity.
    """
    ball = model.body("ball").id
    e1 = body.surface.normal(body.p0)
    data.qpos[:] = model.qpos0
    data.qvel[:] = data.qacc[:] = 0.0
    for name, value in zip(("u1", "u2", "normal"), (*body.u0, depth), strict=True):
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    mujoco.mju_negQuat(data.joint("spin").qpos, data.xquat[ball])
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    about_normal = (body.w0 @ e1) * e1
    w = about_normal + (body.w0 - about_normal) * body.ball.radius / (body.ball.radius - depth / 2)
    jacobian = np.zeros((6, model.nv))
    mujoco.mj_jacBody(model, data, jacobian[:3], jacobian[3:], ball)
    data.qvel[:] = np.linalg.solve(jacobian, np.concatenate([body.v0, w]))


def start(model: Any, data: Any, body: RollingBall, settings: ChartSettings, formulation: Chart) -> None:
    """Writes the state at time 0 into ``data`` and computes its forces.

    Raises:
        Refused: the contact is too soft for a settled start.
    """

    def evaluate_at(depth: float) -> None:
        put_ball(model, data, body, depth)
        for _ in range(EVALUATIONS):
            formulation.evaluate(data)

    depth = _TOUCHING * body.ball.radius
    if settings.start == "settled":
        depth = _settled_depth(model, data, body, evaluate_at) or depth
    evaluate_at(depth)


def accelerations(model: Any, data: Any) -> tuple[FloatArray, FloatArray]:
    """Accelerations of the ball's centre [m/s²] and of its turning [rad/s²] in the world, each shape (3,)."""
    result = np.zeros(6)
    mujoco.mj_rnePostConstraint(model, data)
    mujoco.mj_objectAcceleration(model, data, mujoco.mjtObj.mjOBJ_BODY, model.body("ball").id, result, 0)
    # MuJoCo reports what an accelerometer would: without gravity.
    return np.asarray(result[3:] + model.opt.gravity), result[:3]


def _settled_depth(model: Any, data: Any, body: RollingBall, evaluate_at: Callable[[float], None]) -> float:
    """Depth [m] at which the contact bends the path exactly as the wall does: e1·p̈ = -ė1·v.

    Only the shape of the wall and the initial velocity enter, no force of the scene's: N follows from MuJoCo.
    """
    e1 = body.surface.normal(body.p0)
    bend = -float(body.v0 @ body.surface.normal_gradient(body.p0) @ body.v0)

    @cache
    def excess(depth: float) -> float:
        evaluate_at(depth)
        return float(e1 @ accelerations(model, data)[0]) - bend

    low = upper = 1e-12 * body.ball.radius
    if excess(upper) <= 0:
        return 0.0
    while excess(upper) > 0:
        if upper >= 0.1 * body.ball.radius:
            advice = "take a smaller dt or a larger impedance"
            raise Refused(f"the contact is too soft: the ball would sink into the wall; {advice}")
        low, upper = upper, min(1e3 * upper, body.ball.radius)
    # The depth has no more digits than the coordinates of the ball's centre.
    closest = max(_DEPTH * upper, float(np.spacing(np.max(np.abs(body.p0)))))
    at_low, at_upper, tries = excess(low), excess(upper), 0
    # The function is nearly linear, so by false position (the Illinois method: Dowell and Jarratt, BIT 11, 1971). Every
    # third step, and all later ones, bisect, which always converges.
    last_force = 0
    while upper - low > closest and at_upper:
        tries += 1
        part = at_low / (at_low - at_upper) if tries % 3 and tries < _FALSE_POSITION else 0.5
        middle = low + part * (upper - low)
        if not low < middle < upper:
            middle = (low + upper) / 2
        off = excess(middle)
        if off > 0:
            low, at_low, at_upper = middle, off, at_upper / (2 if last_force > 0 else 1)
        else:
            upper, at_upper, at_low = middle, off, at_low / (2 if last_force < 0 else 1)
        last_force = 1 if off > 0 else -1
    return upper
