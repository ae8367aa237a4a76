"""The verdict: an observable of one run compared with the truth, within the error bars of both."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from proofroll.core.arrays import FloatArray, Vectors, largest_difference
from proofroll.core.convergence import Limit
from proofroll.core.engine import EPSILON
from proofroll.core.number_format import counted, number, spaced

# A ladder whose rungs differ by less than this part of the tolerance needs no order: even if the differences never
# shrank, twenty further halvings (a step a million times smaller) would move the curve by the tolerance at most.
_FLAT = 1 / 20
# A limit is within tolerance if it stays so with an error bar this many times as large.
_SEVERAL = 3
# A limit is proven wrong if it misses the truth by this many of its error bars. Measured: up to 8 for engines that
# solve the scene's equations, where the motion ends abruptly; up to 20,000 for softened contacts.
_SHOWN_WRONG = 10
# A larger ratio of the error off the grid to that at the samples means an error hidden between samples; then the limit
# of small steps, which is known at the samples only, does not count.
_BETWEEN = 10
# Round-off of a curve, relative to its size: a thousand operations, each off by one machine epsilon.
_ROUNDINGS = 1e3


class Verdict(StrEnum):
    """Result of comparing a run with the truth, from best to worst."""

    AGREES = "agrees"  # within tolerance at this step, and the ladder of steps, if there is one, confirms it
    UNCONFIRMED = "unconfirmed"  # within tolerance at this step, but the ladder does not confirm the limit
    INCOMPLETE = "incomplete"  # all reported observables agree, but some that should be judged are not reported
    CONVERGES = "converges"  # beyond tolerance at this step, but the limit of small steps is within it
    ILL_POSED = "ill-posed"  # the motion depends on less than the accuracy of the parameters: no run can be judged
    NOT_JUDGED = "not-judged"  # there is no truth, or its own error bar exceeds the tolerance: no run can be judged
    ANOTHER_SCENE = "another-scene"  # the engine's model is of a different kind; it is shown and not judged
    REFUSED = "refused"  # the engine declares that it cannot represent this scene with these settings; no failure
    DIFFERS = "differs"  # beyond tolerance at this step, and the limit is not within; see LimitResult
    FAILED = "failed"  # there is no result


SEVERITY = list(Verdict)  # from the best to the worst


class LimitResult(StrEnum):
    """Result of a ladder of steps for the limit of small steps."""

    NO_LADDER = "no ladder"  # only one step was run
    WITHIN = "within tolerance"  # the limit is within tolerance of the truth, and so is its error bar
    ANOTHER = "another limit"  # the limit is beyond the tolerance by more than its error bar
    NOT_SHOWN = "no limit shown"  # the runs do not settle, or too slowly to tell


@dataclass(frozen=True, repr=False)
class Judgement:
    """Verdict on one observable of one run.

    Attributes:
        observable, unit: the compared quantity and its unit.
        error: largest distance from the truth.
        truth_error_bar: of the truth, in the same unit.
        tolerance: largest error that counts as agreement.
        scale: size of the observable in this case.
        verdict: see :class:`Verdict`.
        order: observed order, or None.
        limit_error: distance of the limit of small steps from the truth, or None without a ladder.
        limit_error_bar: uncertainty of that distance.
        limit_doubt: the same with round-off, one step beside an event and chance in the order; a limit that is beyond a
            tolerance by more than this does not hold it.
        limit: result of the ladder of steps, see :class:`LimitResult`.
        reason: ground of the verdict, as a clause with numbers.
        remarks: further facts for a reader that do not change the verdict, one clause each.
        floor: clause about the error floor of single precision that ends the refinement; empty: there is none.
    """

    observable: str
    unit: str
    error: float
    truth_error_bar: float
    tolerance: float
    scale: float
    verdict: Verdict
    order: float | None = None
    limit_error: float | None = None
    limit_error_bar: float | None = None
    limit_doubt: float | None = None
    limit: LimitResult = LimitResult.NO_LADDER
    reason: str = ""
    remarks: tuple[str, ...] = ()
    floor: str = ""

    @property
    def of_allowed(self) -> float:
        """Error over what is allowed; infinite for an error where none is."""
        return self.error / self.tolerance if self.tolerance else math.inf if self.error else 0.0

    def __repr__(self) -> str:
        """One line: the observable, its verdict, and its error of what is allowed."""
        sizes = f"{number(self.error)} of {number(self.tolerance)}{spaced(self.unit)}"
        return f"{self.observable}: {self.verdict}, {sizes}{f' ({self.reason})' if self.reason else ''}"


@dataclass(frozen=True)
class Allowance:
    """Largest error of an observable that counts as agreement.

    Attributes:
        observable, unit: the compared quantity and its unit, that of all values.
        tolerance: largest error.
        scale: size of the observable in this case.
    """

    observable: str
    unit: str
    tolerance: float
    scale: float

    @property
    def shown_unit(self) -> str:
        """Unit for a text, with a space in front; empty for a ratio."""
        return spaced(self.unit)

    @property
    def items(self) -> str:
        """Name of the values in a text: times are those of events."""
        return "events" if self.unit == "s" else "values"


@dataclass(frozen=True)
class TrueCurve:
    """True values of an observable, from a ``source``; ``ill_posed``: why no run can answer the question, or empty."""

    values: FloatArray
    error_bar: float
    ill_posed: str = ""
    source: str = "truth"


@dataclass(frozen=True)
class RunCurve:
    """Values of an observable in one run.

    Attributes:
        values: at the samples.
        own_bar: uncertainty of the run's own value (an event between two of its samples); an error that this alone may
            explain is no difference.
        sampled_bar: largest part of ``own_bar`` that may excuse an error: the part that the sampling interval explains.
        bar_of: quantity with the error ``own_bar``, as a clause; empty: a time between two samples.
        between: values at a few times off the grid, and the true ones; None: there are none.
        magnitude: size of the numbers whose round-off enters, if above the curve's scale: of a gap, that of positions.
        precision: in which the run was computed, see :func:`proofroll.core.engine.precision_of`.
        vectors: of its components, which are compared by their lengths.
    """

    values: FloatArray
    own_bar: float = 0.0
    sampled_bar: float = np.inf
    bar_of: str = ""
    between: tuple[FloatArray, FloatArray] | None = None
    magnitude: float = 0.0
    precision: str = "double"
    vectors: Vectors = None


@dataclass(frozen=True)
class Refinement:
    """Runs of a row with smaller and smaller steps.

    Attributes:
        limit: of small steps, or None if there is none.
        ladder: True if several steps were run; without a limit they then confirm nothing.
        lost: the first of these steps that has no curve, and why, as a clause; empty if each has one.
        faster: True if the errors of these steps fall ever faster, see :func:`.falls_faster`: three steps do not tell
            then whether they pass the truth.
    """

    limit: Limit | None = None
    ladder: bool = False
    lost: str = ""
    faster: bool = False

    @property
    def unknown(self) -> LimitResult:
        """Result for a limit that is not known."""
        return LimitResult.NOT_SHOWN if self.ladder else LimitResult.NO_LADDER


def judge_curve(
    allowance: Allowance, run: RunCurve, true: TrueCurve, refinement: Refinement | None = None
) -> Judgement:
    """Compares a curve and its limit of small steps with the true curve. Every verdict on a curve is given here.

    Without a refinement one step alone was run.
    """
    refinement = refinement or Refinement()
    tolerance, limit = allowance.tolerance, refinement.limit
    on_grid = largest_difference(run.values, true.values, run.vectors)
    off_grid = 0.0 if run.between is None else largest_difference(*run.between, run.vectors)
    hidden = off_grid > max(tolerance, _BETWEEN * on_grid)
    rungs = _Ladder(refinement.unknown, lost=refinement.lost)
    if limit is not None:
        rungs = _read(limit, allowance, run, true, refinement.faster)
    if hidden:
        rungs = replace(rungs, finding=refinement.unknown)
    error = max(on_grid, off_grid)
    verdict = Verdict.ILL_POSED if true.ill_posed else _verdict(error, tolerance, rungs)
    own_bar = min(run.own_bar, run.sampled_bar)
    unknown = true.error_bar + (own_bar if error > tolerance else 0.0)
    placed = verdict in {Verdict.AGREES, Verdict.UNCONFIRMED, Verdict.DIFFERS}
    if true.error_bar > tolerance or (placed and abs(error - tolerance) <= unknown):
        verdict = Verdict.NOT_JUDGED
    remarks = []
    if rungs.wrong_within:
        remarks.append(f"within tolerance, but the limit of small steps is shown not to be the truth: {rungs.text}")
    if run.own_bar > tolerance and not run.bar_of and verdict in {Verdict.AGREES, Verdict.UNCONFIRMED}:
        remarks.append("within tolerance by luck: the run leaves its events open by more than the tolerance")
    reason = _reason(verdict, error, allowance, true, run, rungs)
    if hidden:
        reason += f"; at the samples alone {number(on_grid)}{allowance.shown_unit}, so the error is between them"
    return Judgement(
        **vars(allowance),
        error=error,
        truth_error_bar=true.error_bar,
        verdict=verdict,
        order=rungs.order,
        limit_error=rungs.error,
        limit_error_bar=rungs.bar,
        limit_doubt=rungs.doubt,
        limit=rungs.finding,
        reason=reason,
        remarks=tuple(remarks),
        floor=limit.floor if limit else "",
    )


def round_off_of(precision: str, size: float) -> float:
    """Round-off of a curve of this size."""
    return _ROUNDINGS * EPSILON[precision] * size


@dataclass(frozen=True)
class _Ladder:
    """Summary of a ladder of steps.

    Attributes:
        finding: result for the limit of small steps.
        error, bar, order: of the limit; None without one.
        doubt: the bar with round-off, with what one step beside an event does, and with chance; None without a limit.
        leaves: True if finer steps leave the tolerance, with or without an order.
        wrong_within: True if the limit is within tolerance, but proven not to be the truth.
        text: the numbers, for a person.
        lost: without a limit, the step that has no curve, and why.
    """

    finding: LimitResult
    error: float | None = None
    bar: float | None = None
    order: float | None = None
    doubt: float | None = None
    leaves: bool = False
    wrong_within: bool = False
    text: str = ""
    lost: str = ""


def _read(limit: Limit, allowance: Allowance, run: RunCurve, true: TrueCurve, faster: bool) -> _Ladder:
    """Summary of the ladder of a run with this limit of small steps; ``faster``: see :class:`Refinement`."""
    round_off = round_off_of(run.precision, max(allowance.scale, run.magnitude))
    tolerance, unit = allowance.tolerance, allowance.shown_unit
    error = largest_difference(limit.values, true.values, run.vectors)
    bar, order = limit.error_bar + true.error_bar, limit.order if np.isfinite(limit.order) else None
    settled = limit.shown or limit.error_bar <= _FLAT * tolerance
    far_inside = error + _SEVERAL * bar <= tolerance
    doubted = bar + limit.beside + limit.chance + round_off
    drifted = doubted - limit.error_bar + limit.error_bar / _FLAT  # if twenty further halvings each change as much
    finding, leaves = LimitResult.NOT_SHOWN, error - doubted > tolerance and not faster
    if far_inside or (settled and error <= tolerance and bar <= tolerance):
        finding = LimitResult.WITHIN
    elif leaves and not limit.saturated and (limit.shown or error - drifted > tolerance):
        finding = LimitResult.ANOTHER
    shown = limit.shown or limit.error_bar <= _SHOWN_WRONG * round_off
    beyond = _SHOWN_WRONG * (bar + round_off) + limit.beside + limit.chance
    wrong = shown and limit.regular and not (faster or limit.saturated)
    wrong = wrong and finding == LimitResult.WITHIN and error > beyond
    shown_order = (
        f"no order{' shows in single precision' if limit.rounded else ''}" if order is None else f"order {order:.3g}"
    )
    text = f"off by {number(error)} ± {number(bar, 1)}{unit}, {shown_order}"
    if not np.isfinite(error):
        text = _unlike(limit.values, true.values, allowance.items)
    elif limit.beside > bar:
        text += f"; one step beside an event contributes {number(limit.beside, 1)}{unit}"
    if limit.unsettled and finding == LimitResult.NOT_SHOWN:
        text = f"smaller steps do not settle {limit.unsettled}: {text}"
    if faster and finding == LimitResult.NOT_SHOWN:
        text += "; the errors of these steps fall ever faster, so a shorter step is needed: --engine NAME[dt=…]"
    if limit.floor:
        text += f"; {limit.floor}"
    if limit.saturated:
        text += "; two tolerances give the same run, so something else sets its steps, e.g. the samples"
    return _Ladder(
        finding=finding, error=error, bar=bar, order=order, doubt=doubted, leaves=leaves, wrong_within=wrong, text=text
    )


def _verdict(error: float, tolerance: float, rungs: _Ladder) -> Verdict:
    """Verdict if the truth is known well enough to give one."""
    if error <= tolerance and not rungs.leaves:
        confirmed = rungs.finding in {LimitResult.NO_LADDER, LimitResult.WITHIN}
        return Verdict.AGREES if confirmed else Verdict.UNCONFIRMED
    if rungs.finding == LimitResult.WITHIN and np.isfinite(error):
        return Verdict.CONVERGES
    return Verdict.DIFFERS


def _reason(
    verdict: Verdict, error: float, allowance: Allowance, true: TrueCurve, run: RunCurve, rungs: _Ladder
) -> str:
    """Reason of the verdict, as a clause with numbers."""
    own_bar = min(run.own_bar, run.sampled_bar)
    truth_error_bar, tolerance, unit = true.error_bar, allowance.tolerance, allowance.shown_unit
    shown_error, allowed, bar = *_distinct_texts(error, tolerance), f"{number(truth_error_bar)}{unit}"
    if np.isinf(truth_error_bar):
        return f"not judged: the {true.source} does not determine it here"
    if truth_error_bar > tolerance:
        why = f"; ill-posed: {true.ill_posed.removeprefix('ill-posed: ')}" if true.ill_posed else ""
        return f"not judged: the {true.source}'s error bar {bar} exceeds the tolerance {allowed}{unit}{why}"
    if verdict == Verdict.NOT_JUDGED:
        whose = f"the {true.source}'s error bar"
        if own_bar > truth_error_bar:
            bar, whose = f"{number(own_bar)}{unit}", run.bar_of or "known only between two times"
        return f"not judged: error {shown_error}{unit} ± {bar}, {whose}, may be within {allowed}{unit} or beyond"
    text = f"error {shown_error}{unit} {'within' if error <= tolerance else 'beyond'} {allowed}{unit}"
    if not np.isfinite(error):
        text = _unlike(run.values, true.values, allowance.items)
    if rungs.finding == LimitResult.NO_LADDER:
        text += "; one step only, so the limit is unknown"
    elif not rungs.text:
        text += f"; no limit shown: {rungs.lost or 'not every step of the ladder gave this curve'}"
    else:
        text += f"; {'limit ' if rungs.finding == LimitResult.WITHIN else ''}{rungs.finding}: {rungs.text}"
    return f"the question is ill-posed here; {text}" if verdict == Verdict.ILL_POSED else text


def _unlike(values: FloatArray, true: FloatArray, items: str) -> str:
    """Clause on a curve without a finite distance from the truth; ``items``: name of its values."""
    if values.shape == true.shape:
        return "not finite"
    if len(values) == len(true):
        return f"the shape {values.shape}, the truth has {true.shape}"
    return f"{counted(len(values), items)}, the truth has {len(true)}"


def _distinct_texts(value: float, rival: float) -> tuple[str, str]:
    """Texts of two numbers with two digits, or as many as they need to differ."""
    texts = ((number(value, digits), number(rival, digits)) for digits in range(2, 18))
    return next((pair for pair in texts if value == rival or pair[0] != pair[1]), (repr(value), repr(rival)))
