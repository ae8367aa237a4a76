"""Ratios of adapters to bare loops."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from proofroll.running.timing import Interval
from proofroll_benchmarks import bare
from proofroll_benchmarks.adapters import GOAL, AdapterRow, bench_adapters, content, measure_adapter
from proofroll_benchmarks.bare import Bare


@pytest.mark.drill
def test_a_third_party_engine_without_a_bare_loop(
    install_engines: Callable[[Mapping[str, str]], None],
) -> None:
    """Such an engine has one row, without a ratio, that says what is missing."""
    install_engines({"tiny": "tiny:Tiny"})
    (row,) = bench_adapters(["tiny"], rounds=1, seconds=0.01)
    assert row.ratio is None
    assert "no bare loop" in row.message
    found = content([row])["engines"]["tiny"]
    assert found["ratio"] is None
    assert found["within_goal"] is None
    assert "no bare loop" in found["message"]


def test_an_engine_that_cannot_be_loaded(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """It has one row with the reason."""
    install_engines({"absent": "no_such_module:Engine"})
    (row,) = bench_adapters(["absent"], rounds=1, seconds=0.01)
    assert row.ratio is None
    assert "no_such_module" in row.message


@pytest.mark.drill
def test_a_preset_that_no_formulation_has(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """It is said, and nothing else is measured in its place."""
    install_engines({"tiny": "tiny:Tiny"})
    (row,) = bench_adapters(["tiny"], preset="tuned", rounds=2, seconds=0.01)
    assert row.ratio is None
    assert row.message == "no formulation has the preset tuned"


def measured(monkeypatch: pytest.MonkeyPatch, centre: Callable[[np.ndarray[Any, Any]], Any]) -> dict[str, Any]:
    """What is measured of the projection method with a bare loop that gives this centre."""
    monkeypatch.setattr(
        bare,
        "load_bare_loop",
        lambda engine: lambda scene, settings: Bare(centre, 1e-9, "none"),  # noqa: ARG005 -- the same for all
    )
    return measure_adapter("projection", {"formulation": "rotating_frame"}, {}, 2, 0.002)


@pytest.mark.nightly
def test_no_ratio_for_another_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bare loop that ends elsewhere is measured against nothing; nor is one whose end is not finite."""
    for wrong in (0.0, np.nan):
        answer = measured(monkeypatch, lambda times, wrong=wrong: times[0] + np.full(3, wrong))  # type: ignore[misc]
        assert "adapter" not in answer
        assert not answer["distance"] <= answer["tolerance"]


def test_the_bare_loop_runs_over_the_same_times(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both loops pass the same instants, 0.02 s apart, from 0 to the end that is reported."""
    seen = []
    answer = measured(monkeypatch, lambda times: (seen.append(times), np.zeros(3))[1])
    assert seen[-1][0] == 0.0
    assert seen[-1][-1] == pytest.approx(answer["until"])
    np.testing.assert_allclose(np.diff(seen[-1]), 0.02)


def test_the_worst_row_speaks_for_an_engine() -> None:
    """An engine's ratio is that of its slowest row, and the goal holds only if it does for each."""
    rows = [
        AdapterRow("e", "one", "matched", "f = 0", Interval(1.05, 1.0, 1.1, 0.97), ""),
        AdapterRow("e", "two", "matched", "f > 0", Interval(1.4, 1.3, 1.5, 0.97), ""),
        AdapterRow("e", "two", "matched", "bounded, slips", None, "refused"),
        AdapterRow("good", "one", "matched", "f = 0", Interval(GOAL, 1.0, 1.2, 0.97), ""),
    ]
    found = content(rows)
    assert found["engines"]["e"]["ratio"] == {"value": 1.4, "low": 1.3, "high": 1.5, "confidence": 0.97}
    assert found["engines"]["e"]["worst"] == "two, f > 0"
    assert found["engines"]["e"]["within_goal"] is False
    assert found["engines"]["good"]["within_goal"] is True
    assert [row["within_goal"] for row in found["engines"]["e"]["rows"]] == [True, False, None]
    assert [row["failed"] for row in found["engines"]["e"]["rows"]] == [False, False, True]


def test_a_share_of_a_part_is_no_cost_of_an_adapter() -> None:
    """A row whose loop lacks a part is measured, and speaks neither for the engine's ratio nor against the goal."""
    share = Interval(4.0, 3.9, 4.1, 0.97)
    plain = AdapterRow("e", "one", "matched", "sled", Interval(1.05, 1.0, 1.1, 0.97), "")
    row = AdapterRow("e", "one", "matched", "f = 0", share, "", lacks="wall")
    assert (row.within_goal, row.failed) == (None, False)
    assert content([plain, row])["engines"]["e"]["ratio"]["value"] == 1.05


def test_a_row_that_the_engine_refuses_does_not_fail() -> None:
    """There is nothing to measure where an engine does not represent the scene; elsewhere a missing ratio fails."""
    refused = AdapterRow("e", "one", "matched", "sled", None, "refused: no spheres", refused=True)
    assert (refused.failed, AdapterRow("e", "one", "matched", "sled", None, "5.8 m apart").failed) == (False, True)
