"""The verdict table in Markdown."""

from __future__ import annotations

from typing import Any

from proofroll.report.labels import SYMBOLS
from proofroll.report.terminal import columns, number, step


def verdict_table(content: dict[str, Any]) -> str:
    """One line per engine with settings: the worst over all points of the parameters."""
    names = columns(content)
    head = ["engine", "formulation", "setting", "step", "verdict", *(f"{n} [{unit}]" for n, unit in names), "s/s"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in content["rows"]:
        errors = [row["observables"][name]["error"] if name in row["observables"] else None for name, _ in names]
        cells = [row["name"], row["formulation"] or "", row["setting"], step(row)]
        cells.append(f"{SYMBOLS[row['verdict']]} {row['verdict']}")
        cells += [number(error) for error in errors]
        cells.append(number(row["seconds_per_second"]))
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
