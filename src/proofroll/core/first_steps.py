"""Initial acceleration of an engine derived from its own first steps, which no report of an adapter can falsify."""

import contextlib
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, longest
from proofroll.core.certificate import EXACT, ROUNDINGS, Line, Standing, certify
from proofroll.core.element import Element, FirstMotion
from proofroll.core.engine import EPSILON, fixed_step, precision_of
from proofroll.core.engine_abilities import declared_order, laws
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.multi_element import build, copied, sample_of, shaped
from proofroll.core.number_format import number
from proofroll.core.scene import Scene

# Weights of equally spaced values for the derivative at the first of them, times the spacing: parabola, cubic.
_PARABOLA = np.array([-3.0, 4.0, -1.0, 0.0]) / 2
_CUBIC = np.array([-11.0, 18.0, -9.0, 2.0]) / 6
# A body that may come to rest within this many steps (one more than are used) is left out.
_STEPS = 4
# Factor on the observed differences, as for every error bar, and an addend for what the cubic misses.
_MARGIN = 3.0
_FLOOR = 1e-6
# Largest useful relative tolerance: a larger one would hide a rolling resistance or damping left out by mistake.
MOST = 0.03
# A contact softened by more than this relative tolerance moves by its springs at first, whatever its force at time 0.
_SPRINGS = 0.01
# Relative tolerance for an engine that also reports its acceleration: where springs with a time constant of two steps
# hold a loop, the first steps are wrong by up to a thousandth, however short.
_STIFF = 5e-3
OF_FIRST_STEPS = " of the first steps"  # end of the quantity of such lines


def first_steps(kind: Any, scene: Scene, settings: Any, engine: Any = None) -> list[Line]:
    """Certificate lines of the acceleration and angular acceleration at time 0, derived from the first steps.

    A parabola and a cubic through the velocities after zero to three steps give the derivative at time 0; runs with
    half the step give it again. For a method of order p the change by halving over 2^p - 1 is the remaining error,
    which is subtracted. The uncertainty is the difference of the two polynomials, plus that of the two steps, plus the
    effect of rounding the velocities; the tolerance is three times the uncertainty.

    An engine without a step is sampled after short times. There are no lines for an element whose motion has no
    direction yet (a ball at rest under rolling resistance), one that may come to rest within these steps, and a contact
    so soft that its springs move first. ``engine`` is at time 0 and says how soft it is; without it one is built.

    Raises:
        Diverged, Refused: by the engine.
    """
    soft = softness(engine or build(kind, scene, settings), scene)
    lines = []
    for index, element in enumerate(scene.elements):
        start = element.first_motion
        if start is None or soft > _SPRINGS or _STEPS * (fixed_step(settings) or 0.0) >= start.lasts:
            continue
        lines += _lines(kind, scene, settings, index, start, soft)
    return lines


def _lines(kind: Any, scene: Scene, settings: Any, index: int, start: FirstMotion, soft: float) -> list[Line]:
    """Lines of one element: acceleration and angular acceleration."""
    element, step = scene.elements[index], fixed_step(settings)
    h = step or start.moment
    finer = replace(settings, dt=h / 2) if step else settings
    (_, coarse, _), (parabola, fine, rounding) = (
        _derivatives(kind, scene, element, chosen, interval) for chosen, interval in ((settings, h), (finer, h / 2))
    )
    order = declared_order(kind, settings, scene) if step else None
    limit = fine + ((fine - coarse) / (2**order - 1) if order else 0.0)
    epsilon = EPSILON[precision_of(settings)]
    # the velocity of a point at rest has the rounding error of a point at the end of its body
    unknown = np.abs(fine - coarse) + np.abs(fine - parabola) + epsilon * rounding
    turning = max(start.scale / element.length, longest(start.angular_acceleration))
    lines = []
    for row, (quantity, unit, expected, scale) in enumerate(
        (
            ("acceleration", "m/s^2", start.acceleration, start.scale),
            ("angular acceleration", "rad/s^2", start.angular_acceleration, turning),
        )
    ):
        difference, bar = float(np.max(np.abs(limit[row] - expected))) / scale, longest(unknown[row]) / scale
        lines.append(
            Line(
                quantity=scene.label(element, f"{quantity}{OF_FIRST_STEPS}"),
                unit=unit,
                expected=tuple(np.ravel(expected).tolist()),
                found=tuple(np.ravel(limit[row]).tolist()),
                difference=difference if np.isfinite(difference) else float("inf"),
                tolerance=_MARGIN * bar + max(_FLOOR, ROUNDINGS * epsilon) + soft,
                because=f"derived from velocities after steps of {number(h)} s and {number(h / 2)} s",
            )
        )
    return lines


