"""Wrong models of an element: fits to its certificate or its run, and what the certificate reads back."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, Generic, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import Line, distinct_texts, worst_numbers
from proofroll.core.diagnosis import Cause, Difference, Evidence, Hypothesis, hypothesis

M = TypeVar("M")
FactT = TypeVar("FactT")
# A residual below this many times the true run's own, which is measurement error, says nothing.
ABOVE = 20.0

_ROUNDS = 8
_STEP = 1e-4
# Part of the largest change, or of the difference, below which a number counts as unchanged.
_CHANGED = 1e-6
# Relative distance within which a fitted factor is taken for that of a known mistake (FACTORS); absolute for 0.
_NEAR = 2e-3
_NOTHING = 1e-5
# Most numbers of a line that are shown in a cause; of more only the one that differs most.
_SHOWN = 3
# Relative deviation within which all numbers of a line are the scene's times one factor.
_ALIKE = 1e-9
FACTORS: Mapping[float, str] = {
    0.0: "left out",
    -1.0: "with the wrong sign",
    0.5: "halved",
    2.0: "counted twice",
    1000.0: "by a factor of a thousand, as from a wrong prefix of its unit",
    1e-3: "a thousandth, as with a wrong prefix of its unit",
    180 / np.pi: "in degrees instead of radians",
    np.pi / 180: "taken for degrees",
    5 / 3: "5/3 times, as that of a thin shell instead of a solid ball",
    2 * np.pi: "times 2 pi, as turns for radians",
}


def least_squares_parameters(
    residual: Callable[[FloatArray], FloatArray], start: FloatArray, size: float, rounds: int = _ROUNDS
) -> FloatArray:
    """Parameters that minimise the sum of squared residuals, by Gauss-Newton with halved steps.

    Residuals may be NaN, of any shape, where they cannot be computed; the start is returned if it leads nowhere.
    """
    x, residuals = start, residual(start)
    if not np.all(np.isfinite(residuals)):
        return x
    for _ in range(rounds):
        slopes = np.stack([residual(x + h) - residuals for h in _STEP * size * np.eye(len(x))], axis=-1) / (
            _STEP * size
        )
        if not np.all(np.isfinite(slopes)) or not np.any(slopes):
            return x
        step = -np.linalg.lstsq(slopes, residuals, rcond=None)[0]
        for _ in range(6):
            tried = residual(x + step)
            if np.all(np.isfinite(tried)) and tried @ tried <= residuals @ residuals:
                break
            step /= 2
        else:
            return x
        x, residuals = x + step, tried
        if np.max(np.abs(step)) < 1e-9 * size:
            break
    return x


def least_squares_parameter(residual: Callable[[float], FloatArray], start: float, size: float) -> float:
    """The same for a single parameter."""
    return float(least_squares_parameters(lambda x: residual(float(x[0])), np.array([start]), size)[0])


def known_factor(factor: float) -> tuple[float, str] | None:
    """Factor of a known mistake that is near to the given one, and its description; None: there is none."""
    for value, words in FACTORS.items():
        if abs(factor - value) <= (_NEAR * abs(value) or _NOTHING):
            return value, words
    return None


def factor_text(factor: float) -> str:
    """A factor in words."""
    usual = known_factor(factor)
    return usual[1] if usual else f"{factor:.6g} times"


def change_by(factor: float) -> float:
    """Relative change of a number by a factor (``change`` of :class:`.Cause`); infinite if it is a known mistake."""
    return abs(factor - 1) if known_factor(factor) is None else np.inf


def possible(factor: float, signed: bool) -> bool:
    """True if a known mistake multiplies a number by this factor; only a ``signed`` number gets a negative one."""
    return factor >= 0 or (signed and known_factor(factor) is not None)


@dataclass(frozen=True)
class Residuals(Generic[M]):
    """Residuals of the equations, or of a certificate, under models of an element.

    Attributes:
        left: model -> its residual, shape (numbers,); infinite for None, which stands for an impossible model.
        quantity, unit: of the residual.
        before: largest residual of the scene's own model.
        closes: part of it that a proven cause may leave.
        covers: quantities that follow from the model.
        plain: the scene's own model.
        others: models that differ from it in one number each; their changes of the residual span all that is
            distinguishable.
        contradicted: True for a model that contradicts a correct report of the engine.
        exact: True if the engine's own accelerations leave nothing but round-off to its model. They show that numbers
            read back are not those by which it moves; a run with the errors of its steps does not.
        scheme: residual that a scheme of first order leaves by itself at the engine's step, as ``left``.
        leaves: residual that rounding and the step may leave of a right model, as ``left``.
    """

    left: Callable[[M | None], FloatArray]
    quantity: str
    unit: str
    before: float
    closes: float
    covers: tuple[str, ...]
    plain: M
    others: Callable[[], Sequence[M]]
    contradicted: Callable[[M], bool] = lambda _: False
    exact: bool = False
    scheme: FloatArray | float = 0.0
    leaves: FloatArray | float = np.inf

    @cached_property
    def _changes(self) -> FloatArray:
        """Normalised changes of the residual by the other models, shape (numbers, models).

        Changes that are round-off are left out, as by numbers that act on accelerations where there are none.
        """
        plain_residual = self.left(self.plain)
        changes = np.stack([self.left(model) - plain_residual for model in self.others()], axis=-1)
        sizes = np.linalg.norm(changes, axis=0)
        seen = sizes > _CHANGED * self.before
        return np.asarray(changes[:, seen] / sizes[seen])

    @property
    def single_equation(self) -> bool:
        """True for a single equation: any one fitted parameter closes it, so a fit proves nothing."""
        return len(self.left(self.plain)) < 2

    def explained(self, model: M | None) -> int:
        """Number of independent residuals that distinguish a model from the scene's and from the other models."""
        change = self.left(model) - self.left(self.plain)
        size = np.abs(change)
        if not np.all(np.isfinite(size)) or not np.any(size):
            return 0
        all_of_them = np.column_stack([change / np.linalg.norm(change), self._changes])
        values = np.linalg.svd(all_of_them[size > _CHANGED * np.max(size)], compute_uv=False)
        return int(np.sum(values > self.closes * np.max(values)))

    def largest(self, model: M | None) -> float:
        """Largest residual of a model."""
        return float(np.max(np.abs(self.left(model)), initial=0.0))

    def fit(self, model: Callable[[float], M | None], start: float) -> float:
        """Value of the free parameter for which the residual is smallest, in a family of models."""
        return least_squares_parameter(lambda x: self.left(model(x)), start, 1.0)

    def cause(self, row: CauseRow[M]) -> Cause:
        """Cause: the engine behaves as a row says."""
        remainder = self.largest(row.model)
        closes = remainder <= self.closes * self.before
        rest = closes and bool(np.any(np.abs(self.left(row.model)) > self.leaves))
        if closes and (row.model is None or rest or self.contradicted(row.model)):
            remainder = np.inf
        explains = self.explained(row.model) if row.fitted and closes else None
        proof = self.quantity, self.unit, self.before, remainder, row.remedy, row.fitted, self.covers, self.closes
        return Cause(row.id, row.says, *proof, explains=explains, change=row.change)

    def scaled(
        self,
        name: str,
        says: str,
        model: Callable[[float], M],
        remedy: str,
        quantity: str = "",
        *,
        signed: bool = True,
        linear: bool = True,
    ) -> Iterator[CauseRow[M]]:
        """Row of a number with the factor that closes the residual best, one of a known mistake if that closes it.

        With a single equation any factor would fit, so that only those of known mistakes are tried.

        Args:
            name: id of the row.
            says: behaviour, which the words of the factor follow.
            model: model for a factor.
            remedy: advice to an author.
            quantity: see :class:`CauseRow`.
            signed: True if a known mistake may give the number the wrong sign.
            linear: True if the residual is linear in the factor.
        """
        plain_left = self.left(model(1.0))
        slope = self.left(model(2.0)) - plain_left if linear else plain_left

        def largest(factor: float) -> float:
            left = plain_left + (factor - 1.0) * slope
            return float(np.max(np.abs(left), initial=0.0)) if linear else self.largest(model(factor))

        factor = min(FACTORS, key=largest)
        fitted = not self.single_equation and largest(factor) > self.closes * self.before
        if fitted and linear:
            square = float(slope @ slope)
            factor = 1.0 - float(slope @ plain_left) / square if square else 1.0
        elif fitted:
            factor = self.fit(model, 1.0)
        if possible(factor, signed):
            yield CauseRow(
                id=name,
                says=f"{says} {factor_text(factor)}",
                model=model(factor),
                remedy=remedy,
                quantity=quantity,
                fitted=int(fitted),
                change=change_by(factor),
            )

    def numbers_of(self, model: Callable[[FloatArray], M], count: int, cutoff: float | None = None) -> FloatArray:
        """Numbers, in which the residual is linear, that leave least; ``cutoff``: of singular values, relative."""
        residual = self.left(model(np.zeros(count)))
        slopes = np.stack([self.left(model(row)) - residual for row in np.eye(count)], axis=-1)
        return np.asarray(-np.linalg.lstsq(slopes, residual, rcond=cutoff)[0])


