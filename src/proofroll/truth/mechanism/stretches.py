"""Stretches of a mechanism in one mode, integrated by DOP853 to the first guard in all routes."""

import math
from abc import ABC, abstractmethod
from copy import copy
from typing import Generic, Self, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import Settling
from proofroll.truth.hybrid import Stretch, StretchLaw, integrate_to_guard, states_at

ModeT = TypeVar("ModeT")
# Least deceleration of rebounds whose time is summed, in natural units; below it is round-off.
_PULL = 1e-9


class Stretches(ABC, Generic[ModeT]):
    """Integration that routes share, without equations; see :class:`proofroll.truth.hybrid.HybridRoute`."""

    def __init__(self, size: int, tolerance: float) -> None:
        """Takes the length of a state, and the tolerance of each step."""
        self._tolerance = np.full(size, tolerance)
        self._settles = Settling()
        self._span: float | None = None

    def early(self) -> Self:
        """The same route, which sums rebounds one before, at twice the speed at least."""
        route = copy(self)
        route._settles, route._span = Settling(early=True), None
        return route

    @abstractmethod
    def _law(self, state: Array, mode: ModeT) -> StretchLaw:
        """Equations of a stretch that starts at a state."""

    @staticmethod
    def _bouncing(name: str, rebound: float, pull: float, restitution: float, falling: float | None = None) -> float:
        """Time until the rebounds of a joint or contact are over, from the speed of the first and its decelerations.

        ``pull``: on the way out; ``falling``: on the way back, less by friction (None: the same).

        Raises:
            Refused: nothing pulls it back, in natural units, as where impacts on another joint end its rebounds.
        """
        if not pull > _PULL:
            raise Refused(
                f"rebounds of {name} shrink to nothing, and no force pulls it back between them, as where joints or "
                "contacts hit each other without end: no route sums these; ask for an earlier end of the run"
            )
        slower = 1.0 if falling is None else math.sqrt(falling / pull)  # impact speed over rebound speed
        return (1 + (1 / slower if slower else 0.0)) * rebound / (pull * (1 - restitution * slower))

    def walk(self, time: float, state: Array, mode: ModeT, until: float) -> Stretch[ModeT]:
        """See the protocol."""
        found = integrate_to_guard(self._law(state, mode), mode, time, state, until, self._tolerance, self._span)
        self._span = found.end - time if found.end > time else None
        return found

    def within(self, stretch: Stretch[ModeT], times: FloatArray) -> FloatArray:
        """See the protocol."""
        if not stretch.visited:
            return np.array([stretch.first for _ in times])
        return states_at(self._law(stretch.first, stretch.mode), stretch.visited, times, self._tolerance)
