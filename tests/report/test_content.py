"""What a report says of a row over all of its cases."""

from __future__ import annotations

import dataclasses
import shutil
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files import scene_file, trajectory_file
from proofroll.files.data_folders import data_folder
from proofroll.report.comparison.summary import _worst
from proofroll.report.page.growing import begun
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import evaluate, run_plans
from proofroll.studies.comparison.planning import plan


def _run(speed: float, error: float, tolerance: float) -> Any:
    verdict = Verdict.AGREES if error <= tolerance else Verdict.DIFFERS
    judgement = Judgement(
        observable="N", unit="N", error=error, truth_error_bar=1e-12, tolerance=tolerance, scale=40.0, verdict=verdict
    )
    return SimpleNamespace(point=f"speed={speed:g}", judgements=[judgement])


def test_the_largest_error_of_a_row_is_that_of_all_its_cases() -> None:
    """The case that is furthest beyond its own tolerance need not have the largest error; both are said."""
    found = _worst([_run(2.0, 0.5, 0.1), _run(6.0, 0.9, 1.0)], "N")
    assert (found.error, found.point) == (0.5, "speed=2")
    assert found.largest == 0.9


def counted(load: Callable[..., Any], counts: Counter[str]) -> Callable[..., Any]:
    """The function, with its calls counted by what they load."""

    def loading(place: Any, *others: Any) -> Any:
        counts[str(place)] += 1
        return load(place, *others)

    return loading


@pytest.mark.nightly
def test_nothing_is_loaded_again_after_judging(
    install_engines: Callable[[Mapping[str, str]], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report of a judged comparison is the same when its scene and the files of its runs and truth are gone.

    Judging and reporting read each run and the truth once, and load no scene.
    """
    install_engines({"oracle": "hostile:Oracle"})
    scene = tmp_path / "wall"
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", scene)
    band = Band("a look", {"z": Tolerance(1e-3, False, "m")})
    rows = [Row("oracle", "close", list(Verdict), because="a look")]
    asked = Comparison("gone", "Gone", "Is it read?", str(scene), 0.2, 0.1, bands={"close": band}, rows=rows)
    runner = Runner(Store(tmp_path / "out" / "cases"), jobs=1)
    planned = plan(dataclasses.replace(asked, timed=False), workers=runner.workers)
    (planned,), results = run_plans([planned], runner)
    counts: Counter[str] = Counter()
    for place, what in ((trajectory_file, "read"), (scene_file, "_read")):
        monkeypatch.setattr(place, what, counted(getattr(place, what), counts))
    outcome = evaluate(planned, results, runner)
    assert outcome.runs[0].judgements
    before = begun([outcome], "proofroll report gone")
    assert set(counts.values()) == {1}, "each run once, and the truth"
    assert counts.keys() == {str(runner.store.trajectory(case)) for case in planned.cases}, "and no scene"
    shutil.rmtree(scene)
    for item in (*outcome.points.values(), *outcome.runs):
        assert item.trajectory is not None
        item.trajectory.file.unlink()
    after = begun([outcome], "proofroll report gone")
    assert dataclasses.replace(after.content, date=before.content.date) == before.content
    assert after.curves == before.curves
    assert after.replay == before.replay
