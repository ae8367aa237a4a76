"""The first acceleration of an engine from its own first steps: what an adapter does not say cannot hide it."""

from __future__ import annotations

import contextlib
import dataclasses
from typing import Any

import numpy as np

from proofroll.certificate import CAPS, Line
from proofroll.engine import fixed_step
from proofroll.errors import Diverged, Refused
from proofroll.mechanics import initial_angular_acceleration, initial_response, natural_acceleration
from proofroll.resting import stands
from proofroll.scene import Scene
from proofroll.surfaces import FloatArray

# Derivative at the first of equally spaced values, over the spacing: by a parabola, by a cubic.
_PARABOLA = np.array([-3.0, 4.0, -1.0, 0.0]) / 2
_CUBIC = np.array([-11.0, 18.0, -9.0, 2.0]) / 6
# An engine without a step is looked at after this part of the time in which its ball rolls by one radius.
_PART = 1e-2
# Three times the observed differences, as for every error bar; the rest is what a cubic misses in the part above.
_MARGIN = 3.0
_FLOOR = 1e-6
# Largest relative tolerance: more would excuse a rolling resistance or a damping that was left out or in.
MOST = 0.03
# A contact softened by more than this part moves by its springs at first, whatever its force at time 0.
_SPRINGS = 0.01
_SOFTENED = frozenset(name for name in CAPS if not name.startswith("1 / "))
DERIVED = ("acceleration", "angular acceleration")


def first_steps(kind: Any, scene: Scene, settings: Any) -> list[Line]:
    """Certificate lines of the acceleration and angular acceleration at time 0, derived from the first steps.

    Velocities after one, two and three steps give the derivative at time 0 by a parabola and by a cubic; half the step
    gives it again. Half a step's error of a method of order p is the change over 2^p - 1: that is taken off. What the
    two polynomials and the two steps differ by is what the derivation does not know; the tolerance is three times that.
    An engine without a step is looked at after small times. Empty for a ball at rest under rolling resistance, which
    has no direction yet, and for a contact so soft that its springs move first.

    Raises:
        Diverged, Refused: by the engine.
    """
    body, soft = scene.rolling, softness(kind.build(scene, settings))
    if stands(body, body.v0) or soft > _SPRINGS:
        return []
    step = fixed_step(settings)
    speed = float(np.linalg.norm(body.v0)) or float(np.sqrt(body.ball.radius * np.linalg.norm(body.gravity)))
    h = step or _PART * body.ball.radius / (speed or 1.0)
    finer = dataclasses.replace(settings, dt=h / 2) if step else settings
    (_, coarse), (parabola, fine) = _derivatives(kind, scene, settings, h), _derivatives(kind, scene, finer, h / 2)
    found = fine + ((fine - coarse) / (2**settings.order - 1) if step and settings.order else 0.0)
    unknown = np.abs(fine - coarse) + np.abs(fine - parabola)
    natural = natural_acceleration(body)
    lines = []
    for index, (quantity, unit, expected, scale) in enumerate(
        (
            (DERIVED[0], "m/s^2", initial_response(body)[0], natural),
            (DERIVED[1], "rad/s^2", initial_angular_acceleration(body), natural / body.ball.radius),
        )
    ):
        difference, bar = (float(np.max(np.abs(x))) / scale for x in (found[index] - expected, unknown[index]))
        lines.append(
            Line(
                f"{quantity} of the first steps",
                unit,
                tuple(expected.tolist()),
                tuple(found[index].tolist()),
                difference if np.isfinite(difference) else float("inf"),
                _MARGIN * bar + _FLOOR + soft,
                f"derived from velocities after steps of {h:.2g} s and {h / 2:.2g} s",
            )
        )
    return lines


def softness(engine: Any) -> float:
    """Largest relative difference that a freshly built engine says its model has, as far as there can be one."""
    regularised = engine.built().regularised
    return max((soft.tolerance for name, soft in regularised.items() if name in _SOFTENED), default=0.0)


def derivable(kind: Any, scene: Scene, settings: Any) -> list[Line]:
    """:func:`first_steps` as far as they tell anything at this step: those with a tolerance of at most :data:`MOST`.

    For an engine that does not report its first acceleration. Empty where it fails: so will its run.
    """
    with contextlib.suppress(Diverged, Refused):
        return [line for line in first_steps(kind, scene, settings) if line.tolerance <= MOST]
    return []


def _derivatives(kind: Any, scene: Scene, settings: Any, h: float) -> tuple[FloatArray, FloatArray]:
    """Accelerations of the centre and of the turning at time 0, by a parabola and by a cubic, each shape (2, 3)."""
    engine = kind.build(scene, settings)
    samples = [engine.sample()]
    for steps in (1, 2, 3):
        engine.advance(steps * h)
        samples.append(engine.sample())
    velocities = np.array([(sample.v_WB, sample.w_WB) for sample in samples])
    by_parabola, by_cubic = (np.tensordot(weights, velocities, 1) / h for weights in (_PARABOLA, _CUBIC))
    return by_parabola, by_cubic
