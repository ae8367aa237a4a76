"""Distances from a reference by steps up to a few times: what is told, in which unit, and up to when."""

from __future__ import annotations

import dataclasses
import io
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import xarray as xr
from folded import whole
from rich.console import Console

from proofroll.core.comparison import Row
from proofroll.core.dataset import BARS, BY_STEPS, ENDED, ENDS, HORIZON
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison.distances import DistanceLine, Distances, distance_cells, distances_of
from proofroll.report.page.html import page
from proofroll.report.page.records import ReportContent
from proofroll.report.terminal.verdicts import verdict_parts
from proofroll.running.case import Result, Status
from proofroll.studies.comparison.outcome import Run
from proofroll.studies.judging.reference import Reference

SCENE = load_scene("pendulum")
TURN = 0.2  # rad
EVERY = 0.02  # s


def motion(until: float, off: tuple[float, float, float] = (0.0, 0.0, 0.0), turn: float = 0.0) -> xr.Dataset:
    """A body at rest that is displaced [m] from 0.2 s on and turned [rad] from 0.5 s on, by quaternions of any sign."""
    times = EVERY * np.arange(round(until / EVERY) + 1)
    places = np.where(times[:, None, None] >= 0.2 - 1e-9, np.array(off), 0.0)
    half = np.where(times >= 0.5 - 1e-9, turn / 2, 0.0)
    zero = np.zeros_like(half)
    quaternions = np.stack([np.cos(half), np.sin(half), zero, zero], axis=1)[:, None] * (-1.0 if turn else 1.0)
    return xr.Dataset(
        {
            "p_WB": (("time", "body", "xyz"), places, {"units": "m"}),
            "attitudes": (("time", "body", "wxyz"), quaternions, {"units": "1"}),
        },
        coords={"time": times},
    )


def reference(until: float, **attrs: str) -> Reference:
    """Reference by steps of the body at rest, known to 1 mm at first, and to 2 mm from 0.3 s on."""
    true = motion(until)
    true["p_WB"].attrs |= {"error_bar": 2e-3, BARS: [0.0, 1e-3, 0.3, 2e-3]}
    true["attitudes"].attrs |= {"error_bar": 1e-3}
    true.attrs |= attrs
    return Reference(SCENE, true, {name: true[name].values for name in ("p_WB", "attitudes")}, {})


def told(reference: Reference, run: xr.Dataset, status: Status = Status.DIVERGED) -> Distances | None:
    """Distances of one run from a reference."""
    made: Any = SimpleNamespace(dataset=run)
    row = Row("mujoco[formulation=joints]", "close")
    return distances_of("", reference, {0: Run(row, {}, None, Result(status, ""), trajectory=made)})


def test_distances_are_the_largest_up_to_each_time() -> None:
    """Lengths of vectors and angles of attitudes, each with the bar that the reference has up to that time."""
    item = told(reference(1.0, **{BY_STEPS: "other", HORIZON: "10 mm to the end"}), motion(1.0, (3e-3, 0, 4e-3), TURN))
    assert item is not None
    assert item.times == pytest.approx([0.1, 0.3, 1.0])
    assert item.horizon == "10 mm to the end"
    bars, line = item.lines
    assert (bars.row, line.row) == (None, 0)
    assert bars.places == [1e-3, 2e-3, 2e-3]
    assert bars.turns == pytest.approx([2e-3] * 3, rel=1e-6)
    assert line.places == pytest.approx([0, 5e-3, 5e-3])
    assert line.turns == pytest.approx([0, 0, TURN])


def test_a_run_that_ends_early_is_told_as_far_as_it_goes() -> None:
    """Behind the last sample of a run that diverged it has no distance."""
    item = told(reference(1.0, **{BY_STEPS: "other"}), motion(0.4, (1e-3, 0, 0)))
    assert item is not None
    assert item.lines[1].places == [0, pytest.approx(1e-3), None]
    assert item.lines[1].turns == [0, 0, None]
    row, run = (
        SimpleNamespace(engine="other"),
        SimpleNamespace(row=0, point="", rough_cost=0.5, seconds_per_second=None),
    )
    name = "proofroll.report.comparison.distances.names"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(name, lambda _: ["other"])
        bars, cells = distance_cells(item, cast("Any", [row]), cast("Any", [run]))
    assert bars == ["known to", "1 2e-3", "2 2e-3", "2 2e-3", ""]
    assert cells == ["other", "0 0", "1 0", "–", "0.5"]


def test_nothing_is_told_behind_the_horizon() -> None:
    """Of a reference that ends early the last time is its own end."""
    item = told(reference(0.44, **{BY_STEPS: "other"}), motion(1.0, (1e-3, 0, 0), TURN))
    assert item is not None
    assert item.times == pytest.approx([0.1, 0.3, 0.44])
    assert item.lines[1].turns == [0, 0, 0]


def test_the_end_of_a_reference_is_not_called_that_of_a_truth() -> None:
    """The clause on an early end says what ends."""
    ends: dict[str, Any] = {ENDS: 0.46, ENDED: "so"}
    made = reference(0.44)
    for attrs, word in (({}, "truth"), ({BY_STEPS: "other"}, "reference")):
        item = dataclasses.replace(made, dataset=made.dataset.assign_attrs({**ends, **attrs}))
        assert item.ended == f"the {word} ends at t = 0.46 s: so"


def test_a_truth_has_no_such_table() -> None:
    """Only a reference by steps is told so: a truth has one bar, and tells velocities and forces, too."""
    assert told(reference(1.0), motion(1.0)) is None
    assert distances_of("", None, {}) is None


@pytest.mark.drill
def test_page_terminal_and_json_show_the_table(content: ReportContent, parse: Any) -> None:
    """At its point each has the bars of the reference first, then a line for each row with its cost there."""
    runs = content.comparisons[0].runs
    lines = [DistanceLine(None, [1e-4, 2e-4], [1e-3, 1e-3]), DistanceLine(1, [5e-3, None], [0.02, None])]
    point = runs[0].point
    item = Distances(point, [0.1, 0.44], "1 mm until 0.3 s", lines)
    comparison = dataclasses.replace(content.comparisons[0], distances=[item])
    text = " ".join(parse(whole(page(dataclasses.replace(content, comparisons=[comparison]), [[]]))).text.split())
    assert f"Distance from the reference at {point}" in text
    assert "Horizon: 1 mm until 0.3 s." in text
    assert "up to [s]0.10.44s/s known to0.1 1e-30.2 1e-3 alpha fine, as installed, dt 1e-3 s5 0.02–0.01" in text
    out = io.StringIO()
    for part in verdict_parts(comparison):
        Console(file=out, width=80, highlight=False, markup=False).print(part)
    shown = " ".join(out.getvalue().split())
    assert f"from the reference at {point}, of any body [mm] and its attitude [rad]: up to 0.1 s 0.44 s s/s" in shown
    assert "alpha fine, as installed, dt 1e-3 s 5 0.02 – 0.01" in shown
    assert plain(comparison)["distances"][0]["lines"][1] == {"row": 1, "places": [5e-3, None], "turns": [0.02, None]}
    assert "Distance from the reference" not in parse(whole(page(content, [[]]))).text
