"""What a report says of a row over all of its cases."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from proofroll.core.comparison import Band, Comparison, Row, Tolerance
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files.data_folders import data_folder
from proofroll.report.comparison.summary import _worst
from proofroll.report.page.growing import begun
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.comparison.compare import compare


def _run(speed: float, error: float, tolerance: float) -> Any:
    verdict = Verdict.AGREES if error <= tolerance else Verdict.DIFFERS
    judgement = Judgement(
        observable="N", unit="N", error=error, truth_error_bar=1e-12, tolerance=tolerance, scale=40.0, verdict=verdict
    )
    return SimpleNamespace(parameters={"speed": speed}, judgements=[judgement])


def test_the_largest_error_of_a_row_is_that_of_all_its_cases() -> None:
    """The case that is furthest beyond its own tolerance need not have the largest error; both are said."""
    found = _worst([_run(2.0, 0.5, 0.1), _run(6.0, 0.9, 1.0)], "N")
    assert (found.error, found.point) == (0.5, "speed=2")
    assert found.largest == 0.9


def test_nothing_is_loaded_again_after_judging(
    install_engines: Callable[[Mapping[str, str]], None], tmp_path: Path
) -> None:
    """The report of a judged comparison is the same when its scene and the file of its truth are gone."""
    install_engines({"oracle": "hostile:Oracle"})
    scene = tmp_path / "wall"
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", scene)
    band = Band("a look", {"z": Tolerance(1e-3, False, "m")})
    rows = [Row("oracle", "close", list(Verdict), because="a look")]
    asked = Comparison("gone", "Gone", "Is it read?", str(scene), 0.2, 0.1, bands={"close": band}, rows=rows)
    runner = Runner(Store(tmp_path / "out" / "cases"), jobs=1)
    outcome = compare(dataclasses.replace(asked, timed=False), runner)
    assert outcome.runs[0].judgements
    before = begun([outcome], runner.store, "proofroll report gone")
    shutil.rmtree(scene)
    for point in outcome.points.values():
        point.file.unlink()
    after = begun([outcome], runner.store, "proofroll report gone")
    assert dataclasses.replace(after.content, date=before.content.date) == before.content
    assert after.curves == before.curves
    assert after.replay == before.replay
