"""Candidates for a choice: each setting with each of its steps in each study, over all points of the study."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from proofroll.core.convergence import envelope
from proofroll.core.verdict import LimitResult, Verdict
from proofroll.report.labels import step
from proofroll.report.long_table import TableLine

# Results of a ladder of steps, from the most to the least promising.
_LIMITS = (LimitResult.WITHIN, LimitResult.NO_LADDER, LimitResult.NOT_SHOWN, LimitResult.ANOTHER)

# Roles of observables that a tolerance of the first screen bounds (:class:`proofroll.core.observable.Role`).
_ROLES = ("motion", "reaction")


@dataclass(frozen=True)
class LadderResult:
    """Result of a ladder of steps for motion, or for motion and forces.

    Attributes:
        limit: as the comparison's tolerance has it.
        least: least error that the limit of small steps can have, relative to the quantity's size; None: not known.
    """

    limit: LimitResult
    least: float | None

    def at(self, tolerance: float) -> LimitResult:
        """Result at another tolerance than the comparison's: a known limit is beyond it or within."""
        if self.least is None or self.limit not in {LimitResult.WITHIN, LimitResult.ANOTHER}:
            return self.limit
        return LimitResult.ANOTHER if self.least > tolerance else LimitResult.WITHIN


@dataclass(frozen=True)
class Candidate:
    """One setting with one step in one study, over all its points.

    Attributes:
        row: number of its row in the study.
        spec: engine with all of it, as a command has it: ``name[key=value,…]``.
        scene, place, until: name of the scene, its changed parameters in words, and the length of the run [s].
        name: engine, formulation, setting and step, for a person.
        setting: engine, formulation and setting, without the step.
        step: its step [s] or tolerance; None: it has neither.
        motion, forces: largest error of a coordinate, and of a reaction, relative to its size; None: not reported.
        motion_held, forces_held: smallest tolerance that it holds without luck: the largest of that error, of those of
            its next two finer steps, and of the least error that its limit of small steps can have.
        cost: wall seconds per simulated second at the slowest point; None: not measured.
        clean: True if clean runs measured the cost.
        blame: verdict of a point without a result; None: every point has one.
        motion_ladder, forces_ladder: result of its ladder of steps for either.
        href: HTML id of the evidence of the point with the largest error.
        status: status of that point; empty: every point has a result.
        message: reason why that point has none.
    """

    row: int
    spec: str
    scene: str
    place: str
    until: float
    name: str
    setting: str
    step: float | None
    motion: float | None
    forces: float | None
    motion_held: float | None
    forces_held: float | None
    cost: float | None
    clean: bool
    blame: Verdict | None
    motion_ladder: LadderResult
    forces_ladder: LadderResult
    href: str
    status: str
    message: str

    def error(self, forces: bool) -> float | None:
        """Error at its own step, of motion or of both; None: something is not reported."""
        return _worst([self.motion, self.forces] if forces else [self.motion])

    def tolerance(self, forces: bool) -> float | None:
        """Smallest tolerance that it holds without luck, of motion or of both; None: something is not reported."""
        return _worst([self.motion_held, self.forces_held] if forces else [self.motion_held])

    def limit(self, forces: bool, tolerance: float) -> LimitResult:
        """Result of its ladder of steps at a tolerance, for motion or the worse of both."""
        both = (self.motion_ladder, self.forces_ladder) if forces else (self.motion_ladder,)
        return max((item.at(tolerance) for item in both), key=_LIMITS.index)


def candidates(lines: Sequence[TableLine], href: str, runs: Mapping[tuple[int, str], str]) -> list[Candidate]:
    """Candidates of one row of a study, its own step first.

    ``href``: HTML id of the study's evidence; ``runs``: those of its runs, by row and point.
    """
    needed = list(dict.fromkeys(line.place for line in lines))
    row_step = lines[0].step
    ladders, bounds = [_ladder(lines, role) for role in _ROLES], held_tolerances(lines)
    anchors = {"": href} | {point: run for (row, point), run in runs.items() if row == lines[0].row}
    steps = []
    for value in dict.fromkeys(line.step for line in lines):
        by_point = {point: [line for line in lines if line.step == value and line.place == point] for point in needed}
        steps.append(_candidate(lines[0], value, by_point, bounds=bounds, ladders=ladders, anchors=anchors))
    return sorted(steps, key=lambda item: item.name != _name(lines[0], row_step))


