"""Tables of the benchmarks on the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rich.table import Column, Table
from rich.text import Text

from proofroll.core.number_format import number
from proofroll.report.terminal.screen import numeric, plain_table, unbroken

_MEANING = {
    "reduced_over_engine": "reduced, against the fastest engine",
    "reduced_over_contact": "reduced, against the fastest contact model",
    "projection_euler": "projection euler, against numpy and scipy",
    "projection_rotating_frame": "projection rotating_frame, against numpy and scipy",
}


_STYLES = {True: "", False: "yellow", None: ""}


def reference_tables(content: dict[str, Any]) -> Iterator[Table]:
    """Tables of the runs, their speed-ups, and the goals."""
    slip = content["first_slip"]["seconds"]
    columns = numeric("error [m]", "time [ms]", "interval", "built in [s]")
    runs = plain_table(*unbroken(""), *columns, title=f"To the first slip at {slip:.6f} s")
    for row in [*content["models"], *content["engines"]]:
        seconds = row["seconds"]
        runs.add_row(
            row["name"],
            f"{row['error']:.1e}",
            number(1e3 * seconds["value"], 3),
            f"{number(1e3 * seconds['low'])} … {number(1e3 * seconds['high'])}",
            number(row.get("build_seconds")),
        )
    yield runs
    ratios = plain_table(*unbroken(""), *numeric("ratio", "interval", "goal", ""), title="How many times faster")
    for name, measured in content["ratios"].items():
        ratios.add_row(_MEANING[name], *_measured(measured))
    measured = content["onsets_per_second"]
    ratios.add_row("first slips in bulk, per second of one core", *_measured(measured))
    yield ratios


def _measured(found: dict[str, Any]) -> tuple[str, str, str, str]:
    mark = "✓" if found["met"] else "✗"
    if found["value"] is None:
        return "–", "", f"{found['goal']:,.0f}", mark
    ends = f"{found['low']:,.0f} … {found['high']:,.0f}"
    return f"{found['value']:,.0f}", ends, f"{found['goal']:,.0f}", mark


def study_tables(found: dict[str, Any]) -> Iterator[Table]:
    """Tables of the use of wall time × workers, and of every case."""
    title = f"{found['wall_seconds']:.1f} s with {found['jobs']} workers: {found['outside']:.0%} outside the engines"
    shares = plain_table(*unbroken("wall time × workers"), *numeric("part", "of processor time"), title=title)
    parts = found["shares"], found["processor"]["shares"]
    for cause in {**parts[0], **parts[1]}:
        shares.add_row(Text(cause), *(f"{part[cause]:.1%}" if cause in part else "–" for part in parts))
    yield shares
    cases = plain_table(*unbroken("case"), *numeric("f", "simulated", "wall", "outside"))
    for case in found["cases"]:
        outside = "–" if case["outside"] is None else f"{case['outside']:.0%}"
        resistance = "> 0" if case["parameters"] else "0"
        cases.add_row(
            Text(f"{case['engine']} {case['formulation']} ({case['status']})"),
            resistance,
            f"{case['until']:.4g} s",
            f"{case['seconds']:.2f} s",
            outside,
        )
    yield cases


def study_lines(found: dict[str, Any]) -> Iterator[str]:
    """Lines on the cost of process starts, the load of the machine, and the goal."""
    starts = ", ".join(f"{name} {number(seconds)} s" for name, seconds in found["first_answer"].items())
    yield f"from the start of a process to its first answer: {starts}"
    processor = found["processor"]
    yield f"of {processor['seconds']:.1f} s of processor time, {processor['outside']:.0%} outside the engines"
    if found["load_before"] is not None:
        yield f"load average of the machine before: {found['load_before']:.1f}"
    yield f"goal: at most {found['goal']:.0%} outside"


def adapter_table(found: dict[str, Any]) -> Table:
    """One line per engine, formulation and variant of the scene."""
    columns = unbroken("engine formulation setting", "variant", "ratio", "interval")
    table = plain_table(*columns, Column(""), title="advance over bare loop")
    for name, item in found["engines"].items():
        for row in item["rows"]:
            ratio = row["ratio"]
            interval = "" if ratio is None else f"{ratio['low']:.3f}–{ratio['high']:.3f}"
            table.add_row(
                Text(f"{name} {row['formulation']} {row['preset']}"),
                Text(row["variant"]),
                Text("–" if ratio is None else f"{ratio['value']:.3f}", style=_STYLES[row["within_goal"]]),
                Text(interval),
                Text(f"✗ not measured: {row['message']}" if row["failed"] else row["message"]),
            )
    return table


def cluster_lines(found: dict[str, Any]) -> Iterator[str]:
    """Sentences on the cost of a cluster besides its cases."""
    cases = found["cases"]
    yield (
        f"{cases} cases on {found['threads']} threads: {found['wall']:.1f} s, of which {found['processor']:.1f} s of "
        f"this process ({1e3 * found['processor'] / cases:.2g} ms a case), {found['memory']:.0f} MB more than it began "
        f"with, {found['stored'] / cases:.0f} bytes stored a case."
    )
    if found["efficiency"] is not None:
        yield f"Efficiency for cases of {found['seconds']:g} s: {found['efficiency']:.2f} a thread."
