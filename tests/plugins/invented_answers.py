"""Invented answers of a report's first screen: two scenes at two tolerances."""

from __future__ import annotations

from dataclasses import replace

from proofroll.report.answer.sentences import taken_sentence
from proofroll.report.page.first_screen import ReportedAnswer
from proofroll.studies.answer.records import AllowedError, EngineAnswer, SceneAnswer, StepTried
from proofroll.studies.answer.setting_search import State
from proofroll.studies.study_store import Measured

BOUND = AllowedError("z", "m", 1e-4, 1.0, 1e-12, relative=True)
COARSER = StepTried(2e-3, "done", 4.0, 2.0, 0.5, 1e-2)
HELD = EngineAnswer(
    engine="alpha", title="Alpha", state=State.HOLDS, why="", spec="alpha[formulation=fine,dt=0.001]",
    formulation="fine", preset="matched", resolution="dt", step=1e-3, seconds_per_second=2e-2, timed_alone=True,
    bound=BOUND, error=2.5e-5, held_until=2.0, coarser=COARSER,
)  # fmt: skip
THROUGH = replace(
    HELD, engine="beta", title="Beta", spec="beta[dt=0.001]", formulation="only", preset="default",
    seconds_per_second=1e-2, brought="integrator",
)  # fmt: skip
FINER = EngineAnswer(
    engine="gamma", title="Gamma", state=State.FINER, why="a run of more than 8 s of processor time",
    spec="gamma[dt=0.001]", formulation="", resolution="dt", step=1e-3, bound=BOUND, error=7e-4, held_until=0.5,
    needs_step=8e-5, needs_seconds=21.0,
)  # fmt: skip


def scene_answer(*engines: EngineAnswer, scene: str = "sphere_in_cylinder", tolerance: str = "1e-4") -> SceneAnswer:
    """An answer for a scene."""
    return SceneAnswer(
        scene=scene, parameters={"speed": 3.0}, until=2.0, every=0.02, tolerance=tolerance, bounds=[BOUND],
        unjudged=["attitude"], changes=[], beyond="", open="",
        engines=list(engines), spent=9.0, measured=Measured("2026", {}, {}, ""),
    )  # fmt: skip


def reported(*, study: str = "invented") -> list[ReportedAnswer]:
    """Answers of one comparison at two tolerances: at the tighter one nothing is shown."""
    answers = [scene_answer(HELD, THROUGH, FINER), scene_answer(FINER, tolerance="1e-6")]
    return [ReportedAnswer(item, study, "ball rolling", taken_sentence(item)) for item in answers]
