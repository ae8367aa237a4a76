"""Causes of a motion unlike the scene's: hypotheses, each proven by the share of the difference that it explains.

A kind of element brings its hypotheses (:class:`ExplainsRuns`). Each looks at a run, its truth and its certificate, and
computes what the engine would report if it made one particular mistake. The cause is named only if that mistake closes
the difference.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, Protocol, runtime_checkable

import numpy as np
from typing_extensions import TypeVar

from proofroll.core.arrays import FloatArray
from proofroll.core.element import Element
from proofroll.core.errors import NotUnique
from proofroll.core.number_format import number, spaced

if TYPE_CHECKING:
    import xarray as xr

# A proven cause leaves at most this part of a difference. One number fitted to a curve of many samples always removes
# a part of it by chance; to leave a twentieth it has to explain 99.75 % of the sum of squares.
CLOSES = 1 / 20
# A difference below this part of the quantity's size says nothing about causes: a spline through the truth's samples is
# no more accurate.
_LEAST = 1e-7
# The error of a coarse step acts like slightly changed numbers in the equations (Hairer, Lubich and Wanner 2006,
# chapter IX: modified equations). So a fitted number that differs from the scene's by at most this, relative to it or
# to a natural size, accuses no engine.
METHOD = 1e-2
# As CLOSES, at time 0, where both sides are exact numbers and only round-off may be left.
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
        settled: observables whose verdict is right, which need no explanation.
        by_step: True if the limit of small steps leaves no more of the difference than a cause may: the run follows the
            scene's equations.
        asked: the element as the scene has it, with what chooses its held values; ``element`` has those of the run.
        found: cache of results that hypotheses share, see :func:`proofroll.core.diagnosis.fitting.cached_on_evidence`.
    """

    element: Any
    lines: Sequence[Mapping[str, Any]]
    run: xr.Dataset | None = None
    truth: xr.Dataset | None = None
    step: float | None = None
    settled: frozenset[str] = frozenset()
    by_step: bool = False
    asked: Any = None
    found: dict[Any, Sequence[Any]] = field(default_factory=dict, init=False, repr=False, compare=False)

    def read_back(self, quantity: str) -> bool:
        """True if the engine's own model, read back, has the scene's numbers of a quantity: no cause contradicts it."""
        return any(line["quantity"] == quantity and line["holds"] and bool(line["found"]) for line in self.lines)

    def vectors(self, quantity: str, count: int) -> tuple[FloatArray, FloatArray] | None:
        """Vectors of the certificate, found and expected, each (count, 3); None: no such line has as many."""
        for line in self.lines:
            if line["quantity"] == quantity and np.size(line["found"]) == np.size(line["expected"]) == 3 * count:
                sides = [np.reshape(np.array(line[side], float), (-1, 3)) for side in ("found", "expected")]
                return sides[0], sides[1]
        return None


