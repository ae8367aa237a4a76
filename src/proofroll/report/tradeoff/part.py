"""Trade-off of speed against accuracy in one scene as a part of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from typing_extensions import override

from proofroll.core.convergence import floor_text
from proofroll.core.engine_abilities import by_hand
from proofroll.core.number_format import counted
from proofroll.core.verdict import LimitResult
from proofroll.files.scene_file import load_scene
from proofroll.report.kinds import group_of
from proofroll.report.long_table import TableLine, case_words, setting_columns
from proofroll.report.parts import Part, PartEntry, Tell, claims_sentence
from proofroll.report.tradeoff import tables as tradeoff_tables
from proofroll.report.tradeoff.tables import default_quantities
from proofroll.running.case import Status
from proofroll.running.runner import Runner
from proofroll.studies.claim_judgement import ClaimJudgement
from proofroll.studies.comparison.planning import point_name
from proofroll.studies.study_store import valid_study
from proofroll.studies.tradeoff.claims import STUDY, TradeoffClaims, load_claims
from proofroll.studies.tradeoff.records import CurveBudget, TradeoffStudy
from proofroll.studies.tradeoff.study import make_tradeoff
from proofroll.studies.tradeoff.tradeoff import Extent, study_path

# A limit of small steps counts as another than the truth if it is off by so many error bars, as for a verdict.
_SHOWN = 10


@dataclass(frozen=True, kw_only=True)
class TradeoffEntry(PartEntry):
    """Entry of a study: quantities to show, and judged claims."""

    shown: list[str]
    claims: list[ClaimJudgement]


@dataclass
class TradeoffPart(Part):
    """Trade-off of speed against accuracy in one scene."""

    kind: ClassVar[str] = STUDY
    key: ClassVar[str] = "tradeoffs"
    order: ClassVar[float] = 30
    words: ClassVar[str] = "speed against accuracy"
    command: ClassVar[str] = "tradeoff {.scene}"
    template: ClassVar[str] = "tradeoff.html"
    names: ClassVar[Mapping[str, Any]] = {"tradeoffs": tradeoff_tables}
    asked: TradeoffClaims
    engines: Sequence[str] = ()
    study: TradeoffStudy | None = None

    @classmethod
    @override
    def load(cls, path: Path, engines: Sequence[str]) -> TradeoffPart:
        return cls(load_claims(path), tuple(engines))

    @staticmethod
    def line(entry: TradeoffEntry) -> str:
        """Count of points, and of the claims that hold."""
        return f"{counted(len(entry.study.points), 'points')}{claims_sentence(entry.claims)}"

    def keeps(self, out: Path) -> bool:
        """True if a study is stored; the full one is preferred to a brief one."""
        paths = (study_path(out, self.asked.swept, self.engines, brief=brief) for brief in (False, True))
        self.study = next((study for path in paths if (study := valid_study(path, TradeoffStudy)[0]) is not None), None)
        return self.study is not None

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """Makes a brief study, without runs over ranges of parameters."""
        self.study, _ = make_tradeoff(
            self.asked.swept,
            runner,
            out,
            Extent(self.engines, brief=True),
            self.asked,
            progress=lambda text, _: tell(text, 1),
        )

    @override
    def entry(self) -> TradeoffEntry:
        study = self.study
        assert study is not None  # it was made
        return TradeoffEntry(
            **self.head,
            study=study,
            shown=default_quantities(study),
            claims=[] if self.engines else self.asked.judgements(study),
            contradictions=[] if self.engines else self.asked.contradictions(study),
        )

    def lines(self) -> list[TableLine]:
        """Lines of each error of each point, without verdicts: a reader's tolerance judges them."""
        study = self.study
        assert study is not None  # it was made
        scene = self.asked.swept.loaded
        group, place = group_of(scene), point_name(study.parameters)
        case = case_words(scene.parameters)
        is_own = case == case_words(load_scene(study.scene).parameters)
        units = {name: item.unit for name, item in scene.observables.items()}
        limits = {(item.curve, item.quantity): _limit(item, units[item.quantity]) for item in study.budgets}
        lines = []
        rows = {curve: row for row, curve in enumerate(dict.fromkeys(point.curve for point in study.points))}
        for point in study.points:
            low, high = point.interval or (None, None)
            run: dict[str, Any] = {
                "study": self.asked.name, "group": group, "scene": study.scene, "place": place,
                "case": case, "own_case": is_own, "until": study.until,
                "row": rows[point.curve], "version": study.measured.versions.get(point.engine, ""),
                "own_equations": by_hand(point.level), "status": point.status,
                "message": "" if point.status == Status.DONE else point.message, "verdict": "",
                "cost": point.seconds_per_second, "cost_low": low, "cost_high": high, "clean": True,
            } | setting_columns(point.engine, point.curve, point)  # fmt: skip
            lines += [
                TableLine(
                    **run,
                    quantity=name,
                    unit=study.quantities[name].unit,
                    role=scene.observables[name].role,
                    headline=scene.observables[name].headline,
                    **limits.get((point.curve, name), {}),
                    error=error,
                    truth_error_bar=study.quantities[name].truth_error_bar,
                    scale=study.quantities[name].scale,
                )
                for name, error in point.error.items()
                if name in study.quantities
            ] or [TableLine(**run)]
        return lines


def _limit(budget: CurveBudget, unit: str) -> dict[str, Any]:
    """Fields about a curve's limit of small steps: not shown, beyond both error bars of the truth, or within."""
    columns: dict[str, Any] = {"limit": LimitResult.NOT_SHOWN}
    if budget.best_step is not None and budget.floor is not None:
        columns["floor"] = floor_text(budget.best_step, budget.floor, unit)
    if budget.model_form is None:
        return columns
    limit = LimitResult.ANOTHER if budget.model_form > _SHOWN * budget.doubt else LimitResult.WITHIN
    return columns | {"limit": limit, "limit_error": budget.model_form, "limit_doubt": budget.doubt}
