"""The dimensionless numbers of a step, and which of them explains a boundary."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from proofroll.core.scene import RollingBall
from proofroll.truth.natural import natural_time, turning_rate

MEANINGS = {
    "turn": "Ωh: angle [rad] by which the wall's normal turns in a step",
    "spin": "(V0/a)h: angle [rad] by which the ball turns in a step",
    "rotation": "h·max|ω|: angle [rad] by which the ball turns in a step where it turns fastest",
    "fall": "h√(g/a): step in parts of the time of a fall by the radius",
}
SYMBOLS = {"turn": "Ωh", "spin": "(V0/a)h", "rotation": "h|ω|", "fall": "h√(g/a)"}
# A number explains a boundary that it keeps within this factor along an axis.
_EXPLAINS = 2.0
# Fewer boundaries than these say nothing about an axis.
_ENOUGH = 3


def numbers(body: RollingBall, h: float, fastest: float | None = None) -> dict[str, float]:
    """The numbers of a step; those that are zero at every step, or not known, are left out.

    ``oscillation`` is the step in parts of the natural time.

    Args:
        body: the scene's.
        h: step [s].
        fastest: largest angular velocity of the ball during the run [rad/s], where the truth is known.
    """
    speed, gravity, a = float(np.linalg.norm(body.v0)), float(np.linalg.norm(body.gravity)), body.ball.radius
    found = {
        "turn": turning_rate(body) * h,
        "spin": speed / a * h,
        "rotation": (fastest or 0.0) * h,
        "fall": math.sqrt(gravity / a) * h,
    }
    return {name: value for name, value in found.items() if value} | {"oscillation": h / natural_time(body)}


@dataclass(frozen=True)
class Explanation:
    """The number that changes least among the boundaries along an axis.

    Attributes:
        number: its name.
        low, high: its least and largest value.
        explains: it stays within a factor of two, while the axis moves at least one of the others by more.
    """

    number: str
    low: float
    high: float
    explains: bool

    @property
    def spread(self) -> float:
        """Largest over least value."""
        return self.high / self.low


def explanation(boundaries: Sequence[Mapping[str, float]]) -> Explanation | None:
    """Which number explains the boundaries of one engine along one axis; None: there are too few of them."""
    if len(boundaries) < _ENOUGH:
        return None
    common = [name for name in MEANINGS if all(name in item for item in boundaries)]
    spreads = {}
    for name in common:
        values = [item[name] for item in boundaries]
        spreads[name] = max(values) / min(values)
    if not spreads:
        return None
    best = min(spreads, key=lambda name: spreads[name])
    values = [item[best] for item in boundaries]
    tells = spreads[best] <= _EXPLAINS < max(spreads.values())
    return Explanation(best, min(values), max(values), tells)
