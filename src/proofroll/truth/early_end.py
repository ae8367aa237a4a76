"""Early end of a truth: the earliest of its routes' failures and of broken checks, with its reason; paths up to it."""

import re
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.numerics.hybrid import HybridPath, Stretch

_Path = HybridPath[Stretch[ContactMode]]
_T = TypeVar("_T")
_TIME = re.compile(r" (?:at|near|by|before) t = [\d.e+-]+ s\b")  # of a failure, in its message


class EarlyEnd:
    """Earliest time from which a motion is not known, and why.

    Attributes:
        time: [s]; inf: none.
        reason: a clause without that time.
    """

    def __init__(self) -> None:
        self.time, self.reason = float(np.inf), ""

    def at(self, time: float, reason: str) -> None:
        """Records an end, unless an earlier one is known; times in the reason are left out, for the end has one."""
        if time < self.time:
            self.time, self.reason = time, _TIME.sub("", reason)

    def known(self, times: Array) -> Array:
        """Times of rising ones [s] that lie before the end.

        Raises:
            Diverged: there is none.
        """
        if not times[0] < self.time:
            raise Diverged(self.reason, self.time)
        return np.asarray(times[times < self.time])

    def run(self, route: Callable[[Array], _T], times: Array) -> _T:
        """Result of a route at the known ones of some times [s]; where it fails is an end.

        Raises:
            Diverged: none of these times is known, or the route fails at a time that it does not tell.
        """
        while True:
            try:
                return route(self.known(times))
            except Diverged as stopped:
                if stopped.time is None or not 0.0 < stopped.time < self.time:
                    raise
                self.at(stopped.time, str(stopped))


def cut_at(paths: tuple[_Path, _Path], end: float, text: str) -> tuple[_Path, _Path]:
    """Paths up to a time, or whole if that is inf, and the reason why they end there."""
    return paths if np.isinf(end) else (_cut_at(paths[0], end, text), _cut_at(paths[1], end, text))


def _cut_at(path: _Path, end: float, text: str) -> _Path:
    kept = [stretch for stretch in path.stretches if stretch.start < end]
    last = kept[-1]
    if last.end > end:
        kept[-1] = replace(last, end=end, guard=None)
    return replace(
        path,
        stretches=tuple(kept),
        happenings=tuple(item for item in path.happenings if item.time < end),
        margins=tuple(item for item in path.margins if item[0] < end),
        known=False,
        ended=text,
        transitions=path.transitions[: len(kept)],
    )


def cut_motion(motion: TwoRouteMotion, end: float, text: str) -> TwoRouteMotion:
    """Motion before a time [s], and the reason why it ends there.

    Raises:
        Refused: no sample lies before it.
    """
    count = int(np.sum(motion.record.time < end))
    if not count:
        raise Refused(text)

    def first(values: Array | None) -> Array | None:
        return None if values is None else values[:count]

    return replace(
        motion,
        record=motion.record.first(count),
        bars={name: bar[:count] for name, bar in motion.bars.items()},
        events=tuple(event for event in motion.events if event.time < end),
        bounces=tuple(bounce for bounce in motion.bounces if bounce.time < end),
        end=end,
        ended=text,
        laws="",
        pressed=first(motion.pressed),
        sums=first(motion.sums),
        works=first(motion.works),
    )
