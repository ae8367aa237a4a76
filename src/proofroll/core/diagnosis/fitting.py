"""Fits wrong models of an element to its certificate or its run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, Generic, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence

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