def _candidate(
    table_line: TableLine,
    value: float | None,
    by_point: dict[str, list[TableLine]],
    *,
    bounds: dict[TableLine, float],
    ladders: Sequence[LadderResult],
    anchors: dict[str, str],
) -> Candidate:
    """Candidate for one step of a row; ``anchors``: HTML ids of the evidence by point (the study's: empty point)."""
    name, href = _name(table_line, value), anchors.get("", "")
    judged = {
        point: [line for line in lines if line.verdict not in {Verdict.ILL_POSED, Verdict.NOT_JUDGED}]
        for point, lines in by_point.items()
    }
    judged = {point: lines for point, lines in judged.items() if lines or not by_point[point]}
    costs = [lines[0].cost for lines in by_point.values() if lines]
    cost = None if None in costs else max((item for item in costs if item is not None), default=None)
    clean = all(lines[0].clean for lines in by_point.values() if lines)
    errors_of_lines = {line: line.relative for line in bounds}
    errors = {point: [largest(lines, role, errors_of_lines) for role in _ROLES] for point, lines in judged.items()}
    blame, status, message = _blame(judged)
    if judged:
        furthest = max(errors, key=lambda point: max(errors[point][0] or 0.0, errors[point][1] or 0.0))
        href = anchors.get(furthest, href)
    motion, forces = (_worst([pair[which] for pair in errors.values()]) for which in (0, 1))
    held = [_worst([largest(lines, role, bounds) for lines in judged.values()]) for role in _ROLES]
    return Candidate(
        row=table_line.row,
        spec=_spec(table_line, value),
        scene=table_line.scene,
        place=table_line.place,
        until=table_line.until,
        name=name,
        setting=_name(table_line, None),
        step=value,
        motion=motion,
        forces=forces,
        motion_held=held[0],
        forces_held=held[1],
        cost=cost,
        clean=clean,
        blame=blame,
        motion_ladder=ladders[0],
        forces_ladder=ladders[1],
        href=href,
        status=status,
        message=message,
    )


def _blame(judged: dict[str, list[TableLine]]) -> tuple[Verdict | None, str, str]:
    """Verdict, status and message of the first point without a result; None and empty texts if every point has one."""
    if not judged:
        return Verdict.NOT_JUDGED, "", "no engine can be judged here"
    for point, lines in judged.items():
        if not lines:
            return Verdict.FAILED, "", f"no run with this step at {point}"
        if lines[0].status != "done":
            verdict = {str(item): item for item in Verdict}.get(lines[0].verdict, Verdict.FAILED)
            return verdict, lines[0].status, lines[0].message
    return None, "", ""


def held_tolerances(lines: Sequence[TableLine]) -> dict[TableLine, float]:
    """Smallest tolerance that each line's run holds without luck, relative to the quantity's size.

    The rule is that of the trade-off (:func:`proofroll.core.convergence.envelope`) and that of a verdict: a
    limit of small steps that is beyond the tolerance by more than its doubts outweighs agreement at one step.
    """

    def ladder(line: TableLine) -> tuple[str, int, str, str, str]:
        return line.study, line.row, line.engine, line.place, line.quantity

    bounds = {}
    for _, of_ladder in groupby(sorted(lines, key=lambda x: (*ladder(x), -(x.step or 0.0))), key=ladder):
        steps = list(of_ladder)
        errors, least = [item.relative for item in steps], max(item.limit_least or 0.0 for item in steps)
        floor = errors.index(min(errors)) if any(item.floor for item in steps) else None
        bounds.update({item: max(size, least) for item, size in zip(steps, envelope(errors, floor), strict=True)})
    return bounds


def largest(lines: Sequence[TableLine], role: str, errors: dict[TableLine, float]) -> float | None:
    """Largest error among the lines of a role whose quantity summaries show; None without such a line."""
    return max((errors[line] for line in _shown(lines, role)), default=None)


def _shown(lines: Sequence[TableLine], role: str) -> list[TableLine]:
    """Lines of a role's quantities that have a scale: those that summaries show, or else all."""
    of_role = [line for line in lines if line.role == role and line.scale]
    return [line for line in of_role if line.headline] or of_role


def _ladder(lines: Sequence[TableLine], role: str) -> LadderResult:
    """Worst result of a row's ladder of steps for a role."""
    shown = _shown(lines, role)
    results = [item for line in shown for item in _LIMITS if line.limit == item]
    limit = max(results, key=_LIMITS.index, default=LimitResult.NO_LADDER)
    return LadderResult(limit, max((x for line in shown if (x := line.limit_least) is not None), default=None))


def _worst(errors: Sequence[float | None]) -> float | None:
    sizes = [item for item in errors if item is not None]
    return max(sizes) if sizes and len(sizes) == len(errors) else None


def _spec(line: TableLine, value: float | None) -> str:
    """Engine with formulation, preset, further options and step, as a command has it."""
    options = [f"{key}={word}" for key in ("formulation", "preset") if (word := getattr(line, key))]
    options += [word for word in line.setting.split() if "=" in word]
    options += [f"{line.resolution}={value!r}"] if line.resolution and value is not None else []
    return f"{line.engine}[{','.join(options)}]" if options else line.engine


def _name(line: TableLine, value: float | None) -> str:
    words = " ".join(filter(None, (line.engine, line.formulation, line.setting)))
    size = step(line.resolution or None, value)
    return f"{words} at {size}" if size else words
