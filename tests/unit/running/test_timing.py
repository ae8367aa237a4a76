"""Timings taken in turns."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.running.timing import ROUNDS, Timing, interval_text, ratio, time_in_rounds


def test_every_task_once_per_round() -> None:
    """Each round measures every task once before any is measured again, and the first round does not count."""
    seen: list[str] = []

    def task(name: str) -> float:
        seen.append(name)
        return float(len(seen))

    timings = time_in_rounds({name: lambda name=name: task(name) for name in "abc"}, rounds=3)  # type: ignore[misc]

    assert len(seen) == 12
    for start in range(0, 12, 3):
        assert sorted(seen[start : start + 3]) == ["a", "b", "c"]
    assert {len(timing.values) for timing in timings.values()} == {3}
    assert all(timing.warmups[0] <= 3 for timing in timings.values())


def test_what_cannot_be_measured_is_left_out() -> None:
    """A task that gives nothing is not asked again and does not appear; the others do."""
    asked = []

    def broken() -> None:
        asked.append(1)

    timings = time_in_rounds({"broken": broken, "good": lambda: 1.0}, rounds=2)

    assert list(timings) == ["good"]
    assert len(asked) == 1


def test_what_takes_long_is_measured_once() -> None:
    """Its first measurement counts and it is not asked again; what is short is measured as ever."""
    asked: list[str] = []

    def task(name: str, seconds: float) -> float:
        asked.append(name)
        return seconds

    tasks = {"long": lambda: task("long", 2.0), "short": lambda: task("short", 0.1)}
    timings = time_in_rounds(tasks, rounds=3, once_above=0.5)

    assert timings["long"] == Timing((2.0,))
    assert timings["short"] == Timing((0.1,) * 3, (0.1,))
    assert asked.count("long") == 1


def test_a_ratio_is_taken_round_by_round() -> None:
    """A machine that slows down by rounds does not change a ratio."""
    slow, fast = Timing((2.0, 20.0, 200.0)), Timing((1.0, 10.0, 100.0))
    found = ratio(slow, fast)
    assert (found.value, found.low, found.high) == (2.0, 2.0, 2.0)


def test_interval_encloses_the_median() -> None:
    """The interval lies around the median and within what was measured."""
    found = Timing((1.0, 1.1, 1.2, 1.3, 5.0)).interval
    assert found.value == pytest.approx(1.2)
    assert 1.0 <= found.low <= found.value <= found.high <= 5.0


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("count", [1, 2, 3, 5, 6, 9, 20])
def test_an_interval_encloses_the_true_median_as_often_as_it_says(count: int) -> None:
    """Of many samples of a skewed distribution, so many intervals hold its median as their confidence says."""
    rng = np.random.default_rng(0)
    found = [Timing(tuple(rng.exponential(size=count).tolist())).interval for _ in range(4000)]
    share = np.mean([item.low <= np.log(2) <= item.high for item in found])
    # Four standard deviations of a share of 4000.
    assert share == pytest.approx(found[0].confidence, abs=4 * 0.5 / np.sqrt(4000))
    assert found[0].known == (count >= ROUNDS)


def test_only_an_interval_of_95_percent_is_called_one() -> None:
    """One value has no interval, that of three is called a range, and both say with how much they hold the median."""
    confidences = {count: Timing((1.0,) * count).interval.confidence for count in (1, 3, ROUNDS)}
    assert confidences == {1: 0.0, 3: 0.75, ROUNDS: 0.96875}
    assert [interval_text(value) for value in confidences.values()] == [
        "measured once",
        "range of 75 %",
        "interval of 96.9 %",
    ]
