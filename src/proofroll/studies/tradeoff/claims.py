"""Files with a question and claims for a trade-off, ``study = "tradeoff"``, and the judgement of these claims.

Steps and orders are judged exactly, cost by ratios. A claim about cost stays undecided if the measurements do not
decide it, since a slow or busy machine must not contradict a claim.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from proofroll.core.bounds import require_bounds, require_pair
from proofroll.core.comparison import Tolerance
from proofroll.core.engine_abilities import Level
from proofroll.core.errors import InputError, error_location
from proofroll.core.plugins import parse_engine
from proofroll.core.validation import strict, validated
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import study_content, study_files
from proofroll.running.timing import FACTOR, Timing, interval_text, ratio
from proofroll.studies.claim_judgement import ClaimJudgement
from proofroll.studies.tradeoff.curve import Question
from proofroll.studies.tradeoff.records import MeasuredPoint, TradeoffStudy
from proofroll.studies.tradeoff.requirements import Requirements, holding


@dataclass(frozen=True)
class Holds:
    """Claim on the coarsest step that holds a tolerance with margin, at the scene's own parameters; nothing is timed.

    Attributes:
        engine: whose curves, ``name[key=value,…]``.
        tolerance: of the quantity.
        step: the coarsest of the sweep that holds it [s], or the loosest tolerance.
        because: why.
    """

    engine: str
    tolerance: Tolerance
    step: float
    because: str

    def judgement(self, study: TradeoffStudy, quantity: str) -> ClaimJudgement:
        """Judgement of the claim; exact in a brief study, too."""
        claim = f"{self.engine} holds {_to(quantity, self.tolerance)} up to a step of {self.step:g}"
        if unknown := _unknown(study, [self.engine]):
            return ClaimJudgement(claim, self.because, None, unknown)
        points = holding(study, Requirements(quantity, self.tolerance, engines=(self.engine,)), here=True)
        steps = [point.step for point in points if point.step is not None]
        if not steps:
            return ClaimJudgement(claim, self.because, *_not_shown(study, [self.engine], "no step of the sweep does"))
        shown = f"the coarsest that does is {max(steps):g}"
        return ClaimJudgement(claim, self.because, math.isclose(max(steps), self.step), shown)


@dataclass(frozen=True)
class Converges:
    """Claim on the order of convergence; nothing is timed.

    Attributes:
        engine: whose curves, ``name[key=value,…]``.
        order: lowest and highest.
        because: why.
    """

    engine: str
    order: tuple[float, float]
    because: str

    def judgement(self, study: TradeoffStudy, quantity: str) -> ClaimJudgement:
        """Judgement of the claim; exact in a brief study, too."""
        lowest, highest = self.order
        claim = f"{self.engine} converges in {quantity} with order {lowest:g} to {highest:g}"
        if unknown := _unknown(study, [self.engine]):
            return ClaimJudgement(claim, self.because, None, unknown)
        curves = {point.curve for point in _of(study.points, [self.engine])}
        budgets = [b for b in study.budgets if b.curve in curves and b.quantity == quantity]
        orders = [(b.order_low or b.order, b.order_high or b.order) for b in budgets if b.order]
        if not orders:
            return ClaimJudgement(claim, self.because, *_not_shown(study, [self.engine], "no order shows"))
        shown = "what shows is " + ", ".join(f"{low:.3g} to {high:.3g}" for low, high in orders)
        holds = all(low <= highest and high >= lowest for low, high in orders)
        return ClaimJudgement(claim, self.because, holds, shown)


@dataclass(frozen=True)
class Cheapest:
    """Claim on the cheapest engine at a tolerance.

    Attributes:
        tolerance: of the quantity.
        engine: any of these, ``name[key=value,…]``.
        because: reason.
        levels: rungs of the ladder that are compared; if empty, all but equations derived by hand for the scene.
    """

    tolerance: Tolerance
    engine: list[str]
    because: str
    levels: list[Level] = field(default_factory=list)

    def judgement(self, study: TradeoffStudy, quantity: str) -> ClaimJudgement:
        """Judgement by the ratio of its cost to that of the cheapest rival that holds the tolerance.

        It holds if the whole interval of the ratio is at most 1. It is contradicted if the interval lies above
        :data:`proofroll.running.timing.FACTOR` and the study is not brief, or if no step of the engine holds the
        tolerance.
        """
        among = f" among {', '.join(self.levels)}" if self.levels else ""
        claim = f"the cheapest that holds {_to(quantity, self.tolerance)}{among} is {' or '.join(self.engine)}"
        required = Requirements(quantity, self.tolerance, levels=tuple(self.levels))
        return ClaimJudgement(claim, self.because, *self._compared(study, required))

    def _compared(self, study: TradeoffStudy, required: Requirements) -> tuple[bool | None, str]:
        if unknown := _unknown(study, self.engine):
            return None, unknown
        within = holding(study, required)
        mine = _of(within, self.engine)
        others = [point for point in within if point not in mine]
        if not mine:
            return _not_shown(study, self.engine, "no step of it holds that")
        if not others:
            return True, "nothing else holds that"
        best, rival = mine[0], others[0]
        if not best.rounds or len(best.rounds) != len(rival.rounds):
            return None, f"{_name(best)} and {_name(rival)} were not timed in the same rounds"
        cost = ratio(Timing(tuple(best.rounds)), Timing(tuple(rival.rounds)))
        measured = (
            f"{_name(best)} takes {cost.value:.3g} times as long as {_name(rival)} "
            f"({cost.low:.3g} to {cost.high:.3g}, {interval_text(cost.confidence)})"
        )
        if cost.high <= 1:
            return True, measured
        contradicted = cost.low > FACTOR and cost.known and not study.brief
        return (False if contradicted else None), measured


def _to(quantity: str, tolerance: Tolerance) -> str:
    return f"{quantity} to {tolerance.value:g} {tolerance.unit}"


def _name(point: MeasuredPoint) -> str:
    step = "" if point.step is None else f" at {point.step:g}"
    return f"{point.engine} {point.settings.get('formulation', '')}{step}"


def _of(points: Sequence[MeasuredPoint], engines: Sequence[str]) -> list[MeasuredPoint]:
    """Points of engines with settings, each ``name[key=value,…]``."""
    specs = [parse_engine(text) for text in engines]
    return [point for point in points if any(spec.means(point.engine, point.settings) for spec in specs)]


def _unknown(study: TradeoffStudy, engines: Sequence[str]) -> str:
    """Reason why the study cannot judge some engines; empty if it can."""
    about = _of(study.points, engines)
    if not about:
        return "it was not measured"
    late = next((point for point in about if point.status == "timeout"), None)
    return f"a run of it met the limit of time: {late.message}" if late else ""


def _not_shown(study: TradeoffStudy, engines: Sequence[str], words: str) -> tuple[bool | None, str]:
    """Judgement of what no point shows: undecided with the reason if a brief study left steps of the engines out."""
    curves = {point.curve for point in _of(study.points, engines)}
    left_out = next((item.reason for item in study.dropped if study.brief and item.engine in curves), None)
    return (False, words) if left_out is None else (None, left_out)


STUDY = "tradeoff"


@dataclass(frozen=True)
class TradeoffClaims:
    """Question and claims of a trade-off's file.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene, parameters, until, quantity: question of the sweep.
        over: parameter -> values; the range over which the best points are checked.
        holds, converges, cheapest: the claims; the first two are judged exactly.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    quantity: str
    parameters: dict[str, float] = field(default_factory=dict)
    over: dict[str, list[float]] = field(default_factory=dict)
    cheapest: list[Cheapest] = field(default_factory=list)
    holds: list[Holds] = field(default_factory=list)
    converges: list[Converges] = field(default_factory=list)

    @cached_property
    def swept(self) -> Question:
        """Question that is swept."""
        return Question(self.scene, self.parameters, self.until, self.quantity)

    def judgements(self, study: TradeoffStudy) -> list[ClaimJudgement]:
        """Judgement of each claim by a study."""
        claims: list[Holds | Converges | Cheapest] = [*self.holds, *self.converges, *self.cheapest]
        return [claim.judgement(study, self.quantity) for claim in claims]

    def contradictions(self, study: TradeoffStudy) -> list[str]:
        """Contradicted claims, as sentences."""
        return self._sentences(study, False, "contradicted")

    def undecided(self, study: TradeoffStudy) -> list[str]:
        """Undecided claims, as sentences."""
        return self._sentences(study, None, "undecided")

    def _sentences(self, study: TradeoffStudy, verdict: bool | None, word: str) -> list[str]:
        judged = (item for item in self.judgements(study) if item.holds is verdict)
        return [f"{self.name}, {word}: {item.claim}; {item.found}" for item in judged]


