"""Hypotheses of wrong numbers in the engine, and of loads that the scene does not have."""

import copy
import dataclasses
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.diagnosis import Cause, Evidence, Hypothesis, hypothesis
from proofroll.core.diagnosis.fitting import change_by, factor_text, known_factor, possible
from proofroll.core.errors import InputError
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, has_resistance, residuals_of
from proofroll.elements.ball_on_surface.model import RollingBall


def _ball(body: RollingBall, **changes: float) -> RollingBall:
    return dataclasses.replace(body, ball=dataclasses.replace(body.ball, **changes))  # type: ignore[arg-type]  # numbers by name


def _resisting(body: RollingBall, f: float) -> RollingBall:
    """Ball with any rolling resistance f [m], even a negative one, with which an engine may drive the ball."""
    contact = copy.copy(body.contact)
    object.__setattr__(contact, "rolling_resistance", f)
    return dataclasses.replace(body, contact=contact)


def number(
    name: str,
    what: str,
    value: Callable[[RollingBall], float],
    change: Callable[[RollingBall, float], RollingBall],
    remedy: str,
    only: Callable[[RollingBall], bool] = lambda _: True,
    signed: bool = False,
) -> Hypothesis:
    """Hypothesis that the engine moves the ball with one factor on a number.

    Args:
        name: of the hypothesis.
        what: the number, in the words of the cause.
        value: number in the scene, 0 if it has none.
        change: ball with another value of the number.
        remedy: advice to the author.
        only: True for balls whose scene has the number.
        signed: True if the engine may have the wrong sign of the number.
    """

    @hypothesis(name, "one factor on this number of the scene closes accelerations and forces at every sample")
    def test(evidence: Evidence) -> Iterator[Cause]:
        body = evidence.element.rolling
        scene = value(body)
        if not scene or not np.isfinite(scene) or not only(body):
            return

        def law(factor: float) -> Law | None:
            try:
                return Law(change(body, factor * scene))
            except InputError:
                return None  # there is no such ball

        for residuals in residuals_of(evidence):
            factor, fitted = _snapped(residuals.fit(law, 1.0))
            if possible(factor, signed):
                factor_words = f"{factor_text(factor)} ({factor * scene:.6g} instead of {scene:.6g})"
                says = f"the engine moves a ball with {what} {factor_words}"
                yield residuals.cause(name, says, law(factor), remedy, fitted, change_by(factor))

    return test


def _snapped(factor: float) -> tuple[float, int]:
    """(factor, number of fitted values): the factor of a known mistake, and 0; or else the given one, and 1."""
    mistake = known_factor(factor)
    return (mistake[0], 0) if mistake else (factor, 1)


def damping(what: str, velocity: float, spin: float) -> Hypothesis:
    """Hypothesis that velocity, spin or both are damped at one rate; the two are 1 if damped, else 0."""

    @hypothesis("damping", "the load with one coefficient closes accelerations and forces at every sample")
    def test(evidence: Evidence) -> Iterator[Cause]:
        body = evidence.element.rolling
        mass, inertia = velocity * body.ball.mass, spin * body.ball.inertia

        def law(rate: float) -> Law:
            return Law(body, force=lambda v: -rate * mass * v, moment=lambda _e1, _v, w: -rate * inertia * w)

        for residuals in residuals_of(evidence):
            rate = residuals.fit(law, 0.0)
            if rate > 0:
                says = f"{what} damped at a rate of {rate:.4g} per second"
                remedy = "find the engine's own damping, drag or sleeping, and switch it off"
                yield residuals.cause("damping", says, law(rate), remedy, 1, rate * evidence.element.natural_time)

    return test


NUMBERS: tuple[Any, ...] = (
    number(
        "inertia",
        "a moment of inertia (J over m a^2)",
        lambda body: body.ball.inertia_ratio,
        lambda body, x: _ball(body, inertia_ratio=x),
        "give the engine the scene's inertia, about the centre, once",
    ),
    number(
        "mass",
        "a mass",
        lambda body: body.ball.mass,
        lambda body, x: _ball(body, mass=x),
        "give the engine the scene's mass, once",
    ),
    number(
        "gravity",
        "gravity",
        lambda body: float(np.linalg.norm(body.gravity)),
        lambda body, x: dataclasses.replace(body, gravity=body.gravity * (x / float(np.linalg.norm(body.gravity)))),
        "give the engine the scene's gravity: an acceleration in the world, its sign and its unit",
        signed=True,
    ),
    number(
        "rolling resistance",
        "a rolling resistance f",
        lambda body: body.contact.rolling_resistance,
        _resisting,
        "the moment is f N against the rolling, f a length in metres",
        only=has_resistance,
        signed=True,
    ),
    damping("the velocity is", 1.0, 0.0),
    damping("the spin is", 0.0, 1.0),
    damping("velocity and spin are", 1.0, 1.0),
)