def softness(engine: Any, scene: Scene) -> float:
    """Largest softening that a freshly built engine declares for the quantities in :attr:`Element.softened`."""
    built = engine.built()
    models = [built] if len(scene.elements) == 1 else [built[element.name] for element in scene.elements]
    tolerances = [0.0]
    for element, model in zip(scene.elements, models, strict=True):
        regularised = getattr(model, "regularised", {})
        tolerances += [soft.tolerance for name, soft in regularised.items() if name in element.softened]
    return max(tolerances)


def certificate(kind: Any, engine: Any, scene: Scene, settings: Any) -> list[Line]:
    """Certificate of a freshly built engine: its report, its laws of contact, and the acceleration of its first steps.

    A report that only repeats the scene's numbers proves nothing, so the first steps are compared, too. If the engine
    reports the acceleration, the tolerance of the first steps is at least :data:`_STIFF`, plus that of the reported
    one.
    """
    lines = certify(engine, scene, settings)
    granted = {line.quantity: line.tolerance for line in lines if line.standing is not Standing.NOT_REPORTED}
    derived = []
    for line in derivable(kind, scene, settings, engine):
        more = granted.get(line.quantity.replace(OF_FIRST_STEPS, ""))
        derived.append(line if more is None else replace(line, tolerance=max(line.tolerance, _STIFF) + more))
    contact_laws = [
        Line(
            quantity=scene.label(element, f"law of contact: {clause}"),
            unit="",
            expected=(),
            found=(),
            difference=0.0,
            tolerance=EXACT,
        )
        for element in scene.elements
        for need, clause in laws(kind, settings).items()
        if need in element.requires
    ]
    return [*lines, *contact_laws, *derived]


def derivable(kind: Any, scene: Scene, settings: Any, engine: Any = None) -> list[Line]:
    """Lines of :func:`first_steps` that are precise enough: with a tolerance of at most :data:`MOST`.

    Empty if the engine fails (as its run will) or takes no finer step.
    """
    with contextlib.suppress(Diverged, Refused, InputError):
        return [line for line in first_steps(kind, scene, settings, engine) if line.tolerance <= MOST]
    return []


def _derivatives(
    kind: Any, scene: Scene, element: Element, settings: Any, h: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Linear and angular accelerations of all bodies at time 0 by a parabola, by a cubic, and the effect of rounding.

    The accelerations have shape (2, bodies, 3), linear ones first; the effect of rounding the velocities has shape
    (2, 1, 1) and is divided by the machine epsilon.
    """
    engine = build(kind, scene, settings)
    samples = []
    for t in (0.0, h, 2 * h, 3 * h):
        if t:
            engine.advance(t)
        samples.append(sample_of(scene, element, copied(shaped(scene, engine.sample(), t))))
    shape = (len(element.bodies), 3)
    pairs = [[np.reshape(part, shape) for part in (sample.v_WB, sample.w_WB)] for sample in samples]
    velocities = np.array(pairs)
    by_parabola, by_cubic = (np.tensordot(weights, velocities, 1) / h for weights in (_PARABOLA, _CUBIC))
    sizes = np.max(np.abs(velocities), axis=(0, 2, 3))
    speed = max(sizes[0], sizes[1] * element.length)
    natural = np.array([speed, speed / element.length]).reshape(2, 1, 1)
    return by_parabola, by_cubic, np.sum(np.abs(_CUBIC)) * natural / h
