"""Differences of two kinds of arithmetic: in a decision, or in numbers by more than their error bars."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.files.trajectory_file import read
from proofroll.running.case import Status
from proofroll_drill.arithmetic.record import TRUTH


@dataclass(frozen=True)
class Difference:
    """A decision or a number that hangs on the arithmetic.

    Attributes:
        kind: of arithmetic, held against the reference.
        comparison: name of the comparison that shows it.
        what: the decision, by its place in the record; or the number.
        reference, found: both values; of numbers the difference and its bound by the error bars.
    """

    kind: str
    comparison: str
    what: str
    reference: str
    found: str


def differences(kind: str, reference: Path, other: Path, records: tuple[Any, Any]) -> Iterator[Difference]:
    """All of them, of two records (:mod:`proofroll_drill.arithmetic.record`) in their folders."""
    ours, theirs = records
    for comparison in ours:
        mine, its = _in_both(ours[comparison], theirs.get(comparison, {}))
        for place, one, two in _parted(_decisions(mine), _decisions(its)):
            yield Difference(kind, comparison, place, one, two)
        for what, gap, allowed in (*_limits(mine, its), *_numbers(mine, its, reference, other)):
            yield Difference(kind, comparison, what, f"known to {allowed:.2g}", f"off by {gap:.2g}")


def late(records: tuple[Any, Any]) -> list[str]:
    """Runs that ran out of time in one of two records, with their comparison: a busy machine's, no decision."""
    return [
        f"{comparison}: {run}"
        for comparison in records[0]
        for run in dict.fromkeys(run for record in records for run in record.get(comparison, {}).get("late", ()))
    ]


def _in_both(one: Any, two: Any) -> tuple[Any, Any]:
    """Records of the runs whose packages both kinds have and that ended in time in both."""
    both = one, two
    gone = {name for record in both for name in record.get("late", ())}
    for record in both:
        gone |= {name for name, said in record.get("decisions", {}).items() if said["status"] == Status.MISSING}
    left = [
        {
            part: {name: said for name, said in record.get(part, {}).items() if not gone & {name, f"{TRUTH} {name}"}}
            for part in ("decisions", "limits", "truths")
        }
        for record in both
    ]
    return {**one, **left[0]}, {**two, **left[1]}


def _decisions(record: Any) -> dict[str, Any]:
    """Decisions of the runs and of the truths."""
    truths = {f"{TRUTH} {point}": item["decisions"] for point, item in record.get("truths", {}).items()}
    return {**record.get("decisions", {}), **truths}


def _parted(one: Any, two: Any, place: str = "") -> Iterator[tuple[str, str, str]]:
    """Differing leaves of two trees of decisions."""
    if isinstance(one, dict) and isinstance(two, dict):
        for key in [*one, *(key for key in two if key not in one)]:
            yield from _parted(one.get(key), two.get(key), f"{place}: {key}" if place else key)
    elif one != two:
        yield place, str(one), str(two)


def _limits(mine: Any, its: Any) -> Iterator[tuple[str, float, float]]:
    """Limits of small steps that are further apart than the error bars of both."""
    for run, limits in mine["limits"].items():
        for name, (limit, bar) in limits.items():
            found = its["limits"].get(run, {}).get(name)
            if found is not None and abs(limit - found[0]) > bar + found[1]:
                yield f"{run}: limit of {name}", abs(limit - found[0]), bar + found[1]


def _numbers(mine: Any, its: Any, reference: Path, other: Path) -> Iterator[tuple[str, float, float]]:
    """Numbers of the truth that are further apart than the error bars of both."""
    for point, truth in mine["truths"].items():
        if point not in its.get("truths", {}):
            continue
        files = reference / "store" / truth["file"], other / "store" / its["truths"][point]["file"]
        for name, gap, allowed in beyond_bars(*map(read, files)):
            yield f"{TRUTH} {point}: {name}", gap, allowed


def beyond_bars(one: Any, two: Any) -> Iterator[tuple[str, float, float]]:
    """Variables of two true trajectories that differ by more than their bars allow: by how much, and how much that is.

    The time of an event is known to lie in its bracket.
    """
    for name, variable in one.items():
        if name not in two or variable.shape != two[name].shape or not variable.size:
            continue
        bars = [item[name].attrs.get("error_bar") for item in (one, two)]
        if name.startswith("event_time"):
            bars = [_widest(item, name) for item in (one, two)]
        if None in bars or variable.dtype.kind != "f":
            continue
        gap = float(np.nanmax(np.abs(variable.to_numpy() - two[name].to_numpy()), initial=0.0))
        if gap > sum(bars):
            yield name, gap, sum(bars)


def _widest(dataset: Any, name: str) -> float:
    low, high = (dataset[name.replace("event_time", side)].to_numpy() for side in ("event_low", "event_high"))
    return float(np.max(high - low, initial=0.0))
