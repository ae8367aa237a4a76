"""Fits wrong models of an element to its certificate or its run."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import Any, Generic, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, Hypothesis, hypothesis

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
        changed = np.stack([self.left(model) - plain_residual for model in self.others()], axis=-1)
        sizes = np.linalg.norm(changed, axis=0)
        seen = sizes > _CHANGED * self.before
        return np.asarray(changed[:, seen] / sizes[seen])

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

    def cause(self, name: str, says: str, model: M | None, remedy: str, number: int, change: float = np.inf) -> Cause:
        """Cause: the engine moves by this model.

        Args:
            name: id of the hypothesis.
            says: behaviour of the engine, as a clause.
            model: the model; None: it is impossible.
            remedy: advice to an author.
            number: count of fitted parameters in it.
            change: their change, see :class:`.Cause`.
        """
        remainder = self.largest(model)
        closes = remainder <= self.closes * self.before
        part_left = closes and bool(np.any(np.abs(self.left(model)) > self.leaves))
        if closes and (model is None or part_left or self.contradicted(model)):
            remainder = np.inf
        explains = self.explained(model) if number and closes else None
        proof = self.quantity, self.unit, self.before, remainder, remedy, number, self.covers, self.closes
        return Cause(name, says, *proof, explains=explains, change=change)


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


def any_gravity(
    residuals: Callable[[Evidence], Sequence[Residuals[Any]]],
    gravity_of: Callable[[Any], FloatArray],
    falling: Callable[[Any, FloatArray], Any],
) -> Hypothesis:
    """Hypothesis: gravity has another direction or magnitude.

    Args:
        residuals: residuals of an evidence.
        gravity_of: gravity of an element in the scene [m/s²].
        falling: model of an element with another vector of gravity.
    """
    remedy = "look at the axes of gravity"

    @hypothesis("direction of gravity", "the equations are linear in gravity: one vector closes them at every state")
    def test(evidence: Evidence) -> Iterator[Cause]:
        element = evidence.element
        g = gravity_of(element)
        for source in residuals(evidence):
            axes = [axis for axis in (*np.eye(3), *-np.eye(3)) if np.any(np.cross(axis, g))]
            for along in axes if in_doubt(evidence, source, "gravity") else ():
                gravity = float(np.linalg.norm(g)) * along
                says = f"the engine's gravity is ({_shown(gravity)}) m/s^2, along another axis"
                yield source.cause("direction of gravity", says, falling(element, gravity), remedy, 0)
            if not in_doubt(evidence, source, "gravity", 3):
                continue
            residual = source.left(falling(element, g))
            slopes = [source.left(falling(element, g + axis)) - residual for axis in np.eye(3)]
            gravity = g - np.linalg.lstsq(np.stack(slopes, axis=-1), residual, rcond=None)[0]
            gravity = np.where(np.abs(gravity) < 1e-6 * max(float(np.max(np.abs(gravity))), 1e-300), 0.0, gravity)
            off, size = (float(np.linalg.norm(x)) for x in (gravity - g, g))
            says, model = f"the engine's gravity is ({_shown(gravity)}) m/s^2", falling(element, gravity)
            yield source.cause("direction of gravity", says, model, remedy, 3, off / size if size else np.inf)

    return test


def _shown(gravity: FloatArray) -> str:
    return ", ".join(f"{x:.4g}" for x in gravity + 0.0)  # not -0
