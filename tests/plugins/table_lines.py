"""Lines of a long table: one engine on an arm, with a ladder of steps and a tuned setting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from proofroll.report.long_table import TableLine

LINE = TableLine(
    study="arm", group="trees", scene="arm", place="", case="", own_case=True, until=1.0, row=0, engine="alpha",
    version="1", formulation="joints", preset="default", setting="as installed", precision="double",
    own_equations=False, resolution="dt", step=1e-3, status="done", message="", verdict="agrees",
    limit="within tolerance", quantity="x",
    unit="m", role="motion", headline=True, error=5e-4, truth_error_bar=1e-12, tolerance=1e-2, scale=1.0, order=2.0,
    cost=0.01, cost_low=None, cost_high=None, clean=True,
)  # fmt: skip


def line(**changes: Any) -> TableLine:
    """A line of the table."""
    return replace(LINE, **changes)


FORCE = line(quantity="F", unit="N", role="reaction", error=3e-2, scale=1.0)
FINER = [line(step=2.5e-4, error=3e-5, cost=0.04, clean=False, verdict=""), replace(FORCE, step=2.5e-4, error=2e-3)]
TUNED = [
    line(row=1, preset="tuned", setting="tuned", error=2e-7, cost=0.2),
    line(row=1, preset="tuned", setting="tuned", quantity="F", role="reaction", error=1e-6, cost=0.2),
]
ARM = [LINE, FORCE, *FINER, *TUNED]
