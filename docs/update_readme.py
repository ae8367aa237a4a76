"""Regenerates README.md's pictures and the tables of docs/sphere_in_cylinder.md from real runs: ``make readme``.

Parts are made by name (verdicts, costs, regimes), or all. Runs in ``out`` that still hold are reused; costs of the
table of costs are measured anew.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from made_from import facts, restamped, stamp
from markdown_tables import caveat_list, cheapest_table, remark_list, verdict_table
from screenshot import screenshot

from proofroll.files.comparison_file import load_comparison
from proofroll.papers.blajer_2006.report.regime_map import draw as draw_regimes
from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps
from proofroll.report.answer.picture import svg
from proofroll.report.comparison.summary import outcome_content
from proofroll.running.runner import Runner
from proofroll.running.store import Store, write_text
from proofroll.studies.answer.answers import answer
from proofroll.studies.answer.question import question_named
from proofroll.studies.comparison.compare import compare
from proofroll.studies.comparison.outcome import Outcome
from proofroll.studies.comparison.planning import point_name
from proofroll.studies.judging.asked_tolerance import AskedTolerance

ROOT = Path(__file__).resolve().parents[1]
TOLERANCES = ("1e-2", "1e-4", "1e-6")
DRAWN = "1e-4"
POINT = {"speed": 4.0, "rolling_resistance": 0.0}
SHOWN = (
    "mujoco[formulation=chart,preset=default]",
    "pinocchio[formulation=impulses]",
    "mujoco[formulation=geoms,dt=1e-4]",
    "exudyn[formulation=spheres]",
    "mujoco[formulation=chart]",
    "exudyn[formulation=carrier]",
    "pinocchio[formulation=composite]",
    "projection[formulation=euler]",
)
COLOURS = mpl.colormaps["viridis"](np.linspace(0.92, 0.0, len(SHOWN)))


def draw(outcome: Outcome, path: Path) -> None:
    """Height over time, and distance from the truth over time, for a selection of engines."""
    truth = outcome.points[point_name(POINT)].trajectory.dataset
    runs = {run.row.engine: run for run in outcome.runs if run.parameters == POINT}
    mpl.rcParams.update({"svg.hashsalt": "proofroll", "svg.fonttype": "none", "font.size": 9})
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), constrained_layout=True)
    for name, colour in zip(SHOWN, COLOURS, strict=True):
        run = runs[name]
        if run.trajectory is None:
            continue
        z = run.trajectory.dataset["z"]
        left.plot(z["time"], z, color=colour, lw=1)
        error = np.abs(z - truth["z"])[1:]
        right.semilogy(
            error["time"], np.maximum(error, 1e-16), color=colour, lw=1, label=name.replace("formulation=", "")
        )
    left.plot(truth["time"], truth["z"], color="black", lw=2.2, ls=(0, (4, 2)), label="truth")
    left.set(xlabel="time [s]", ylabel="height z [m]", ylim=(-0.35, 0.05), title="4 m/s, rolling without slip")
    left.legend(frameon=False)
    right.axhspan(1e-16, truth["z"].attrs["error_bar"], color="0.85", lw=0)
    right.set(
        xlabel="time [s]",
        ylabel="|z - truth| [m]",
        ylim=(1e-16, 10),
        title="distance from the truth (grey: its error bar)",
    )
    right.legend(frameon=False, fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, metadata={"Date": None})


def between(text: str, name: str, table: str) -> str:
    """The page with this table between the two marks of a name."""
    begin, end = f"<!-- {name}:begin -->\n", f"<!-- {name}:end -->"
    head, tail = text.partition(begin)[0], text.partition(end)[2]
    return head + begin + table + end + tail


def verdicts(runner: Runner, folder: Path) -> dict[str, str]:
    """Tables of the founding comparison and its picture; picture of the first screen of ``make report``."""
    outcome = compare(load_comparison("paper"), runner)
    draw(outcome, ROOT / "docs" / "picture.svg")
    subprocess.run([sys.executable, "-m", "proofroll", "report", "--out", str(folder)], check=True)
    screenshot(folder / "report.html", ROOT / "docs" / "report.png")
    content = outcome_content(outcome)
    return {"verdicts": verdict_table(content), "caveats": caveat_list(content), "remarks": remark_list(content)}


def costs(runner: Runner, _: Path) -> dict[str, str]:
    """Table of what is cheapest, and the picture of error against cost."""
    question = question_named("sphere_in_cylinder", {})
    answers = answer(question, [AskedTolerance.of([text], question.loaded) for text in TOLERANCES], [], runner)
    drawn = next(made for made in answers if made.tolerance == DRAWN)
    write_text(ROOT / "docs" / "work_precision.svg", svg(drawn, alone=True))
    return {"cheapest": cheapest_table(answers)}


def regimes(_: Runner, __: Path) -> dict[str, str]:
    """The picture of the maps of regimes."""
    draw_regimes(regime_maps(load_regimes("regimes"), workers=os.cpu_count() or 1), ROOT / "docs" / "regimes.svg")
    return {}


PARTS = {"verdicts": verdicts, "costs": costs, "regimes": regimes}


def main(names: Sequence[str]) -> None:
    """Runs the studies of the parts, and rewrites their tables and pictures."""
    folder, target = ROOT / "out" / "readme", ROOT / "docs" / "sphere_in_cylinder.md"
    runner, text = Runner(Store(folder / "cases")), target.read_text(encoding="utf-8")
    for name in names or PARTS:
        for mark, table in PARTS[name](runner, folder).items():
            text = between(text, mark, table)
        if name == "verdicts":
            text = restamped(text, stamp("paper", facts("paper")))
        write_text(target, text)


if __name__ == "__main__":
    main(sys.argv[1:])
