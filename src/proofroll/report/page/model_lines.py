"""Lines for a reader's own model: what makes a setting there, what checks it, and what keeps it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from proofroll.core.engine_abilities import TellsLines
from proofroll.core.errors import ProofrollError
from proofroll.core.plugins import load_engine, parse_engine, resolve_settings
from proofroll.report.page.candidates import Candidate
from proofroll.report.page.choice_cell import ChoiceCell
from proofroll.report.pages import slug


@dataclass(frozen=True)
class ModelLines:
    """Texts to copy by their heads; ``note``: why none of them is the engine's own file or program, else empty."""

    blocks: dict[str, str]
    note: str = ""


def of(cell: ChoiceCell, tolerance: float, date: str) -> ModelLines:
    """Lines for a cell that holds a tolerance: the engine's own, a command, and a test; ``date``: of the report."""
    run = cell.run
    assert run is not None  # it holds
    lines, note = _own(run.spec)
    changed = [word for word in run.place.split(", ") if word and "…" not in word]  # no command has a range
    words = ["proofroll", "compare", run.scene, "--engine", run.spec, "--until", f"{run.until:g}", *_sampled(run)]
    scene = f'load_scene("{run.scene}", {", ".join(changed)})' if changed else f'"{run.scene}"'
    arguments = [scene, f'"{run.spec}"', f'tolerance="{100 * tolerance:g} %"', f'because="report of {date}"']
    test = [
        *(["from proofroll import load_scene", "", ""] if changed else []),
        f"def test_{slug(run.scene).replace('-', '_')}(assert_agrees):",
        "    assert_agrees(",
        *(f"        {argument}," for argument in [*arguments, f"until={run.until:g}"]),
        "    )",
    ]
    return ModelLines(
        ({"In your model": "\n".join(lines)} if lines else {})
        | {
            "Check it": shlex.join([*words, *(part for word in changed for part in ("--set", word))]),
            "Keep it, pytest": "\n".join(test),
        },
        note,
    )


def _sampled(run: Candidate) -> list[str]:
    """Option for at most 50 samples, whole numbers of fixed steps apart; empty: the step is not fixed, or fits none."""
    steps = round(run.until / run.step) if run.step and ",dt=" in run.spec else 0
    if not steps or abs(steps * (run.step or 0.0) - run.until) > 1e-9 * run.until:
        return []
    count = max(count for count in range(1, min(50, steps) + 1) if steps % count == 0)
    return ["--every", f"{run.until / count:.12g}"]


def own_lines(name: str, settings: Mapping[str, Any]) -> Sequence[str]:
    """Lines of an engine's own file or program that make settings.

    Raises:
        ProofrollError: the engine is missing, or its adapter tells no lines.
    """
    engine = load_engine(name)
    if not isinstance(engine, TellsLines):
        raise ProofrollError("its adapter tells no lines for a model of your own")
    return engine.lines(resolve_settings(engine, settings))


@cache
def _own(spec: str) -> tuple[Sequence[str], str]:
    """The same for ``name[key=value,…]``, or why there are none."""
    try:
        asked = parse_engine(spec)
        return own_lines(asked.name, asked.options), ""
    except ProofrollError as error:
        return (), str(error)
