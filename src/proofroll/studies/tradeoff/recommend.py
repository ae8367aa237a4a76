"""The cheapest engine, formulation and step that holds a tolerance, from measured points only."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from proofroll.core.engine_abilities import by_hand
from proofroll.core.errors import InputError
from proofroll.core.number_format import number
from proofroll.core.plugins import parse_engine
from proofroll.files.json_data import MERGED, OPTIONAL
from proofroll.studies.study_store import Measured
from proofroll.studies.tradeoff.pareto import costs_overlap
from proofroll.studies.tradeoff.records import MeasuredPoint, TradeoffStudy
from proofroll.studies.tradeoff.requirements import MARGIN, Requirements, absolute_tolerance, failure_reason

# Fields of a measured point that are written to JSON.
_OF_A_POINT = (
    "engine", "settings", "resolution", "step", "level", "seconds_per_second", "interval", "confidence", "measurements",
)  # fmt: skip
# Ratio of the largest error of the next finer steps to a point's own above which the text gives both.
_UNEVEN = 2.0
_CLOSEST = "the most accurate measured one; nothing is extrapolated"


@dataclass(frozen=True)
class Choice:
    """A measured point, its error of the quantity, and the reason why it is named."""

    point: MeasuredPoint
    error: float | None
    reason: str

    def as_dict(self) -> dict[str, Any]:
        """Point, error and reason for JSON."""
        fields_of_point = {name: getattr(self.point, name) for name in _OF_A_POINT}
        return fields_of_point | {
            "caveat": self.point.caveat,
            "family": self.point.family,
            "error": self.error,
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Answer:
    """Advice for a tolerance of a quantity.

    Attributes:
        quantity, unit: observable whose error matters, and its unit.
        tolerance: in that unit.
        margin: factor by which an error must be smaller.
        choice: the cheapest point that holds the tolerance with margin, and at every corner of the range.
        ties: other points that hold it, with costs whose intervals overlap the choice's.
        runner_up: the cheapest of another engine or formulation.
        first_failure: the most accurate of the cheaper points, which all fail.
        least_model: the cheapest solution of equations derived by hand for the scene.
        closest: the most accurate point if there is no choice; else None.
    """

    quantity: str
    unit: str
    tolerance: float
    margin: float
    choice: Choice | None
    ties: list[Choice]
    runner_up: Choice | None
    first_failure: Choice | None
    least_model: Choice | None
    closest: Choice | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class CheckedOver:
    """Range over which a choice was checked.

    Attributes:
        parameters: parameter -> lowest and highest value.
        corners: number of corners.
        until: length of the runs [s].
    """

    parameters: dict[str, list[float]]
    corners: int
    until: float


@dataclass(frozen=True)
class Recommendation:
    """An answer with its circumstances.

    Attributes:
        answer: the recommended engine and setting.
        scene, parameters: of the study.
        max_cost: allowed wall time per simulated second, or None.
        affordable: True if the choice costs no more.
        best_affordable: the most accurate point that costs no more if the choice does; else None.
        checked: range of parameters.
        measured: time, machine and versions.
        not_measured: engines that were not asked about.
        omitted: clauses on what the scene's file describes and the answer leaves out; None: nothing.
    """

    answer: Answer = field(metadata=MERGED)
    scene: str
    parameters: Mapping[str, float]
    max_cost: float | None
    affordable: bool
    best_affordable: Choice | None
    checked: CheckedOver
    measured: Measured
    not_measured: list[str] | None = field(default=None, metadata=OPTIONAL)
    omitted: list[str] | None = field(default=None, metadata=OPTIONAL)


def recommend(study: TradeoffStudy, required: Requirements) -> Recommendation:
    """The cheapest point that holds a tolerance, with alternatives and reasons.

    Raises:
        InputError: a quantity or an engine that was not measured, or a percentage of a quantity without a size.
    """
    absolute = absolute_tolerance(study, required)
    timed = [p for p in study.points if p.seconds_per_second is not None and required.quantity in p.envelope]
    timed.sort(key=lambda p: p.cost)
    _require_measured(study, required)

    def why_not(point: MeasuredPoint) -> str | None:
        return failure_reason(study, point, required, absolute)

    def chosen(point: MeasuredPoint | None, reason: str = "") -> Choice | None:
        if point is None:
            return None
        return Choice(point, point.error.get(required.quantity), reason or _holds(study, point, required, absolute))

    def best(points: Iterable[MeasuredPoint]) -> MeasuredPoint | None:
        return min(points, key=lambda p: p.envelope_of(required.quantity), default=None)

    asked = [p for p in timed if _asked(p, required)]
    choice = next((p for p in asked if why_not(p) is None), None)
    affordable = choice is not None and (required.max_cost is None or choice.cost <= required.max_cost)
    others = [p for p in asked if choice is not None and p.id != choice.id and why_not(p) is None]
    failing, closest = (best(asked[: asked.index(choice)]), None) if choice else (None, best(asked))
    hand = next((p for p in timed if by_hand(p.level) and why_not(p) is None), None)
    answer = Answer(
        quantity=required.quantity,
        unit=study.quantities[required.quantity].unit,
        tolerance=absolute,
        margin=MARGIN,
        choice=chosen(choice),
        ties=[tie for p in others if choice and costs_overlap(p.interval, choice.interval) and (tie := chosen(p))],
        runner_up=chosen(next((p for p in others if choice and _model(p) != _model(choice)), None)),
        first_failure=chosen(failing, why_not(failing) or "") if failing is not None else None,
        least_model=None if hand is not None and choice is not None and hand.id == choice.id else chosen(hand),
        closest=chosen(closest, f"{why_not(closest)}; {_CLOSEST}") if closest is not None else None,
    )
    within = [p for p in asked if required.max_cost is not None and p.cost <= required.max_cost]
    return Recommendation(
        answer=answer,
        scene=study.scene,
        parameters=study.parameters,
        max_cost=required.max_cost,
        affordable=affordable,
        best_affordable=None if affordable else chosen(best(within), "the most accurate that costs no more"),
        checked=CheckedOver(
            {name: [min(values), max(values)] for name, values in study.over.items()},
            max((len(p.corners) for p in study.points if p.corners is not None), default=0),
            study.until,
        ),
        measured=study.measured,
    )


def holding(study: TradeoffStudy, required: Requirements, *, here: bool = False) -> list[MeasuredPoint]:
    """All allowed points that hold the tolerance with margin, the cheapest first, untimed ones last.

    With ``here`` only the scene's own parameters matter, not the corners of the range.
    """
    absolute = absolute_tolerance(study, required)
    within = replace(study, over={}) if here else study
    points = [p for p in study.points if _asked(p, required) and failure_reason(within, p, required, absolute) is None]
    return sorted(points, key=lambda p: p.cost)


def _require_measured(study: TradeoffStudy, required: Requirements) -> None:
    measured = list(dict.fromkeys(point.engine for point in study.points))
    for text in required.engines:
        if parse_engine(text).name not in measured:
            absent = study.absent.get(parse_engine(text).name)
            raise InputError("engine", text, absent or f"measured are {', '.join(measured)}")


def _asked(point: MeasuredPoint, required: Requirements) -> bool:
    if required.levels and point.level not in required.levels:
        return False
    if not required.engines:
        return not by_hand(point.level) or bool(required.levels)
    return any(parse_engine(text).means(point.engine, point.settings) for text in required.engines)


def covers(measured: Sequence[str], asked: Sequence[str]) -> bool:
    """True if a study of the engines ``measured`` has all of ``asked``; an empty list means all engines."""
    if not measured or not asked:
        return not measured
    whole = {spec.name for spec in map(parse_engine, measured) if not spec.options}
    return all(text in measured or parse_engine(text).name in whole for text in asked)


def _holds(study: TradeoffStudy, point: MeasuredPoint, required: Requirements, absolute: float) -> str:
    """Text on the margin with which a point holds the tolerance."""
    envelope, bar = point.envelope_of(required.quantity), study.quantities[required.quantity].truth_error_bar or 0.0
    if not max(envelope, bar):
        return "no error is seen"
    # An error below the truth's error bar is known only to be below it.
    text = f"{_times(absolute / max(envelope, bar), at_least=envelope < bar)} better than asked"
    if envelope > _UNEVEN * (point.error.get(required.quantity) or 0.0) and envelope > bar:
        unit = study.quantities[required.quantity].unit
        text = f"up to {number(envelope)} {unit} at the next finer steps, {text}"
    if point.corners:
        worst = max(corner.off(required.tolerance.relative)[required.quantity] for corner in point.corners)
        there = required.tolerance.value if required.tolerance.relative else absolute
        text += f", and {_times(there / worst)} at the worst of {len(point.corners)} corners" if worst else ""
    return text


def _times(ratio: float, *, at_least: bool = False) -> str:
    if ratio >= 1000:
        return "more than 1000 times"
    return f"{'at least ' if at_least else ''}{ratio:.3g} times"


def _model(point: MeasuredPoint) -> tuple[str, str | None]:
    """Engine and formulation of a point."""
    return point.engine, point.settings.get("formulation")