@dataclass(frozen=True)
class CauseRow(Generic[M]):
    """A behaviour that an engine may have, as a change of the model.

    Attributes:
        id: of the cause.
        says: the behaviour, as a clause.
        model: the changed model; None: it is impossible.
        remedy: advice to an author.
        quantity: of the certificate that the change contradicts; empty: none.
        fitted: count of fitted numbers in the model.
        change: their change, see :class:`.Cause`.
    """

    id: str
    says: str
    model: M | None
    remedy: str
    quantity: str = ""
    fitted: int = 0
    change: float = np.inf


def in_doubt(evidence: Evidence, residuals: Residuals[Any], quantity: str, fitted: int = 0) -> bool:
    """True if a cause may say that the engine moves by other numbers of a quantity than the scene's.

    Where the certificate reads the scene's numbers back, only exact accelerations and a known mistake (nothing
    ``fitted``) are stronger.
    """
    return not evidence.read_back(quantity) or (residuals.exact and not fitted)


def cached_on_evidence(residuals: Callable[[Evidence], Iterator[FactT]]) -> Callable[[Evidence], Sequence[FactT]]:
    """The residuals, computed once for each evidence and cached, since nearly every hypothesis needs them."""

    @wraps(residuals)
    def remembered(evidence: Evidence) -> Sequence[FactT]:
        if residuals not in evidence.found:
            evidence.found[residuals] = tuple(residuals(evidence))
        return evidence.found[residuals]

    return remembered


