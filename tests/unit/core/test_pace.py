"""Pace of a truth: it says how far it has come, and its limit ends it where it is."""

from __future__ import annotations

from itertools import count

import pytest

from proofroll.core.pace import OutOfTime, Pace


@pytest.fixture
def ticking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processor time is a hundredth of a second more at each look."""
    ticks = count()
    monkeypatch.setattr("proofroll.core.pace.time.process_time", lambda: next(ticks) / 100)


@pytest.mark.usefixtures("ticking")
def test_it_says_how_far_a_truth_has_come() -> None:
    """Every second the time that is reached is told, with the time that both routes still take."""
    pace, told = Pace(), list[str]()
    pace.until = 4.0
    with pace.limited(100.0, told.append):
        pace.follow("first", 2.0)
        for step in range(101):
            pace.reached(1.0 * step / 100)
        pace.follow("second", 2.0)
        for step in range(200):
            pace.reached(1.0 + step / 200)
        pace.leave()
    # half of the first route took a second: as much again is left of it, and twice that for the second route
    texts = ["1.98 of 4 s, about 3 s left", "2.98 of 4 s, about 1 s left", "3.99 of 4 s, about 0 s left"]
    assert told == [*texts, "its end, held against the laws", ""]
    assert pace.text == ""


def test_what_comes_before_a_route_says_nothing_of_its_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    """A route that compiles for a minute and then comes far in a second is nearly over; short first steps tell none."""
    clock, told = [0.0], list[str]()
    monkeypatch.setattr("proofroll.core.pace.time.process_time", lambda: clock[0])
    pace = Pace()
    pace.until = 1.0
    with pace.limited(1000.0, told.append):
        pace.follow("second", 1.0)
        for clock[0], reached in ((60.0, 0.0), (61.5, 1e-5), (63.0, 0.5)):
            pace.reached(reached)
    assert told == ["1e-05 of 1 s", "0.5 of 1 s, about 3 s left", ""]


def follow_on(pace: Pace) -> None:
    """Goes on in small steps without end."""
    for step in count():
        pace.reached(step / 1000)


@pytest.mark.usefixtures("ticking")
def test_routes_share_the_limit() -> None:
    """The first route has half of the limit, the second the rest, and what follows them has none."""
    pace = Pace()
    with pace.limited(1.0):
        reached = []
        for route in ("first", "second"):
            pace.follow(route, 1.0)
            with pytest.raises(OutOfTime, match="its limit of 1 s of processor time was reached") as ended:
                follow_on(pace)
            reached.append(ended.value.time)
        assert reached[0] == pytest.approx(reached[1], abs=0.002)
        pace.leave()
        pace.reached(1.0)
    assert pace.over
    with pace.limited(1.0):
        assert not pace.over
