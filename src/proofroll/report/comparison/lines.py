"""Lines of the long table for the runs of a comparison and of its ladders of steps."""

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

from proofroll.core.engine_abilities import by_hand
from proofroll.core.verdict import Judgement, Verdict
from proofroll.report.comparison.records import clean_cost, rough_cost
from proofroll.report.comparison.summary import facts_of
from proofroll.report.kinds import group_of
from proofroll.report.long_table import COLUMNS, TableLine, case_words, setting_columns
from proofroll.running.case import Result, Status
from proofroll.studies.comparison.outcome import LadderRun, Outcome, Run
from proofroll.studies.comparison.planning import point_name

# Columns that are fields of a judgement.
_OF_JUDGEMENTS = [item.name for item in fields(Judgement) if item.name in COLUMNS]
# Fields of a line about a ladder of steps, which only the step at which a comparison judges has.
_NO_LIMIT: dict[str, Any] = dict.fromkeys(("order", "limit_error", "limit_error_bar", "limit_doubt"))
_NO_LIMIT |= {"limit": "", "floor": ""}


def lines_of(outcome: Outcome) -> list[TableLine]:
    """Lines for each judgement, and for each error of a rung of a ladder, which has no verdict."""
    lines: list[TableLine] = []
    for number, run in ((number, run) for number, runs in enumerate(outcome.rows) for run in runs):
        plain = _plain(outcome, run, number)
        lines += [_judged(outcome, run, plain, item) for item in run.judgements] or [plain]
        for rung in run.rungs:
            lines += _of_rung(outcome, run, plain, rung)
    return lines


def _plain(outcome: Outcome, run: Run, row: int) -> TableLine:
    """Fields shared by all lines of a run."""
    comparison, facts = outcome.comparison, facts_of(run)
    point = outcome.points.get(point_name(run.parameters))
    scene = outcome.scene if point is None else point.scene
    return TableLine(
        study=comparison.name,
        group=group_of(scene),
        scene=comparison.scene,
        place=point_name(run.parameters),
        case=case_words(scene.parameters),
        own_case=dict(scene.parameters) == dict(outcome.scene.parameters),
        until=comparison.until,
        row=row,
        version=facts.version,
        own_equations=bool(run.shared) or by_hand(facts.level) or facts.witness,
        verdict=run.verdict,
        **setting_columns(facts.name, run.row.engine, facts),
        **_ended(outcome, run.result),
    )


def _ended(outcome: Outcome, result: Result) -> dict[str, Any]:
    """Status and cost of a run; without clean runs the rough cost of the sampled run."""
    cost, done = clean_cost(result), result.status == Status.DONE
    return {
        "status": result.status,
        "message": "" if done else result.message,
        "cost": cost.value if cost else rough_cost(result, outcome.comparison.until),
        "cost_low": cost.low if cost and cost.confidence else None,
        "cost_high": cost.high if cost and cost.confidence else None,
        "clean": cost is not None,
    }


def _judged(outcome: Outcome, run: Run, plain: TableLine, item: Judgement) -> TableLine:
    scene = outcome.points[point_name(run.parameters)].scene
    observable = scene.observables[item.observable]
    columns = {name: getattr(item, name) for name in _OF_JUDGEMENTS}
    return replace(plain, **columns, quantity=item.observable, role=observable.role, headline=observable.headline)


def _of_rung(outcome: Outcome, run: Run, plain: TableLine, rung: LadderRun) -> Iterator[TableLine]:
    """Lines of a rung; its errors keep the verdicts ill-posed and not-judged of the run, and no other."""
    ended = replace(plain, step=rung.value, verdict="", **_ended(outcome, rung.result))
    judged = [item for item in run.judgements if item.observable in rung.errors]
    for item in judged:
        verdict = item.verdict if item.verdict in {Verdict.ILL_POSED, Verdict.NOT_JUDGED} else ""
        line = _judged(outcome, run, ended, item)
        yield replace(line, verdict=verdict, error=rung.errors[item.observable], **_NO_LIMIT)
    if not judged:
        yield ended
