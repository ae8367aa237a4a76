"""The first acceleration of an engine from its own first steps: nothing that an adapter says can hide it."""

import contextlib
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import EXACT, ROUNDINGS, Line, Standing, certify
from proofroll.core.element import Element, FirstMotion
from proofroll.core.engine import EPSILON, fixed_step, precision_of
from proofroll.core.engine_abilities import declared_order, laws
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.multi_element import build, sample_of, shaped
from proofroll.core.number_format import number
from proofroll.core.scene import Scene

# Derivative at the first of equally spaced values, over the spacing: by a parabola, by a cubic.
_PARABOLA = np.array([-3.0, 4.0, -1.0, 0.0]) / 2
_CUBIC = np.array([-11.0, 18.0, -9.0, 2.0]) / 6
# What may stop within so many steps, one more than are looked at, tells nothing of the first acceleration.
_STEPS = 4
# Three times the observed differences, as for every error bar; the rest is what a cubic misses in the part above.
_MARGIN = 3.0
_FLOOR = 1e-6
# Largest relative tolerance: more would excuse a rolling resistance or a damping that was left out or in.
MOST = 0.03
# A contact softened by more than this part moves by its springs at first, whatever its force at time 0.
_SPRINGS = 0.01
# Of an engine that says its acceleration: steps of a spring that holds a loop at a time constant of two steps set off
# otherwise by up to a thousandth, however short they are. This leaves them room.
_STIFF = 5e-3
OF_FIRST_STEPS = " of the first steps"  # ends the names of their lines


def first_steps(kind: Any, scene: Scene, settings: Any) -> list[Line]:
    """Certificate lines of the acceleration and angular acceleration at time 0, derived from the first steps.

    Velocities after one, two and three steps give the derivative at time 0 by a parabola and by a cubic; half the step
    gives it again. Half a step's error of a method of order p is the change over 2^p - 1: that is taken off. What the
    two polynomials and the two steps differ by is what the derivation does not know, and what rounding each velocity
    makes of a derivative over so short a step; the tolerance is three times that.
    An engine without a step is looked at after small times. Empty for a ball at rest under rolling resistance, which
    has no direction yet, for one that may stop within these steps, and for a contact so soft that its springs move
    first.

    Raises:
        Diverged, Refused: by the engine.
    """
    built = build(kind, scene, settings)
    lines = []
    for index, element in enumerate(scene.elements):
        start = element.first_motion
        soft = softness(built, scene)
        if start is None or soft > _SPRINGS or _STEPS * (fixed_step(settings) or 0.0) > start.lasts:
            continue
        lines += _lines(kind, scene, settings, index, start, soft)
    return lines


def _lines(kind: Any, scene: Scene, settings: Any, index: int, start: FirstMotion, soft: float) -> list[Line]:
    """Both lines of one element."""
    element, step = scene.elements[index], fixed_step(settings)
    h = step or start.moment
    finer = replace(settings, dt=h / 2) if step else settings
    (_, coarse, _), (parabola, fine, rounding) = (
        _derivatives(kind, scene, element, chosen, interval) for chosen, interval in ((settings, h), (finer, h / 2))
    )
    order = declared_order(kind, settings, scene) if step else None
    limit = fine + ((fine - coarse) / (2**order - 1) if order else 0.0)
    epsilon = EPSILON[precision_of(settings)]
    # a velocity of a point at rest is rounded as that of one at its body's end
    unknown = np.abs(fine - coarse) + np.abs(fine - parabola) + epsilon * rounding
    turning = max(start.scale / element.length, float(np.max(np.abs(start.angular_acceleration))))
    lines = []
    for row, (quantity, unit, expected, scale) in enumerate(
        (
            ("acceleration", "m/s^2", start.acceleration, start.scale),
            ("angular acceleration", "rad/s^2", start.angular_acceleration, turning),
        )
    ):
        difference, bar = (float(np.max(np.abs(x))) / scale for x in (limit[row] - expected, unknown[row]))
        lines.append(
            Line(
                scene.label(element, f"{quantity}{OF_FIRST_STEPS}"),
                unit,
                tuple(np.ravel(expected).tolist()),
                tuple(np.ravel(limit[row]).tolist()),
                difference if np.isfinite(difference) else float("inf"),
                _MARGIN * bar + max(_FLOOR, ROUNDINGS * epsilon) + soft,
                f"derived from velocities after steps of {number(h)} s and {number(h / 2)} s",
            )
        )
    return lines


def softness(engine: Any, scene: Scene) -> float:
    """Largest softening that a freshly built engine declares, among the quantities that may be soft."""
    built = engine.built()
    each = [built] if len(scene.elements) == 1 else [built[element.name] for element in scene.elements]
    tolerances = [0.0]
    for element, own in zip(scene.elements, each, strict=True):
        regularised = getattr(own, "regularised", {})
        tolerances += [soft.tolerance for name, soft in regularised.items() if name in element.softened]
    return max(tolerances)


def certificate(kind: Any, engine: Any, scene: Scene, settings: Any) -> list[Line]:
    """Certificate of a freshly built engine: its own account, its laws, and the acceleration of its first steps.

    Numbers that only repeat the scene's prove nothing. An acceleration that an engine reports is held to the
    scene exactly; its steps may differ by :data:`_STIFF`, and by what is granted to a softened one.
    """
    lines = certify(engine, scene, settings)
    granted = {line.quantity: line.tolerance for line in lines if line.standing is not Standing.NOT_REPORTED}
    derived = []
    for line in derivable(kind, scene, settings):
        said = granted.get(line.quantity.replace(OF_FIRST_STEPS, ""))
        derived.append(line if said is None else replace(line, tolerance=max(line.tolerance, _STIFF) + said))
    told = [
        Line(scene.label(element, f"law of contact: {clause}"), "", (), (), 0.0, EXACT)
        for element in scene.elements
        for need, clause in laws(kind, settings).items()
        if need in element.requires
    ]
    return [*lines, *told, *derived]


def derivable(kind: Any, scene: Scene, settings: Any) -> list[Line]:
    """:func:`first_steps` as far as they tell anything at this step: those with a tolerance of at most :data:`MOST`.

    Empty where the engine fails, and so will its run, or takes no finer step.
    """
    with contextlib.suppress(Diverged, Refused, InputError):
        return [line for line in first_steps(kind, scene, settings) if line.tolerance <= MOST]
    return []


def _derivatives(
    kind: Any, scene: Scene, element: Element, settings: Any, h: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Accelerations of all bodies' centres and turning at time 0, by a parabola and a cubic; (2, bodies, 3).

    Besides what rounding each velocity by its natural size makes of them, over the machine epsilon; (2, 1, 1).
    """
    engine = build(kind, scene, settings)
    samples = []
    for t in (0.0, h, 2 * h, 3 * h):
        if t:
            engine.advance(t)
        samples.append(sample_of(scene, element, shaped(scene, engine.sample(), t)))
    shape = (len(element.bodies), 3)
    pairs = [[np.reshape(part, shape) for part in (sample.v_WB, sample.w_WB)] for sample in samples]
    velocities = np.array(pairs)
    by_parabola, by_cubic = (np.tensordot(weights, velocities, 1) / h for weights in (_PARABOLA, _CUBIC))
    sizes = np.max(np.abs(velocities), axis=(0, 2, 3))
    speed = max(sizes[0], sizes[1] * element.length)
    natural = np.array([speed, speed / element.length]).reshape(2, 1, 1)
    return by_parabola, by_cubic, np.sum(np.abs(_CUBIC)) * natural / h
