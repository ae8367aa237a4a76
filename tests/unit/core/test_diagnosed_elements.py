"""Which elements of a scene are asked for a cause."""

from __future__ import annotations

from dataclasses import replace

import pytest

from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.time_grid import time_grid
from proofroll.core.truth import truth
from proofroll.core.verdict import Judgement, Verdict
from proofroll.files.scene_file import load_scene
from proofroll.running.recording import record
from proofroll.running.simulation import build

TIMES = time_grid(0.2, 5e-3)


@pytest.mark.nightly_of("neither")
@pytest.mark.drill
@pytest.mark.parametrize("wrong", [0, None], ids=["ball", "neither"])
def test_an_element_that_is_right_is_not_accused(wrong: int | None) -> None:
    """What an element tells within all tolerances has no cause, whatever would close it; only a wrong one is asked."""
    elements = (load_scene("sphere_in_cylinder").elements[0], load_scene("pendulum").elements[0])
    scene = replace(load_scene("sphere_in_cylinder"), elements=elements)
    run = record(build(scene, "projection"), scene, TIMES).dataset
    for name in (name for name in run.data_vars if str(name).startswith("w_WB")):
        run[name] = -run[name]
    judged = [
        Judgement(
            observable=name,
            unit=item.unit,
            error=0.0,
            truth_error_bar=0.0,
            tolerance=1e-9,
            scale=1.0,
            verdict=Verdict.DIFFERS if wrong is not None and name.endswith(elements[wrong].name) else Verdict.AGREES,
        )
        for name, item in scene.observables.items()
    ]
    accused = {item.element for item in diagnose_scene(scene, [], run, truth(scene, TIMES), judgements=judged)}
    assert accused <= ({elements[wrong].name} if wrong is not None else set())
    everywhere = {item.element for item in diagnose_scene(scene, [], run, truth(scene, TIMES))}
    assert everywhere == {element.name for element in elements}, "nothing to hold back"
