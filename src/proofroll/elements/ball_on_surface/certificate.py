"""Certificate of a ball on a surface, line by line, and the limits of a model's softening."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from proofroll.core.certificate import EXACT, Line, require_shapes, tolerated
from proofroll.core.engine import Regularised
from proofroll.elements.ball_on_surface.mechanics import (
    initial_angular_acceleration,
    initial_response,
    natural_acceleration,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample
from proofroll.elements.mechanism.run.contacts.on_wall import slip_velocity

_DEEP = "a ball that is sunk in by its radius has its centre in the wall"
_LEVER = "a soft contact rolls about a point midway in its depth, and the depth is at most the radius"
_UNLOADED = "a contact that is not loaded yet lacks the whole force, and no more than that"
_NUMBER = "a finite number stands for unbounded friction; the run shows whether it suffices (another_scene)"
_DYNAMICS = ("acceleration", "angular acceleration", "N", "F2", "F3")
# Quantities that a model may soften -> largest relative difference that is accepted for any reason, and why. Quantities
# not listed are never soft: mass, inertia, gravity, radius, position along the wall, a coefficient that the scene
# gives.
CAPS: Mapping[str, Regularised] = {
    "gap": Regularised(1.0, _DEEP),
    "gap in the engine": Regularised(1.0, _DEEP),
    "slip": Regularised(0.5, _LEVER),
    "spin": Regularised(0.5, _LEVER),
    "velocity": Regularised(1e-5, "a velocity of half a step before is brought to time 0 by a sequence that converges"),
    "rolling resistance": Regularised(1e-6, "its moment is read back through a normal force, which a solver finds"),
    **dict.fromkeys(_DYNAMICS, Regularised(1.0, _UNLOADED)),
    **dict.fromkeys(("1 / static friction", "1 / kinetic friction"), Regularised(float("inf"), _NUMBER)),
}
# Accepted shapes of what an engine built; a number may also be a list of one.
_SHAPES = {
    **dict.fromkeys(("gravity", "acceleration", "angular_acceleration"), ((3,),)),
    "inertia": ((3,), (-1,)),  # fewer or more than three differ in a line of their own
    **dict.fromkeys(("mass", "ball_radius", "rolling_resistance", "mu_static", "mu_kinetic", "gap"), ((), (1,))),
}


def certify(body: RollingBall, built: BallBuilt, sample: BallSample) -> list[Line]:
    """Lines that compare what was built, and the sample at time 0, with the ball on its surface.

    A quantity that the engine does not give has a line without a value. Rolling resistance, if the scene has it, counts
    as different when the engine does not give it.
    """
    require_shapes(built, _SHAPES)
    acceleration, force = initial_response(body)
    turning = initial_angular_acceleration(body)
    natural = natural_acceleration(body)
    frame = body.surface.frame(body.u0)
    fall = float(np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)))
    # The scale of velocities takes both terms, the contact's and the ball's rotation, for each has its own round-off.
    turns = body.ball.radius * float(np.linalg.norm(body.w0))
    speed = max(float(np.linalg.norm(body.v0)), turns) or fall or 1.0
    spin = max(float(np.linalg.norm(body.w0)), speed / body.ball.radius)
    lines: list[Line] = []

    def compare(quantity: str, unit: str, expected: Any, reported: Any, scale: float, required: bool = False) -> None:
        want = np.atleast_1d(np.asarray(expected, float))
        if reported is None and not required:
            lines.append(
                Line(
                    quantity=quantity,
                    unit=unit,
                    expected=tuple(want.tolist()),
                    found=(),
                    difference=None,
                    tolerance=EXACT,
                )
            )
            return
        got = np.atleast_1d(np.asarray(np.nan if reported is None else reported, float))
        difference = float(np.max(np.abs(got - want))) / scale if got.shape == want.shape else np.inf
        difference = difference if np.isfinite(difference) else float("inf")
        cap = CAPS.get(quantity)
        tolerance, because = tolerated(built.regularised.get(quantity), cap, EXACT, "")
        lines.append(
            Line(
                quantity=quantity,
                unit=unit,
                expected=tuple(want.tolist()),
                found=tuple(got.tolist()),
                difference=difference,
                tolerance=tolerance,
                because=because,
            )
        )

    compare("mass", "kg", body.ball.mass, built.mass, body.ball.mass)
    compare("inertia", "kg m^2", np.full(3, body.ball.inertia), built.inertia, body.ball.inertia)
    compare("gravity", "m/s^2", body.gravity, built.gravity, float(np.linalg.norm(body.gravity)) or 1.0)
    compare("ball radius", "m", body.ball.radius, built.ball_radius, body.ball.radius)
    f = body.contact.rolling_resistance
    compare("rolling resistance", "m", f, built.rolling_resistance, f or body.ball.radius, required=f > 0)
    for name, reported in (("static friction", built.mu_static), ("kinetic friction", built.mu_kinetic)):
        if reported is not None:  # compared by its inverse, which is 0 for unbounded friction
            compare(f"1 / {name}", "1", 0.0, 1 / reported if reported else np.inf, 1.0)
    # Position is compared along the wall; distance from the wall is the gap.
    below = body.surface.position(body.surface.locate(sample.p_WB))
    compare("position", "m", body.surface.position(body.u0), below, body.ball.radius)
    compare("gap", "m", 0.0, body.surface.gap(sample.p_WB), body.ball.radius)
    compare("gap in the engine", "m", 0.0, built.gap, body.ball.radius)
    compare("velocity", "m/s", body.v0, sample.v_WB, speed)
    compare("spin", "rad/s", body.w0, sample.w_WB, spin)
    e1 = body.surface.normal(sample.p_WB)
    slip = slip_velocity(body.ball.radius, e1, sample.v_WB, sample.w_WB)
    compare("slip", "m/s", np.zeros(3), slip, speed)
    compare("acceleration", "m/s^2", acceleration, built.acceleration, natural)
    compare("angular acceleration", "rad/s^2", turning, built.angular_acceleration, natural / body.ball.radius)
    for index, (name, sign) in enumerate((("N", -1.0), ("F2", 1.0), ("F3", 1.0))):
        pressed = None if sample.force is None else sign * sample.force @ frame[:, index]
        compare(name, "N", sign * force @ frame[:, index], pressed, body.ball.mass * natural)
    return lines


def another_scene(lines: Iterable[Mapping[str, Any]], needed: float) -> str | None:
    """Reason why the engine's model represents another kind of scene than the one asked for; None: it does not.

    A scene with unbounded friction may be built with a finite coefficient. It changes nothing while the motion needs
    less friction than that; where the motion needs more, the ball slips in the engine though it cannot in the scene.

    Args:
        lines: of a stored certificate (:meth:`Line.as_dict`).
        needed: largest |F|/N of the true motion.
    """
    for line in lines:
        if line["quantity"] == "1 / static friction" and line["found"] and line["found"][0] * needed > 1:
            bound = 1 / line["found"][0]
            return f"another scene: a friction of {bound:.4g}, where the scene has no bound and needs {needed:.4g}"
    return None
