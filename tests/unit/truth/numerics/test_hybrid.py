"""Stretches between switches: guards, and states within a stretch."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, NotUnique, Refused
from proofroll.truth.numerics.hybrid import (
    StoppedWithin,
    Stretch,
    StretchLaw,
    Transition,
    follow,
    integrate_to_guard,
    states_at,
    states_of,
)

TOLERANCE = np.full(2, 1e-13)


def swing(guards: Callable[[FloatArray], FloatArray], count: int) -> StretchLaw:
    """A unit oscillator with guards."""
    return StretchLaw(
        lambda y: np.array([y[1], -y[0]]), guards, lambda y: y, noise=np.zeros(count), near=np.zeros(count)
    )


@pytest.mark.arithmetic
@pytest.mark.parametrize("below", [1e-3, 1e-6, 1e-9])
def test_a_crest_within_a_step_is_seen(below: float) -> None:
    """A guard that rises above zero only under the crest of its swing ends the stretch there."""

    def crest(y: FloatArray) -> FloatArray:
        return np.array([y[0] - 1.0 + below])

    stretch = integrate_to_guard(swing(crest, 1), "on", 0.0, np.array([0.0, 1.0]), 3.0, TOLERANCE)
    assert stretch.guard == 0
    # what the guard is off by, over the rate at which it rises
    assert stretch.end == pytest.approx(np.arcsin(1.0 - below), abs=20 * TOLERANCE[0] / np.sqrt(2 * below))


@pytest.mark.drill
def test_steps_grow_again_behind_one_that_is_refused() -> None:
    """Each projection that fails once for a step costs one more step, and crests that the step has seen come once."""
    failures, tries = iter([True, True, True, True]), list[float]()

    def corrected(y: FloatArray) -> FloatArray:
        tries.append(y[0])
        if len(tries) > 5 and next(failures, False):
            raise Diverged("not there")
        return y

    law = StretchLaw(
        lambda y: np.array([y[1], -y[0]]),
        lambda y: np.array([y[0] - 1.0]),
        corrected,
        noise=np.full(1, 1e-9),
        near=np.full(1, 1e-6),
    )
    start = np.array([0.0, 1.0])
    undisturbed = integrate_to_guard(law._replace(corrected=lambda y: y), "on", 0.0, start, 30.0, TOLERANCE)
    stretch = integrate_to_guard(law, "on", 0.0, start, 30.0, TOLERANCE)
    assert next(failures, None) is None
    assert len(stretch.visited) < len(undisturbed.visited) + 8
    assert stretch.grazes == pytest.approx(undisturbed.grazes, abs=1e-5)


def test_a_refusal_within_a_stretch_keeps_what_lies_before() -> None:
    """Rates that refuse from a place on end a stretch just before it; at the start the refusal itself is told."""

    def rates(y: FloatArray) -> FloatArray:
        if y[0] > 0.5:
            raise NotUnique("beyond the half")
        return np.array([y[1], -y[0]])

    law = swing(lambda _: np.zeros(0), 0)._replace(rates=rates)
    with pytest.raises(StoppedWithin, match="beyond the half") as told:
        integrate_to_guard(law, "on", 0.0, np.array([0.0, 1.0]), 3.0, TOLERANCE)
    assert told.value.stretch.end == pytest.approx(np.arcsin(0.5), abs=1e-6)
    with pytest.raises(NotUnique, match="beyond the half"):
        integrate_to_guard(law, "on", 0.0, np.array([0.5, 1.0]), 3.0, TOLERANCE)


def test_states_within_a_stretch_follow_from_its_steps() -> None:
    """Any time of a stretch is reached from the step that holds it, as accurately as its end."""
    law, times = swing(lambda _: np.zeros(0), 0), np.array([0.0, 0.4, 1.7, 3.0])
    stretch = integrate_to_guard(law, "on", 0.0, np.array([0.0, 1.0]), 3.0, TOLERANCE)
    found = states_at(law, stretch.visited, times, TOLERANCE)
    assert found[:, 0] == pytest.approx(np.sin(times), abs=1e-12)


@pytest.mark.drill
def test_instants_of_a_controller_are_no_changes() -> None:
    """A path with thousands of breaks reaches its end: they are known beforehand, as those of a controller at 1 kHz."""

    class Still:
        def begin(self) -> Transition[str]:
            return Transition(np.zeros(1), "on", (), np.inf)

        def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
            return Stretch(time, until, mode, state, state, None)

        def change(self, stretch: Stretch[str]) -> Transition[str]:
            return Transition(stretch.last, "on", (), np.inf)

    path = follow(Still(), 3.0, [k / 1000 for k in range(1, 3000)])
    assert path.known
    assert len(path.stretches) == 3000


@pytest.mark.parametrize("length", [0.0, 1e-9])
def test_a_route_that_alternates_without_progress_is_told(length: float) -> None:
    """Stretches without end that are nothing beside the time that has passed end in words, with what alternates."""

    class Alternating:
        def begin(self) -> Transition[str]:
            return Transition(np.zeros(1), "left", (), np.inf)

        def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
            return Stretch(time, min(until, time + (length if time else 0.1)), mode, state, state, 0)

        def change(self, stretch: Stretch[str]) -> Transition[str]:
            other, kind = ("right", "impact") if stretch.mode == "left" else ("left", "release")
            return Transition(stretch.last, other, ((kind, stretch.mode),), np.inf)

    path = follow(Alternating(), 1.0)
    assert not path.known
    assert "no progress at t = 0.1 s, where impact of left and release of right follow" in path.ended


def test_thousands_of_rebounds_are_refused_as_soon_as_they_are_seen() -> None:
    """Without any loss a fall from hardly anything would be followed for minutes: it is told after a hundred."""

    class Lossless:
        count, length = 0, 1e-4

        def begin(self) -> Transition[str]:
            return Transition(np.zeros(1), "flight", (), np.inf)

        def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
            self.count += 1
            return Stretch(time, min(time + self.length, until), mode, state, state, 0)

        def change(self, stretch: Stretch[str]) -> Transition[str]:
            return Transition(stretch.last, "flight", (), np.inf)

    route = Lossless()
    said = r"100 changes; at this pace 1e4 more follow until t = 1 s, and the truth follows 1000; ask for a shorter"
    assert re.search(said, follow(route, 1.0).ended)
    assert route.count == 100


class Swinging:
    """Stretches of given lengths, between states of given sizes on both sides of zero."""

    def __init__(self, lengths: Sequence[float], sizes: Sequence[float]) -> None:
        """Starts before the first."""
        self.lengths, self.sizes, self.count = lengths, sizes, 0

    def begin(self) -> Transition[str]:
        """See the protocol."""
        return self.change(None)

    def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
        """See the protocol."""
        self.count += 1
        if self.count > len(self.lengths):
            return Stretch(time, until, mode, state, state, None)
        return Stretch(time, min(time + self.lengths[self.count - 1], until), mode, state, state, 0)

    def change(self, stretch: Stretch[str] | None) -> Transition[str]:
        """See the protocol."""
        size = self.sizes[min(self.count, len(self.sizes) - 1)]
        return Transition(np.array([(-1) ** self.count * size, stretch.end if stretch else 0.0]), "on", (), np.inf)


@pytest.mark.parametrize(
    ("lengths", "sizes"),
    [
        pytest.param([10.0, *[1e-3] * 250], [1.0], id="a burst after calm"),
        pytest.param([1e-3] * 150, np.linspace(1.0, 0.1, 150), id="swings that die out"),
        pytest.param([1e-3 * 1.01**k for k in range(300)], [1.0], id="stretches that grow"),
    ],
)
def test_quick_changes_that_make_progress_are_followed(lengths: Sequence[float], sizes: Sequence[float]) -> None:
    """A hundred quick changes are no reason to expect thousands where the motion was calm before, or dies out."""
    route = Swinging(lengths, sizes)
    assert follow(route, 100.0).known
    assert route.count == len(lengths) + 1


def test_a_burst_at_the_start_is_followed_as_far_as_its_pace_allows() -> None:
    """Quick changes from the start on have a truth where at their pace there are fewer than 1000, else a reason."""
    burst = [1e-3] * 250
    assert follow(Swinging(burst, [1.0]), 0.9).known
    told = follow(Swinging(burst, [1.0]), 100.0).ended
    assert re.search(r"at this pace 1e5 more follow until t = 100 s.*; ask for a shorter time$", told)


def test_rebounds_that_shrink_by_a_hundredth_make_progress() -> None:
    """Stretches that shrink are followed however many there are."""

    class Rebounding:
        count = 0

        def begin(self) -> Transition[str]:
            return Transition(np.zeros(1), "flight", (), np.inf)

        def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
            self.count += 1
            length = 1e-3 * 0.99**self.count
            return Stretch(
                time, until if length < 1e-12 else time + length, mode, state, state, None if length < 1e-12 else 0
            )

        def change(self, stretch: Stretch[str]) -> Transition[str]:
            return Transition(stretch.last, "flight", (), np.inf)

    route = Rebounding()
    follow(route, 1.0)
    assert route.count > 2000


class Stopping:
    """A route that is refused at its first change, at 0.5 s; states within are the times asked for."""

    def begin(self) -> Transition[str]:
        """See the protocol."""
        return Transition(np.zeros(1), "flight", (), np.inf)

    def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
        """See the protocol."""
        return Stretch(time, min(0.5, until), mode, state, state, 0)

    def change(self, stretch: Stretch[str]) -> Transition[str]:
        """See the protocol."""
        raise Refused(f"no outcome at {stretch.end} s")

    def within(self, stretch: Stretch[str], times: FloatArray) -> FloatArray:
        """See the protocol."""
        return np.clip(times, stretch.start, None)[:, None]


@pytest.mark.parametrize("edge", [0.5, np.inf])
def test_a_refusal_after_another_routes_close_decision_ends_the_path(edge: float) -> None:
    """A refusal ends a path with its reason, unless another route has come to a close decision by then."""
    path = follow(Stopping(), 1.0, (), 1e-9, edge)
    assert not path.known
    assert ("no outcome" in path.ended) == (edge == np.inf)


def test_a_path_that_ends_is_not_followed_further() -> None:
    """States asked for after the last known one are the last known one: rates beyond it may be of any size."""
    path = follow(Stopping(), 1.0, (), 1e-9, 0.0)
    times = np.array([0.25, 0.5, 1.0])
    assert states_of(Stopping(), path, times, path.stretch_at(times))[:, 0].tolist() == [0.25, 0.5, 0.5]


def test_a_path_beyond_a_close_decision_is_short() -> None:
    """After round-off has decided nothing is known: rebounds there are not followed for minutes."""

    class Rebounding:
        count = 0

        def begin(self) -> Transition[str]:
            return Transition(np.zeros(1), "flight", (), 0.0)

        def walk(self, time: float, state: FloatArray, mode: str, until: float) -> Stretch[str]:
            self.count += 1
            return Stretch(time, min(time + 1e-2, until), mode, state, state, 0)

        def change(self, stretch: Stretch[str]) -> Transition[str]:
            return Transition(stretch.last, "flight", (), np.inf)

    route = Rebounding()
    assert not follow(route, 10.0, (), 1e-9).known
    assert route.count <= 50
