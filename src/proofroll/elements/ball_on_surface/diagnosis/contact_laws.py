"""Hypotheses of another law of rolling resistance than the scene's."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, Hypothesis, hypothesis
from proofroll.elements.ball_on_surface.diagnosis.equations import Law, has_resistance, residuals_of
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.mechanism.run.contacts.on_wall import resistance_moment


def other_law(
    name: str, says: str, law: Callable[[RollingBall], Law], remedy: str, applies: Callable[[RollingBall], bool]
) -> Hypothesis:
    """Hypothesis that the contact has another law than the scene's, without any fitted number.

    ``law``: of a ball; ``applies``: True for balls whose scene can show the difference.
    """

    @hypothesis(name, "the other law gives the accelerations and forces at every sample, with no number fitted")
    def test(evidence: Evidence) -> Iterator[Cause]:
        body = evidence.element.rolling
        if applies(body):
            for residuals in residuals_of(evidence):
                yield residuals.cause(name, says, law(body), remedy, 0)

    return test


def _along_spin(body: RollingBall) -> Law:
    def moment(ball: RollingBall, N: float, w: FloatArray) -> FloatArray:
        return -ball.contact.rolling_resistance * N * w / (float(np.linalg.norm(w)) or 1.0)

    return Law(body, resisting=moment)


def _by_weight(body: RollingBall) -> Law:
    weight = body.ball.mass * float(np.linalg.norm(body.gravity))

    def moment(e1: FloatArray, v: FloatArray, _: FloatArray) -> FloatArray:
        return resistance_moment(body.contact.rolling_resistance, weight, e1, v)

    return Law(body, moment=moment, resisting=lambda *_: np.zeros(3))


CONTACT_LAWS: tuple[Any, ...] = (
    other_law(
        "resistance along spin",
        "the rolling resistance acts against the whole angular velocity, spin about the normal included",
        _along_spin,
        "the moment of the rolling resistance is f (v/V) x (-N e1): it is against the rolling alone",
        has_resistance,
    ),
    other_law(
        "resistance by weight",
        "the rolling resistance is f times the ball's weight, not f times the force of the wall",
        _by_weight,
        "the moment of the rolling resistance is f N, with the N of that moment",
        has_resistance,
    ),
)
