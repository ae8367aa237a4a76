"""Protocol between proofroll and an engine; an adapter takes some 60 lines, see docs/write_an_engine.md.

An adapter contains no clock, no file and no plot: the runner owns the time grid, the stopwatch, the detection of
NaN, timeouts and files. An adapter knows surfaces, contact laws, joints, never a scene by name.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Protocol, Self

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.core.scene import Scene


@dataclass(frozen=True, slots=True)
class Sample:
    """State of one element at one time, in the world frame W; kinds of elements add reactions. None: not available.

    For an element of several bodies each array of a body has one more axis in front: (bodies, 3).

    Attributes:
        widths: array of a body -> count of its numbers, which the harness checks to be finite.
        p_WB: origin of the body's frame [m], shape (3,).
        v_WB: velocity of that point [m/s], shape (3,).
        w_WB: angular velocity [rad/s], shape (3,).
        q_WB: orientation as a unit quaternion, scalar first, shape (4,).
    """

    widths: ClassVar[Mapping[str, int]] = {"p_WB": 3, "v_WB": 3, "w_WB": 3, "q_WB": 4}

    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    q_WB: FloatArray | None = None


@dataclass(frozen=True)
class Regularised:
    """A quantity that the engine softens on purpose, so that it holds only within a tolerance.

    Attributes:
        tolerance: largest relative difference that the softening explains.
        because: reason for the softening.
    """

    tolerance: float
    because: str


class Settings(Protocol):
    """A frozen dataclass with at least these fields; every field has a default.

    Further fields are optional. ``precision = "single"`` marks an engine that computes in single precision, see
    :func:`precision_of`; ``scheme`` names the integration rule, see :class:`Scheme`; ``unused`` lists fields that have
    no meaning for the formulation, which a run does not show.
    """

    @property
    def formulation(self) -> str:
        """Name of the engine's model of the scene."""

    @property
    def preset(self) -> str:
        """``default`` (the obvious model), ``matched`` (same physics, documented options) or ``tuned`` (best known)."""

    @property
    def resolution(self) -> str | None:
        """Name of the field that trades speed for accuracy: ``dt`` [s] or ``rtol`` [1]; None: a closed form."""

    @property
    def order(self) -> int | None:
        """Order of convergence in ``dt``, which conformance checks; None: none is declared, or the step adapts.

        It may depend on the engine's version. Parts of a scene that lower it: :class:`engine_abilities.LowersOrder`.
        """


class Engine(Protocol):
    """A multibody engine behind proofroll's protocol.

    Attributes:
        name: equal to the name of the entry point.
        provides: formulation -> capabilities that it represents honestly, as elements name them.
        settings: frozen dataclass, see :class:`Settings`.
        presets: formulation -> preset -> complete settings; each formulation has at least ``matched`` or ``default``.
    """

    name: ClassVar[str]
    provides: ClassVar[Mapping[str, frozenset[str]]]
    settings: ClassVar[type[Any]]
    presets: ClassVar[Mapping[str, Mapping[str, Any]]]

    @staticmethod
    def version() -> str:
        """Version of the engine, not of the adapter."""

    @classmethod
    def build(cls, scene: Scene, settings: Any) -> Self:
        """Builds the scene in the engine, at time 0. Untimed.

        Raises:
            Refused: the engine cannot represent the scene with these settings; the text says why.
        """

    def advance(self, t: float) -> None:
        """Moves the state to time ``t`` [s], not before the present one. Timed; returns when the state is complete.

        Raises:
            Diverged: the engine gave up; the text says when and why.
        """

    def sample(self) -> Sample:
        """State and reactions now, as a sample of the kind of element. Untimed; changes nothing."""

    def built(self) -> Any:
        """Read-back of the built model at time 0, in the element's record type; without side effects."""


class Scheme(StrEnum):
    """Common integration rules with fixed steps, for the field ``scheme`` of settings; another rule may be any text."""

    SEMI_IMPLICIT_EULER = "semi-implicit Euler"
    RK4 = "classical Runge-Kutta"


def scheme_of(settings: Any) -> str:
    """Integration rule that settings declare; empty: none."""
    return str(getattr(settings, "scheme", ""))


def presets_of(
    kind: type[Any], values: Mapping[str, Mapping[str, Mapping[str, Any]]]
) -> Mapping[str, Mapping[str, Any]]:
    """Presets, formulation -> preset -> settings of this ``kind``, from the ``values`` that are not its defaults."""
    return {
        formulation: {
            name: kind(**{**own, "formulation": formulation, "preset": name}) for name, own in presets.items()
        }
        for formulation, presets in values.items()
    }


# Machine epsilon of the arithmetic in which an engine may compute, by its precision.
EPSILON: Mapping[str, float] = {"double": 2.0**-52, "single": 2.0**-23}


def precision_of(settings: Any) -> str:
    """Precision in which an engine computes with these settings, a key of :data:`EPSILON`; double by default.

    Raises:
        InputError: the settings name an unknown precision.
    """
    precision = getattr(settings, "precision", "double")
    if precision not in EPSILON:
        raise InputError("precision", precision, f"settings say {' or '.join(EPSILON)}")
    return str(precision)


def fixed_step(settings: Settings) -> float | None:
    """Fixed step of settings [s], or None if the step adapts."""
    step: float | None = getattr(settings, settings.resolution) if settings.resolution == "dt" else None
    return step


_MOST_STEPS = 2**31 - 1  # between two samples: engines count steps in 32-bit integers


def whole_steps(start: float, end: float, dt: float) -> int:
    """Number of steps of size ``dt`` [s] from ``start`` to ``end`` [s].

    Raises:
        InputError: the interval is not a whole number of steps, or has more of them than engines can count.
    """
    exact = (end - start) / dt
    if exact > _MOST_STEPS:
        raise InputError("dt", dt, f"that is {exact:.1e} steps from {start:.6g} s to {end:.6g} s; take a longer one")
    steps = round(exact)
    if abs(exact - steps) > 1e-6 * max(1.0, abs(steps)):
        near, less = max(1, steps) * dt, (end - start) / max(1, math.ceil(exact))
        raise InputError(
            "dt", dt,
            f"the run is sampled at {start:.6g} s and {end:.6g} s, and no whole number of steps lies between; "
            f"sample every {near:.6g} s (`every`) or choose a step that divides the interval, as {less:.6g} s",
        )  # fmt: skip
    return steps