def differing(lines: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Lines of quantities that the engine reports and that differ from the scene's."""
    return [line for line in lines if not line["holds"] and line["found"] and np.all(np.isfinite(line["found"]))]


def scale_of(line: Mapping[str, Any]) -> float:
    """Scale of a line's difference, in its unit."""
    apart = float(np.max(np.abs(np.subtract(line["found"], line["expected"]))))
    return apart / line["difference"] if apart and line["difference"] else 1.0


def built_otherwise(
    names: Collection[str], covers: tuple[str, ...], places: Collection[str] = (), state: Collection[str] = ()
) -> Hypothesis:
    """Hypothesis: the model was built with other numbers than the scene's, as its certificate shows.

    Args:
        names: quantities that the adapter hands to the engine.
        covers: quantities that follow from them.
        places: part of ``names`` that is another, too, where the start is another.
        state: quantities of the start.
    """

    @hypothesis(
        "built", "the engine's own model, read back, holds other numbers than the scene: its certificate says so"
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        lines = differing(evidence.lines)
        moved = any(line["quantity"] in state for line in lines)
        wrong = [line for line in lines if line["quantity"] in names and not (moved and line["quantity"] in places)]
        if not wrong or all(_is_single(line) for line in wrong):
            return
        worst = max(wrong, key=lambda line: float(line["difference"]))
        says = f"the engine's model has {' and '.join(_otherwise(line) for line in wrong)}"
        remedy = (
            "give the engine the scene's number, once, in its unit and about the point and axes that the engine takes"
        )
        yield _relative(worst["quantity"], worst["difference"], covers).cause("built", says, 0.0, remedy)

    return test


def _relative(quantity: str, before: float, covers: tuple[str, ...] = ()) -> Difference:
    return Difference(f"at time 0 {quantity}, relative", "1", before, covers)


def _otherwise(line: Mapping[str, Any]) -> str:
    """Text about a wrongly built quantity: both numbers, and their ratio if all its numbers have the same."""
    built, expected = (np.asarray(line[key], dtype=np.float64) for key in ("found", "expected"))
    values = {field.name: line[field.name] for field in dataclasses.fields(Line)}
    text, expected_text = distinct_texts(*worst_numbers(Line(**values), _SHOWN))
    shown = f"{text} instead of {expected_text}{'' if line['unit'] == '1' else ' ' + line['unit']}"
    square = float(expected @ expected) if built.shape == expected.shape else 0.0
    factor = float(built @ expected) / square if square else 0.0
    alike = square > 0 and bool(np.max(np.abs(built - factor * expected)) <= _ALIKE * np.max(np.abs(expected)))
    return f"{line['quantity']} {factor_text(factor)} ({shown})" if alike else f"{line['quantity']} {shown}"


def _is_single(line: Mapping[str, Any]) -> bool:
    """True if the found numbers are the expected ones rounded to float32."""
    return np.array_equal(np.float32(line["expected"]), np.asarray(line["found"])) and any(line["expected"])


def single_precision(lines: Sequence[Mapping[str, Any]]) -> Iterator[Cause]:
    """Cause: the engine computes with 24 bits, as the differing numbers are the expected ones rounded to float32."""
    exact = [line for line in differing(lines) if _is_single(line)]
    if exact:
        difference = max(line["difference"] for line in exact)
        name, says = str(exact[0]["quantity"]), "the engine holds single-precision numbers (float32)"
        remedy = 'compute in double precision, or say precision = "single" in the settings'
        yield _relative(name, difference).cause("float32", says, 0.0, remedy)
