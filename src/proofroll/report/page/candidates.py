"""Candidates for a choice: each setting with each of its steps in each study, over all places of the study."""

from collections.abc import Sequence
from dataclasses import dataclass

from proofroll.core.verdict import LimitResult, Verdict
from proofroll.report.labels import step
from proofroll.report.long_table import TableLine

# Results of a ladder of steps, from the most to the least promising.
_LIMITS = (LimitResult.WITHIN, LimitResult.NO_LADDER, LimitResult.NOT_SHOWN, LimitResult.ANOTHER)


@dataclass(frozen=True)
class Candidate:
    """One setting with one step in one study, over all its places.

    Attributes:
        row: number of its row in the study.
        name: engine, formulation, setting and step, for a person.
        motion, forces: largest error of a coordinate, and of a reaction, relative to its size; None: not reported.
        cost: wall seconds per simulated second at the slowest place; None: not measured.
        clean: True if clean runs measured the cost.
        blame: verdict of a place without a result; None: every place has one.
        motion_limit, forces_limit: result of its ladder of steps for either.
        href: HTML id of the evidence of the place with the largest error.
        message: reason why a place has no result.
    """

    row: int
    name: str
    motion: float | None
    forces: float | None
    cost: float | None
    clean: bool
    blame: Verdict | None
    motion_limit: LimitResult
    forces_limit: LimitResult
    href: str
    message: str

    def error(self, forces: bool) -> float | None:
        """Error that a tolerance bounds, of motion or of both; None: something is not reported."""
        if not forces:
            return self.motion
        return None if self.motion is None or self.forces is None else max(self.motion, self.forces)

    def limit(self, forces: bool) -> LimitResult:
        """Result of its ladder of steps, for motion or the worse of both."""
        both = (self.motion_limit, self.forces_limit) if forces else (self.motion_limit,)
        return max(both, key=_LIMITS.index)


def candidates(lines: Sequence[TableLine], href: str, places: Sequence[str]) -> list[Candidate]:
    """Candidates of one row of a study, its own step first.

    ``href``: HTML id of the study's evidence; ``places``: places with evidence of their own, in the order of their ids.
    """
    needed = list(dict.fromkeys(line.place for line in lines))
    own = lines[0].step
    limits = _limit(lines, "motion"), _limit(lines, "reaction")
    anchors = {"": href} | {place: f"{href}-r{lines[0].row}-p{number}" for number, place in enumerate(places)}
    steps = []
    for value in dict.fromkeys(line.step for line in lines):
        at = {place: [line for line in lines if line.step == value and line.place == place] for place in needed}
        steps.append(_candidate(lines[0], value, at, limits=limits, anchors=anchors))
    return sorted(steps, key=lambda item: item.name != _name(lines[0], own))


def _candidate(
    first: TableLine,
    value: float | None,
    at: dict[str, list[TableLine]],
    *,
    limits: tuple[LimitResult, LimitResult],
    anchors: dict[str, str],
) -> Candidate:
    """Candidate for one step of a row; ``anchors``: HTML ids of the evidence by place (the study's: empty place)."""
    name, href = _name(first, value), anchors.get("", "")
    judged = {
        place: [line for line in lines if line.verdict not in {Verdict.ILL_POSED, Verdict.NOT_JUDGED}]
        for place, lines in at.items()
    }
    judged = {place: lines for place, lines in judged.items() if lines or not at[place]}
    costs = [lines[0].cost for lines in at.values() if lines]
    cost = None if None in costs else max((item for item in costs if item is not None), default=None)
    clean = all(lines[0].clean for lines in at.values() if lines)
    errors = {place: (largest(lines, "motion"), largest(lines, "reaction")) for place, lines in judged.items()}
    blame, message = _blame(judged)
    if judged:
        furthest = max(errors, key=lambda place: max(errors[place][0] or 0.0, errors[place][1] or 0.0))
        href = anchors.get(furthest, href)
    motion, forces = (_worst([pair[which] for pair in errors.values()]) for which in (0, 1))
    return Candidate(first.row, name, motion, forces, cost, clean, blame, *limits, href, message)


def _blame(judged: dict[str, list[TableLine]]) -> tuple[Verdict | None, str]:
    """Verdict and message of the first place without a result; None and empty if every place has one."""
    if not judged:
        return Verdict.NOT_JUDGED, "no engine can be judged here"
    for place, lines in judged.items():
        if not lines:
            return Verdict.FAILED, f"no run with this step at {place}"
        if lines[0].status != "done":
            verdict = {str(item): item for item in Verdict}.get(lines[0].verdict, Verdict.FAILED)
            return verdict, lines[0].message
    return None, ""


def largest(lines: Sequence[TableLine], role: str) -> float | None:
    """Largest relative error of the quantities of a role that summaries show."""
    return max((line.relative for line in _shown(lines, role)), default=None)


def _shown(lines: Sequence[TableLine], role: str) -> list[TableLine]:
    """Lines of a role's quantities that have a scale: those that summaries show, or else all."""
    of_role = [line for line in lines if line.role == role and line.scale]
    return [line for line in of_role if line.headline] or of_role


def _limit(lines: Sequence[TableLine], role: str) -> LimitResult:
    """Worst result of a row's ladder of steps for a role."""
    results = [item for line in _shown(lines, role) for item in _LIMITS if line.limit == item]
    return max(results, key=_LIMITS.index, default=LimitResult.NO_LADDER)


def _worst(errors: Sequence[float | None]) -> float | None:
    known = [item for item in errors if item is not None]
    return max(known) if known and len(known) == len(errors) else None


def _name(line: TableLine, value: float | None) -> str:
    words = " ".join(filter(None, (line.engine, line.formulation, line.setting)))
    size = step(line.resolution or None, value)
    return f"{words} at {size}" if size else words
