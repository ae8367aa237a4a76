"""Causes of a motion unlike the scene's: hypotheses, each proven by what it leaves of the difference.

A kind of element brings its hypotheses (:class:`ExplainsRuns`). Each looks at a run, its truth and its certificate, and
says what the difference would be if the engine did one thing otherwise. It is named only where that closes the
difference; an unproven cause is not named.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.number_format import number

if TYPE_CHECKING:
    import xarray as xr

# A hypothesis has to leave no more than this part of a difference. One number that is fitted to a curve of many samples
# takes away the part of it that is alike by chance: to leave a twentieth, 99.75 % of the squares have to be alike.
CLOSES = 1 / 20
# A difference below this part of the quantity's size says nothing about causes: the truth's samples, between which a
# spline is laid, know themselves no better.
_LEAST = 1e-7
# A step that is coarse for a motion changes its equations as a number near the scene's does (Hairer, Lubich and Wanner
# 2006, chapter IX: modified equations): a fitted number that is no farther from the scene's, as a part of it or of what
# is natural for it, accuses nobody.
METHOD = 1e-2
# At time 0 both sides are exact numbers: what is left of a difference is round-off.
CLOSES_EXACTLY = 1e-6
_AS_GOOD = 3.0
_ALTERNATIVES = 2


@dataclass(frozen=True)
class Evidence:
    """Facts that a diagnosis explains: certificate, run and truth.

    Attributes:
        element: the simulated element of the scene.
        lines: of the certificate (:meth:`proofroll.core.certificate.Line.as_dict`).
        run, truth: the element's variables, at the same times; None: the engine was not run.
        step: of the engine [s], or None.
        settled: observables that were judged and found right: nothing about them is to be explained.
        by_step: whether the limit of small steps leaves no more of the difference than a cause may: the run moves by
            the scene's equations.
        found: results that hypotheses share, see :func:`proofroll.core.diagnosis.fitting.once`.
    """

    element: Any
    lines: Sequence[Mapping[str, Any]]
    run: xr.Dataset | None = None
    truth: xr.Dataset | None = None
    step: float | None = None
    settled: frozenset[str] = frozenset()
    by_step: bool = False
    found: dict[Any, Sequence[Any]] = field(default_factory=dict, init=False, repr=False, compare=False)


@dataclass(frozen=True)
class Cause:
    """A cause with its proof.

    Attributes:
        id: of the hypothesis.
        says: behaviour of the engine, as a clause.
        quantity, unit: of the difference that it closes.
        before, after: difference without and with the hypothesis, in ``unit``.
        remedy: place for an author to look at.
        fitted: number of free numbers that were fitted.
        covers: further quantities that it explains; no other cause is looked for.
        closes: largest part of the difference that it may leave.
        alternative: whether it explains what another cause explains as well: from outside the two look the same.
        explains: independent numbers of the difference that it closes; None: as many as there are samples.
        change: distance of its fitted numbers from the scene's, as a part of them or of a natural size; infinite: those
            of a known mistake.
    """

    id: str
    says: str
    quantity: str
    unit: str
    before: float
    after: float
    remedy: str
    fitted: int = 0
    covers: tuple[str, ...] = ()
    closes: float = CLOSES
    alternative: bool = False
    explains: int | None = None
    change: float = np.inf

    @property
    def accuses(self) -> bool:
        """True if a method's own error does not do it as well; what a method does proves nothing else, either."""
        return self.change > METHOD

    @property
    def proven(self) -> bool:
        """True if it closes the difference, of more independent numbers than it has free ones."""
        enough = self.explains is None or self.explains > self.fitted
        return bool(enough and self.before > 0 and np.isfinite(self.after) and self.after <= self.closes * self.before)

    @property
    def left(self) -> float:
        """Part of the difference that it leaves, as far as that says anything."""
        return max(self.after / self.before, _LEAST)

    @property
    def sentence(self) -> str:
        """Clause about the engine, with the proof."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        before, after = number(self.before), number(self.after, 1)
        return f"{self.says} ({self.quantity} off by {before}{unit}, by {after}{unit} with that)"


@dataclass(frozen=True)
class Hypothesis:
    """A cause that can be tested. A new one is one function (:func:`hypothesis`) in the element's tuple.

    Attributes:
        id: unique within the kind of element.
        grounds: its test, and the reason for which that proves it.
        test: gives causes worth looking at; those that do not close the difference are dropped by :func:`diagnose`.
    """

    id: str
    grounds: str
    test: Callable[[Evidence], Iterable[Cause]]

    def proven(self, evidence: Evidence) -> bool:
        """True if some cause of the hypothesis is proven."""
        return any(cause.proven for cause in self.test(evidence))


def hypothesis(name: str, grounds: str) -> Callable[[Callable[[Evidence], Iterable[Cause]]], Hypothesis]:
    """Makes a :class:`Hypothesis` of the function that tests it, with this name as its id."""
    return lambda test: Hypothesis(name, grounds, test)


@runtime_checkable
class ExplainsRuns(Protocol):
    """Ability of a kind of element (:class:`proofroll.core.element.ElementKind`): explains its runs."""

    @staticmethod
    def hypotheses() -> Sequence[Hypothesis]:
        """Its hypotheses; those that concern what an engine says come first."""


def diagnose(evidence: Evidence, hypotheses: Sequence[Hypothesis]) -> list[Cause]:
    """The proven causes, the best first: with the fewest fitted numbers, then with the smallest part left.

    Of those that explain the same quantity few more are kept, if they do so as well: as alternatives. A number that was
    fitted proves nothing where another fitted number does as well.
    """
    proven = [cause for item in hypotheses for cause in item.test(evidence) if cause.proven]
    proven.sort(key=lambda cause: (cause.fitted, cause.left))
    causes: list[Cause] = []
    for cause in proven:
        rivals = [other for other in causes if _share(cause, other)]
        if not rivals:
            causes.append(cause)
        elif all(_rivals(cause, rival) for rival in rivals) and len(rivals) <= _ALTERNATIVES:
            causes.append(dataclasses.replace(cause, alternative=True))
    known = [cause for cause in causes if cause.accuses and not any(_unsure(cause, other) for other in proven)]
    told = [cause for cause in known if not cause.alternative]
    # an alternative is one to a cause that is told
    return told + [cause for cause in known if cause.alternative and any(_share(cause, first) for first in told)]


def _share(one: Cause, other: Cause) -> bool:
    """True if two causes explain the same quantity."""
    return bool({one.quantity, *one.covers} & {other.quantity, *other.covers})


def _rivals(cause: Cause, first: Cause) -> bool:
    """True if a cause explains as much as the first one and as well, and is not only a part of it."""
    as_good = cause.fitted == first.fitted and cause.left <= _AS_GOOD * first.left
    whole = cause.quantity == first.quantity or first.quantity in cause.covers
    return as_good and whole and cause.id != first.id


def _unsure(cause: Cause, other: Cause) -> bool:
    """True if a fitted cause is one of several with equally good explanations."""
    return cause.fitted > 0 and _rivals(other, cause)


def hypotheses_of(element: Element) -> Sequence[Hypothesis]:
    """Hypotheses of the element's kind: the kind in whose package the element is defined."""
    from proofroll.core.plugins import load_element_kinds

    package = type(element).__module__.rpartition(".")[0]
    for kind in load_element_kinds():
        if kind.__module__.rpartition(".")[0] == package and isinstance(kind, ExplainsRuns):
            return kind.hypotheses()
    return ()


def above_round_off(difference: float, size: float) -> bool:
    """True if a difference is too large for round-off."""
    return bool(np.isfinite(difference) and difference > _LEAST * max(size, 1e-300))


def apart(one: FloatArray, other: FloatArray) -> float:
    """Largest difference; infinite where something is not finite in one of them alone."""
    difference = np.abs(np.asarray(one) - np.asarray(other))
    known = difference[~(np.isnan(one) & np.isnan(other))] if difference.size else difference
    largest = float(np.max(known, initial=0.0))
    return largest if np.isfinite(largest) else float("inf")
