"""Parts of a report with invented numbers: a stability map, a map of regimes, figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.figures.part import FiguresPart
from proofroll.papers.blajer_2006.figures.reading import load_figures
from proofroll.papers.blajer_2006.figures.study import run_figures
from proofroll.papers.blajer_2006.report.regimes_part import RegimesPart
from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_map
from proofroll.report.stability.part import StabilityPart
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies import study_store
from proofroll.studies.stability.axes import QUICK, Axis
from proofroll.studies.stability.claims import file_for
from proofroll.studies.stability.records import Boundary, BoundaryPoint, ExplainedBoundary, StabilityStudy


def boundary_point(**more: Any) -> BoundaryPoint:
    """A point of an invented map: silent at every step."""
    side = Boundary(None, False, {}, 1e-4, "sank in", True, 1.5, 0.1, "reached 2 s")
    values: dict[str, Any] = {
        "engine": "good", "settings": {"formulation": "only", "preset": "tuned"}, "curve": "good[formulation=only]",
        "level": None, "caveat": "", "family": "", "resolution": "dt", "axis": "V0", "value": 4.0,
        "parameters": {"speed": 4.0},
        "until": 2.0, "period": 0.6, "largest_stable": None, "largest_accurate": None, "boundary": "stable",
        "failure": "sank in", "silent": True, "message": "reached 2 s", "sides": {"stable": side, "accurate": side},
        "least_error": 0.9, "finest": 1e-4, "too_slow": None, "timed_out": False, "runs": 7, "problem": None,
    }  # fmt: skip
    return BoundaryPoint(**(values | more))


def stability_study() -> StabilityStudy:
    """A map of two points: one silent at every step, one with a boundary and a program."""
    silent = boundary_point()
    held = replace(silent.shown, largest=1e-3, reached=True, numbers={"turn": 0.2}, silent=False)
    other = boundary_point(
        value=8.0, largest_stable=1e-3, largest_accurate=1e-3, silent=False, sides={"stable": held, "accurate": held},
        reproducer="/somewhere/else/stability/x/good-V0-8.py",
    )  # fmt: skip
    explained = ExplainedBoundary("turn", 0.2, 0.3, 1.5, True, curve=silent.curve, axis="V0", boundary="stable")
    return StabilityStudy(
        scene="sphere_in_cylinder", axes=[Axis("V0", "m/s", "how fast it begins", [4.0, 8.0])], periods=3.0,
        accurate=0.01, runs=14, boundaries=2, silent=1, refused=0, wrong_model=0, failures={"sank in": 2},
        never_accurate=1, meanings={}, points=[silent, other], explanations=[explained],
        findings=["good depends on mass, which should not matter"], step_symbols={}, places=[], absent={}, effort=QUICK,
        measured=study_store.conditions_now(),
    )  # fmt: skip


def further() -> list[Any]:
    """A map with an invented study."""
    file = file_for("sphere_in_cylinder")
    folder = "stability/sphere_in_cylinder"
    return [StabilityPart(file, study=stability_study(), folder=folder)]


FIGURES = """
study = "figures"
title = "Invented figures"
source = "somebody"
scene = "sphere_in_cylinder"
engine = "truth"
until = 0.3
every = 0.01
runs.free = { label = "free", parameters = { speed = 4 } }

[[figures]]
name = "height"
caption = "The height over time."
panels = [{ y = ["z"], runs = ["free"] }]

[[figures]]
name = "map"
caption = "What happens where."
regimes = "regimes"

[[statements]]
says = "ω3 is constant"
source = "section 3"
runs = ["free"]
of = "omega3"
measure = "every"
stated = "-160"
"""


def regimes_part() -> RegimesPart:
    """A map of four short true runs."""
    scene = load_scene("sphere_in_cylinder")
    return RegimesPart(load_regimes("regimes"), maps=[regime_map(scene, [3.0, 4.0], [0.1, 0.7], until=0.5)])


def figures_part(folder: Path) -> FiguresPart:
    """A figure of a true run, one of a map, and a statement that holds."""
    file = folder / "invented.toml"
    file.write_text(FIGURES, encoding="utf-8")
    part = FiguresPart(load_figures(str(file)), maps={"regimes": regimes_part().maps})
    part.study = run_figures(part.asked, Runner(Store(folder / "cases"), jobs=1), None, lambda *_: None)
    return part