def claims_for(scene: str) -> TradeoffClaims | None:
    """Claims of the file about a scene, or None if there is no such file."""
    files = (_claims(path, content) for path, content in study_files(STUDY) if content.get("scene") == scene)
    return next(files, None)


def load_claims(path: str | Path) -> TradeoffClaims:
    """Reads a file of claims. Raises InputError if it is broken, or is for another study."""
    return _claims(Path(path), study_content(Path(path), STUDY))


def _claims(path: Path, content: dict[str, Any]) -> TradeoffClaims:
    place = path.name
    for kind in ("cheapest", "holds"):
        raw = content.get(kind, [])
        for index, claim in enumerate(raw if isinstance(raw, list) else []):
            if isinstance(claim, dict):
                claim["tolerance"] = Tolerance.parse(f"{place}: {kind}.{index}.tolerance", claim.get("tolerance"))
                if kind == "cheapest" and isinstance(claim.get("engine"), str):
                    claim["engine"] = [claim["engine"]]
    claims = validated(TradeoffClaims, content, place, name=path.stem)
    with error_location(place):
        _check(place, claims)
    return claims


def _check(place: str, file: TradeoffClaims) -> None:
    require_bounds("until", file.until, above=0)
    unit = file.swept.loaded.observable(file.quantity, f"{place}: quantity").unit
    if not (file.cheapest or file.holds or file.converges):
        advice = "the file claims nothing; add [[cheapest]] with tolerance, engine and because"
        raise InputError(f"{place}: cheapest", None, advice)
    for kind in ("cheapest", "holds", "converges"):
        for index, claim in enumerate(getattr(file, kind)):
            claim_place = f"{place}: {kind}.{index}"
            if not claim.because:
                raise InputError(f"{claim_place}.because", None, "every claim needs its reason; add it")
            for text in claim.engine if kind == "cheapest" else [claim.engine]:
                with error_location(claim_place):
                    parse_engine(text)
            if kind == "holds":
                require_bounds(f"{claim_place}.step", claim.step, above=0)
            if kind == "converges":
                require_pair(f"{claim_place}.order", claim.order)
            tolerance = getattr(claim, "tolerance", None)
            if tolerance is not None and not tolerance.relative and tolerance.unit != unit:
                raise InputError(f"{claim_place}.tolerance", tolerance.unit, f"its unit is {unit}")
    for name, values in file.over.items():
        for value in values:
            load_scene(file.scene, **{**file.parameters, name: value})


strict(TradeoffClaims, Cheapest, Holds, Converges)