@dataclass(frozen=True)
class Cause:
    """A cause with its proof.

    Attributes:
        id: of the hypothesis.
        says: behaviour of the engine, as a clause.
        quantity, unit: of the difference that it closes.
        before, after: difference without and with the hypothesis, in ``unit``.
        remedy: advice to an author on where to look.
        fitted: number of fitted parameters.
        covers: further quantities that it explains, for which no other cause is sought.
        closes: largest part of the difference that it may leave.
        alternative: True if another cause explains the same as well, so that the data cannot tell the two apart.
        explains: independent numbers of the difference that it closes; None: as many as there are samples.
        change: distance of the fitted parameters from the scene's, relative to them or to a natural size; infinite if
            they are those of a known mistake.
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
        """True if the change is too large to be the error of a coarse step (:data:`METHOD`)."""
        return self.change > METHOD

    @property
    def proven(self) -> bool:
        """True if the cause closes the difference, and explains more independent numbers than were fitted."""
        enough = self.explains is None or self.explains > self.fitted
        return bool(enough and self.before > 0 and np.isfinite(self.after) and self.after <= self.closes * self.before)

    @property
    def left(self) -> float:
        """Part of the difference that it leaves, at least the part that is resolvable."""
        return max(self.after / self.before, _LEAST)

    @property
    def sentence(self) -> str:
        """Clause about the engine, with the proof."""
        unit = spaced(self.unit)
        difference, remainder = number(self.before), number(self.after, 1)
        return f"{self.says} ({self.quantity} off by {difference}{unit}, by {remainder}{unit} with that)"


@dataclass(frozen=True)
class Difference:
    """A difference between engine and scene, which causes may close; attributes as those of :class:`Cause`."""

    quantity: str
    unit: str
    before: float
    covers: tuple[str, ...] = ()
    closes: float = CLOSES

    def cause(
        self,
        name: str,
        says: str,
        after: float,
        remedy: str,
        fitted: int = 0,
        *,
        explains: int | None = None,
        change: float = np.inf,
    ) -> Cause:
        """Cause with this id that leaves ``after`` of the difference."""
        proof = self.quantity, self.unit, self.before, after, remedy, fitted, self.covers, self.closes
        return Cause(name, says, *proof, explains=explains, change=change)


EvidenceT = TypeVar("EvidenceT", default=Evidence)
ResultT = TypeVar("ResultT", default=Cause)


@dataclass(frozen=True)
class Hypothesis(Generic[EvidenceT, ResultT]):
    """A cause that can be tested. A new one is one function (:func:`hypothesis`) in the element's tuple.

    Attributes:
        id: unique within the kind of element, or among those about robot files.
        grounds: the test, and why it is a proof; of robot files the behaviour of the engine.
        test: yields candidate causes, and :func:`diagnose` drops those that do not close the difference; of robot files
            it yields the models that an engine with that behaviour would hold.
        known: engine -> versions in which it was seen.
        remedy: action that a user can take.
    """

    id: str
    grounds: str
    test: Callable[[EvidenceT], Iterable[ResultT]]
    known: Mapping[str, str] = field(default_factory=dict)
    remedy: str = ""


def hypothesis(name: str, grounds: str) -> Callable[[Callable[[Evidence], Iterable[Cause]]], Hypothesis]:
    """Decorator that makes a :class:`Hypothesis`, with this name as its id, of the function that tests it."""
    return lambda test: Hypothesis(name, grounds, test)


@runtime_checkable
class ExplainsRuns(Protocol):
    """Ability of a kind of element (:class:`proofroll.core.element.ElementKind`): explains its runs."""

    @staticmethod
    def hypotheses() -> Sequence[Hypothesis]:
        """Its hypotheses; those about what an engine reports come first."""


def diagnose(evidence: Evidence, hypotheses: Sequence[Hypothesis]) -> list[Cause]:
    """The proven causes: fewest fitted parameters first, then the smallest remaining difference.

    A cause of a quantity that an earlier one explains already is kept only if it is as good, as an alternative, and
    only a few are. A cause with a fitted parameter is dropped if another fitted one is as good: neither proves
    anything, unless both leave round-off of more independent numbers than they fit, which no chance does. A hypothesis
    ends where mechanics leaves open how its model would move; those before count.
    """
    proven: list[Cause] = []
    for item in hypotheses:
        with suppress(NotUnique):
            for cause in item.test(evidence):
                proven += [cause] if cause.proven else []
    proven.sort(key=lambda cause: (cause.fitted, cause.left))
    causes: list[Cause] = []
    for cause in proven:
        rivals = [candidate for candidate in causes if _share(cause, candidate)]
        if not rivals:
            causes.append(cause)
        elif all(_rivals(cause, rival) for rival in rivals) and len(rivals) <= _ALTERNATIVES:
            causes.append(dataclasses.replace(cause, alternative=True))
    accusing = [
        cause for cause in causes if cause.accuses and not any(_unsure(cause, candidate) for candidate in proven)
    ]
    main = [cause for cause in accusing if not cause.alternative]
    return main + [
        cause for cause in accusing if cause.alternative and any(_share(cause, main_cause) for main_cause in main)
    ]


def _share(cause: Cause, rival: Cause) -> bool:
    """True if two causes explain the same quantity."""
    return bool({cause.quantity, *cause.covers} & {rival.quantity, *rival.covers})


def _rivals(cause: Cause, rival: Cause) -> bool:
    """True if a cause explains all that the first one does, and as well."""
    as_good = cause.fitted == rival.fitted and cause.left <= _AS_GOOD * rival.left
    whole = cause.quantity == rival.quantity or rival.quantity in cause.covers
    return as_good and whole and cause.id != rival.id


def _unsure(cause: Cause, rival: Cause) -> bool:
    """True if a fitted cause is one of several with equally good explanations, which may be so by chance."""
    by_count = all(item.explains is not None and item.left <= _LEAST for item in (cause, rival))
    return cause.fitted > 0 and _rivals(rival, cause) and not by_count


def hypotheses_of(element: Element) -> Sequence[Hypothesis]:
    """Hypotheses of the kind of element in whose package the element's class or its base is defined; empty: none."""
    from proofroll.core.plugins import load_element_kinds

    for base in type(element).__mro__:
        package = base.__module__.rpartition(".")[0]
        for kind in load_element_kinds():
            if kind.__module__.rpartition(".")[0] == package and isinstance(kind, ExplainsRuns):
                return kind.hypotheses()
    return ()


def above_round_off(difference: float, size: float) -> bool:
    """True if a difference is too large for round-off."""
    return bool(np.isfinite(difference) and difference > _LEAST * max(size, 1e-300))
