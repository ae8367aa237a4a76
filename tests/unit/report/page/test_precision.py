"""Work–precision pictures: which points they have."""

from __future__ import annotations

from dataclasses import replace

from table_lines import ARM, FORCE, line

from proofroll.report.page.precision import work_precision


def test_a_curve_is_a_setting_with_its_steps() -> None:
    """The row's own step and those of its ladder, the coarsest first; motion, forces and each quantity have errors."""
    found = work_precision(ARM)
    assert found is not None
    assert found.quantities == ["motion (largest of all coordinates)", "forces (largest of all reactions)", "x", "F"]
    coarse, tuned = found.curves
    assert (coarse.engine, coarse.name, tuned.name) == ("alpha", "joints default", "joints tuned")
    assert [point.step for point in coarse.points] == ["dt 1e-3 s", "dt 2.5e-4 s"]
    assert coarse.points[0].errors == [5e-4, 3e-2, 5e-4, 3e-2]
    assert [point.clean for point in coarse.points] == [True, False]
    assert [point.verdict for point in coarse.points] == ["agrees", "agrees"]


def test_the_front_takes_no_luck() -> None:
    """What a picture calls held is what the first screen does: an error counts no less than those of finer steps."""
    found = work_precision([line(error=1e-6), line(step=5e-4, error=2e-2, cost=0.02, verdict="", limit="")])
    assert found is not None
    assert [(point.errors[0], point.held[0]) for point in found.curves[0].points] == [(1e-6, 2e-2), (2e-2, 2e-2)]


def test_places_are_joined_by_the_worst() -> None:
    """Error and cost are those of the worst point; a step that fails at one point is no point."""
    heavy = [line(place="mass=2", error=9e-4, cost=0.03)]
    found = work_precision([*ARM, *heavy])
    assert found is not None
    assert found.curves[0].points[0].errors[0] == 9e-4
    assert found.curves[0].points[0].cost == 0.03
    lost = [replace(item, status="diverged", error=None, cost=None) for item in heavy]
    without = work_precision([*ARM, *lost])
    assert without is not None
    assert [point.step for point in without.curves[0].points] == ["dt 2.5e-4 s"]


def test_a_point_beyond_all_size_is_kept_for_its_mark() -> None:
    """An infinite error is a point; where nobody can be judged, or nothing was timed, there is no picture."""
    found = work_precision([*ARM, line(setting="wild", error=None)])
    assert found is not None
    assert found.curves[-1].points[0].errors[0] == 1e300
    assert work_precision([replace(item, verdict="ill-posed") for item in ARM]) is None
    assert work_precision([replace(item, cost=None) for item in ARM]) is None
    assert work_precision([FORCE]) is None, "one point"
