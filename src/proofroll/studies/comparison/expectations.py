"""Compares the results of a comparison with its claims."""

from collections.abc import Collection

from proofroll.core.comparison import Comparison
from proofroll.core.number_format import number
from proofroll.core.verdict import SEVERITY, Judgement, Verdict
from proofroll.studies.comparison.outcome import worst
from proofroll.studies.comparison.planning import Planned, at_point

# Verdicts without a judgement; they contradict no claim and may be expected of every engine.
NOBODY = frozenset({Verdict.ILL_POSED, Verdict.NOT_JUDGED, Verdict.ANOTHER_SCENE})
# Verdict without the rest of the ladder -> verdicts that it may become with it.
_OPEN = {
    Verdict.UNCONFIRMED: {Verdict.AGREES, Verdict.UNCONFIRMED, Verdict.DIFFERS},
    Verdict.DIFFERS: {Verdict.CONVERGES, Verdict.DIFFERS},
}


def contradictions_of(
    comparison: Comparison,
    run: Planned,
    judgements: list[Judgement],
    missing: Collection[str],
    unfinished: bool = False,
) -> list[str]:
    """Contradictions of a claim by a run, as sentences.

    Args:
        comparison: the comparison.
        run: row at a point.
        judgements: of the row's observables.
        missing: observables that should be judged and that the run does not report.
        unfinished: True if a part of the ladder was left out for lack of time; then only contradictions count that the
            rest of the ladder cannot change.
    """
    place = f"{run.row.engine}{at_point(run.parameters)}"
    sentences = []
    row, expected = run.row, run.row.expected(run.parameters)

    def contradicts(verdict: Verdict, claim: Collection[Verdict]) -> bool:
        return not {*claim} & (_OPEN.get(verdict, {verdict}) if unfinished else {verdict})

    judged = [judgement for judgement in judgements if judgement.verdict not in NOBODY]
    overall = worst(judged, missing)
    # If some observables cannot be judged, the others contradict only by a worse verdict than expected.
    whole = len(judged) == len(judgements)
    worse = bool(judged) and SEVERITY.index(overall) > max(map(SEVERITY.index, expected))
    # Missing observables are reported below, name by name.
    if contradicts(overall, {*expected, Verdict.INCOMPLETE}) and (whole or worse):
        # The observables with the worst verdict.
        guilty = [judgement for judgement in judged if judgement.verdict == overall]
        guilty.sort(key=lambda item: item.of_allowed, reverse=True)
        causes = "; ".join(f"{item.observable} {item.verdict}" for item in guilty)
        causes = f"{causes}; {guilty[0].observable}: {guilty[0].reason}" if guilty else "nothing is judged"
        sentences.append(f"{place} {overall}, expected: {' or '.join(expected)} ({causes})")
    for judgement in judgements:
        name, verdict = judgement.observable, judgement.verdict
        alone = row.expect_for.get(name)
        if alone is not None and contradicts(verdict, {*alone, *NOBODY}):
            sentences.append(f"{place}: {name} {verdict}, expected: {' or '.join(alone)} ({judgement.reason})")
        if name in row.order and not unfinished:
            (low, high), order = row.order[name], judgement.order
            if order is None or not low <= order <= high:
                told = number(order, 3, "not known")
                sentences.append(f"{place}: order of {name} is {told}, expected {low:g} to {high:g}")
        if name in row.limit and not unfinished:
            allowed = row.limit[name].absolute(judgement.scale)
            if judgement.limit_error is None or judgement.limit_error > allowed:
                off = number(judgement.limit_error, 3, "not known")
                sentences.append(
                    f"{place}: error of the limit of {name} is {off}, expected at most {number(allowed, 3)}"
                )
    claimed = {*row.bound, *row.expect_for, *row.order, *row.limit}
    if Verdict.INCOMPLETE not in expected:
        claimed |= {*missing}
    for name in sorted(claimed - {judgement.observable for judgement in judgements}):
        sentences.append(f"{place}: {name} is not reported, though {comparison.name} makes a claim about it")
    return sentences
