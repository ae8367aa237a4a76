"""Thirty random scenes, the same every time, against the relations of the truth."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_fuzz.drawing import drawn_scene
from proofroll_fuzz.evaluation import evaluate_scene
from proofroll_fuzz.mechanisms.families import FAMILIES
from proofroll_fuzz.relations import relations_of, write_scene

# Seed -> kinds that its truth has with reason: what a cylinder does on its end may not be determinate.
_CYLINDER = "truth; ends; the truth ends at t = # s: a cylinder of …"
_ENDS = {
    12: ["truth; ends; the truth ends at t = # s: friction or stops of"],
    21: [_CYLINDER],
    25: [_CYLINDER, "truth; ill-posed; a cylinder of … does not stand on its whole end from"],
}


@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("seed", range(30))
def test_a_random_scene_has_a_truth_that_keeps_a_relation(seed: int, tmp_path: Path) -> None:
    """The truth goes to the end, or says why not, and a scene that has to move alike does."""
    drawn = drawn_scene(FAMILIES, seed)
    relations = relations_of(FAMILIES[drawn.family])
    name = sorted(relations)[seed // len(FAMILIES) % len(relations)]
    write_scene(tmp_path / "scene", drawn.tables)
    runner = Runner(Store(tmp_path / "cases"), jobs=1)
    evaluated = evaluate_scene(tmp_path / "scene", "truth", runner, 120, {name: relations[name]})
    assert evaluated.invalid == ""
    kinds = [str(item.kind) for item in evaluated.surprises]
    assert kinds == _ENDS.get(seed, [])
