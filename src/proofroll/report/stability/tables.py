"""Tables of a stability map for the terminal, within 100 columns."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rich.table import Table
from rich.text import Text

from proofroll.core.number_format import counted, number
from proofroll.report.labels import family_and_caveat, name_of, step, with_caveat
from proofroll.report.terminal.screen import numeric, plain_table, unbroken
from proofroll.running.case import host_sentences
from proofroll.studies.stability.records import BoundaryPoint, ExplainedBoundary, StabilityStudy, silent_ranking

# Relative error, in ranges of the quantity, beyond which the number itself is not given.
_BEYOND = 1e6


def stability_parts(study: StabilityStudy, path: Path) -> Iterator[Table | str]:
    """Parts of a map stored in ``path``: boundaries, the worst silent cases, conclusions, what is missing."""
    yield from (headline(study), "", boundary_table(study), "")
    silent = list(silent_lines(study))
    if silent:
        yield "The largest errors that the engines do not report:"
    yield from (f"  {line}" for line in silent)
    yield from study.findings
    yield from (f"{place.axis} = {place.value:g}: {place.problem}" for place in study.places if place.problem)
    yield from (f"{name}: {reason}" for name, reason in study.absent.items())
    yield from (f"!! {line}" for line in study.claims.contradictions)
    yield f"The map is in {path.with_suffix('.html')}, everything in {path}."


def headline(study: StabilityStudy) -> str:
    """Summary of a map: points, boundaries, those that the engine does not report (silent), and kinds of failure.

    It counts refused and skipped points, and names the machines of a cluster.
    """
    counts = ", ".join(f"{count} {kind}" for kind, count in sorted(study.failures.items(), key=lambda i: -i[1]))
    sizes = f"{counted(len(study.points), 'points')}, {counted(study.boundaries, 'boundaries')}"
    text = f"{sizes}, {study.silent} of them silent ({counted(study.runs, 'runs')})."
    if counts:
        text += f" Beyond: {counts}."
    if study.refused:
        text += f" Refused before the run: {counted(study.refused, 'points')}."
    if study.wrong_model:
        text += f" At {study.wrong_model} the engine built a different scene."
    if study.never_accurate:
        text += f" At {counted(study.never_accurate, 'points')} no step or tolerance that was affordable holds 1 %."
    return " ".join([text, *host_sentences(study.hosts)])


def boundary_table(study: StabilityStudy) -> Table:
    """Table with a line per engine, formulation, setting and axis: its boundaries from the least to the largest.

    ``+``: nothing failed on the ladder; ``n!``: n silent failures beyond the boundaries.
    """
    named = (name for point in study.points for name in point.sides["stable"].numbers)
    symbol = study.step_symbols.get(next(named, ""), "step in natural times")
    table = plain_table(
        *unbroken("engine formulation setting", "axis"),
        *numeric("stable", "holds 1 %"),
        *unbroken("which is", "beyond"),
        title=f"Largest {symbol} (or tolerance) along each axis; n!: n times silent",
    )
    explained = {(e.curve, e.axis): e for e in study.explanations if e.boundary == "accurate"}
    last = ""
    for (curve, axis), points in grouped(study).items():
        name = name_of(points[0])
        table.add_row(
            Text(name if name != last else ""),
            axis,
            _range(points, "stable"),
            _range(points, "accurate"),
            Text(_explained(explained.get((curve, axis)), study.step_symbols)),
            Text(_beyond(points)),
        )
        last = name
    return table


def _beyond(points: Sequence[BoundaryPoint]) -> str:
    """Most frequent failure beyond the boundaries, and its silent cases (``n!``); silent ones win ties."""
    kinds = Counter(point.failure for point in sorted(points, key=lambda item: not item.silent) if point.failure)
    common = next((kind for kind, _ in kinds.most_common(1)), "")
    silent = sum(point.silent for point in points if point.failure == common)
    return f"{common} {silent}!" if silent else common


def grouped(study: StabilityStudy) -> dict[tuple[str, str], list[BoundaryPoint]]:
    """Points of the map by curve and axis."""
    groups: dict[tuple[str, str], list[BoundaryPoint]] = {}
    for point in study.points:
        groups.setdefault((point.curve, point.axis), []).append(point)
    return groups


def size(point: BoundaryPoint, side: str) -> float | None:
    """Size shown for a boundary: the first dimensionless number of its step, or the tolerance itself; None: none."""
    limit = point.sides[side]
    if point.resolution != "dt":
        return limit.largest
    return next(iter(limit.numbers.values()), None)


def _range(points: Sequence[BoundaryPoint], side: str) -> str:
    valid = [point for point in points if not (point.problem and side == "accurate")]
    if not valid:
        return "no truth"
    values = [size(point, side) for point in valid]
    sizes = [value for value in values if value is not None]
    if not sizes:
        return "none"
    low = "none" if len(sizes) < len(values) else number(min(sizes))
    high = number(max(sizes)) + ("" if any(p.sides[side].reached for p in valid) else "+")
    return low if low == high else f"{low}…{high}"


def _explained(boundary: ExplainedBoundary | None, symbols: Mapping[str, str]) -> str:
    """Text of the dimensionless number that is constant along an axis' boundary; empty without one."""
    if boundary is None or not boundary.explains:
        return ""
    return f"{symbols[boundary.number]} {number(boundary.low)}…{number(boundary.high)}"


def silent_lines(study: StabilityStudy) -> Iterator[str]:
    """The eight worst silent cases as sentences, at most one for each curve and axis."""
    seen: set[tuple[str, str]] = set()
    for point in silent_ranking(study):
        if (point.curve, point.axis) in seen or len(seen) >= 8:
            continue
        seen.add((point.curve, point.axis))
        side = point.shown
        wrong = "" if side.error is None else f", off by {number(100 * side.error, 3)} % of the range"
        wrong = wrong if (side.error or 0.0) <= _BEYOND else ", off by more than a million times the range"
        finest = step(point.resolution, point.finest)
        if side.largest is not None:
            beyond = f"just beyond {step(point.resolution, side.largest)}"
        elif point.cut:
            beyond = f"down to {finest}, finer ones take too long"
        else:
            beyond = f"at every {'step' if point.resolution == 'dt' else 'tolerance'} down to {finest}"
        place = f"{with_caveat(name_of(point), family_and_caveat(point))} at {point.axis} = {point.value:g}"
        yield f"{place}: {point.failure} {beyond}{wrong}"
