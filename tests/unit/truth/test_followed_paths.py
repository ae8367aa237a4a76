"""Paths of two routes together."""

from __future__ import annotations

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.followed_paths import at_times, counterparts, end_of, followed
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, Transition, first_close


class _Refusing:
    """A route that stands still until a time, and follows nothing behind it."""

    def __init__(self, ends: float) -> None:
        self._ends = ends
        self.last = 0.0

    def begin(self) -> Transition[str]:
        return Transition(np.zeros(1), "stands", ())

    def walk(self, time: float, state: Array, mode: str, until: float) -> Stretch[str]:
        self.last = until
        return Stretch(time, min(self._ends, until), mode, state, state, 0 if self._ends < until else None)

    def change(self, stretch: Stretch[str]) -> Transition[str]:
        raise Refused(f"nothing is known from {stretch.end:g} s on")

    def within(self, stretch: Stretch[str], times: Array) -> Array:
        return np.repeat(stretch.first[None], len(times), axis=0)


def test_the_second_route_is_not_followed_behind_an_early_end_of_the_first() -> None:
    """What lies behind the end of a truth costs nothing, and the end is that of the first route, with its reason."""
    first, second = _Refusing(1.0), _Refusing(90.0)
    paths = followed(first, second, 100.0, ())
    assert second.last < 1.001
    assert end_of(paths) == (1.0, "nothing is known from 1 s on")
    first, second = _Refusing(90.0), _Refusing(1.0)
    assert end_of(followed(first, second, 100.0, ())) == (1.0, "nothing is known from 1 s on")


def test_states_of_a_motion_that_goes_on_are_taken_from_the_stretch_that_has_their_time() -> None:
    """One route alone may divide a slip; the time in its states differs in the last digit there."""
    middle = 1.0 + 2e-16
    sooner = Stretch(0.0, 1.0, "slip", np.array([0.0, 0.0]), np.array([3.0, middle]), 0)
    later = Stretch(1.0, 2.0, "slip", np.array([3.0, 1.0]), np.array([4.0, 2.0]), None)
    path = HybridPath((sooner, later), (), ())
    assert at_times(path, [0, 0], np.array([0.5, 1.5])) == [0, 1]


def _flight(times: tuple[float, ...], jump: float) -> HybridPath[Stretch[str]]:
    """Path in one mode, divided at some times, whose speed turns round at one of them."""
    spans = list(zip((0.0, *times), (*times, 4.0), strict=True))
    turned = [np.array([begin, -1.0 if begin < jump else 1.0, begin]) for begin, _ in spans]
    lasts = [np.array([end, first[1], end]) for first, (_, end) in zip(turned, spans, strict=True)]
    ends = [*[0] * len(times), None]
    parts = zip(spans, turned, lasts, ends, strict=True)
    return HybridPath(tuple(Stretch(*span, "open", first, last, end) for span, first, last, end in parts), (), ())


def test_a_motion_behind_a_rebound_has_its_counterpart_behind_it() -> None:
    """Routes that divide a fall differently agree on the flight behind it, which has the mode of the fall."""
    paths = _flight((1.0, 2.0), 2.0), _flight((0.5, 1.0, 1.5, 2.0), 2.0)
    times = np.array([0.2, 1.2, 3.0])
    numbers = at_times(paths[1], counterparts(paths, [0, 1, 2]), times)
    assert numbers == [0, 2, 4]
    assert at_times(paths[0], counterparts(paths[::-1], [0, 2, 4]), times) == [0, 1, 2]


def test_no_truth_ends_before_it_begins() -> None:
    """A guard that is zero at the start rises before it by round-off; the end and the first close decision are at 0."""
    early = Stretch(0.0, -1e-10, "slips", np.zeros(2), np.zeros(2), 0, grazes=[-1e-11])
    path = HybridPath((early,), (), (), known=False, ended="nothing is known")
    assert end_of((path, path)) == (0.0, "nothing is known")
    assert first_close([path], 0.0) == 0.0
