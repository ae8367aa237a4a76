"""The protocol between proofroll and an engine. Implement it in under 60 lines; see CONTRIBUTING.md.

An adapter contains no clock, no file and no plot: the runner owns the time grid, the stopwatch, the detection of
NaN, timeouts and files. An adapter knows surfaces and contact laws, never a scene by name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar, Protocol, Self, runtime_checkable

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError, Refused
from proofroll.core.events import Event
from proofroll.core.scene import Scene


@dataclass(frozen=True, slots=True)
class Sample:
    """State and reactions of one ball now, in the world frame W. None: the engine cannot say.

    Attributes:
        p_WB: centre [m], shape (3,).
        v_WB: velocity of the centre [m/s], shape (3,).
        w_WB: angular velocity [rad/s], shape (3,).
        q_WB: orientation as a unit quaternion, scalar first, shape (4,); identity at time 0.
        force: of the wall on the ball at the contact point, -N e1 + F2 e2 + F3 e3 [N], shape (3,). None at time 0
            alone: the engine defines reactions only after a first step.
        sticking: whether the contact holds by static friction; only where friction is bounded.
        joint_force, joint_torque: of a mechanism: on the child of each joint, then on body_b of each loop, at the joint
            [N, N m], shape (joints + loops, 3); NaN where the engine cannot say one of them.
    """

    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    q_WB: FloatArray | None = None
    force: FloatArray | None = None
    sticking: bool | None = None
    joint_force: FloatArray | None = None
    joint_torque: FloatArray | None = None


@dataclass(frozen=True)
class Regularised:
    """A quantity that the engine softens on purpose, so that it holds only within a tolerance.

    Attributes:
        tolerance: largest relative difference that the model explains.
        because: why.
    """

    tolerance: float
    because: str


@dataclass(frozen=True)
class Built:
    """What the engine really built, read back from the engine (never from the scene). None: it cannot say.

    Attributes:
        mass: of the ball [kg].
        inertia: central inertia of the ball, principal values [kg m²], shape (3,).
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        ball_radius: [m].
        rolling_resistance: f [m]; 0 where nothing of the kind was built. None counts as missing where f > 0.
        mu_static, mu_kinetic: coefficients of friction [-]; inf where friction has no bound. None counts as missing
            where friction is bounded.
        gap: distance of the ball from the engine's own wall at time 0 [m].
        acceleration: of the ball's centre at time 0 [m/s²], shape (3,).
        angular_acceleration: of the ball at time 0 in the world [rad/s²], shape (3,).
        terms: the optional parts that are in the built model: rolling resistance, bounded friction, orientation.
        regularised: names of certificate quantities (``gap``, ``slip``, ``spin``, ``acceleration``, ``N``, ``F2``, …)
            that the model softens, with tolerance and reason, as far as :data:`certificate.CAPS` lets it:
            mass, inertia, gravity, radius and position along the wall are never soft. Tolerances of acceleration, N,
            F2 and F3 are relative to :func:`mechanics.natural_acceleration`; one of ``1 / static friction``,
            where the scene has no bound and the engine needs a number, to 1/mu.
    """

    mass: float | None = None
    inertia: FloatArray | None = None
    gravity: FloatArray | None = None
    ball_radius: float | None = None
    rolling_resistance: float | None = None
    mu_static: float | None = None
    mu_kinetic: float | None = None
    gap: float | None = None
    acceleration: FloatArray | None = None
    angular_acceleration: FloatArray | None = None
    terms: frozenset[str] | None = None
    regularised: Mapping[str, Regularised] = field(default_factory=dict)


class Settings(Protocol):
    """A frozen dataclass with at least these fields; every field has a default."""

    @property
    def formulation(self) -> str:
        """Which of the engine's models of the scene."""

    @property
    def preset(self) -> str:
        """``default`` (the obvious model), ``matched`` (same physics, documented options) or ``tuned`` (best known)."""

    @property
    def resolution(self) -> str | None:
        """Name of the field that trades speed for accuracy: ``dt`` [s] or ``rtol`` [-]; None: a closed form."""

    @property
    def order(self) -> int | None:
        """Order of convergence in ``dt`` that conformance holds it to; None: none is declared, or the step adapts."""


class Engine(Protocol):
    """A multibody engine behind proofroll's protocol.

    Attributes:
        name: equal to the name of the entry point.
        provides: formulation -> what it can represent honestly, as elements name it.
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
        """The scene in the engine, at time 0. Untimed.

        Raises:
            Refused: the engine cannot represent the scene with these settings; the text says why.
        """

    def advance(self, t: float) -> None:
        """Move the state to time ``t`` [s], not before the present one. The only timed call.

        Raises:
            Diverged: the engine gave up; the text says when and why.
        """

    def sample(self) -> Sample:
        """State and reactions now. Untimed; changes nothing."""

    def built(self) -> Built:
        """What was built, read back from the engine. Called at time 0; changes nothing."""


@runtime_checkable
class LocatesEvents(Protocol):
    """What an engine has besides, if it locates stick-slip events more closely than its samples tell."""

    def events(self) -> Sequence[Event]:
        """The events so far, in order, each with its bracket (one step wide for a fixed step)."""


@runtime_checkable
class TellsRemarks(Protocol):
    """What an engine has besides, if there is something about a run that a person should know though it went well."""

    def remarks(self) -> Sequence[str]:
        """One clause each, without a full stop; none if there is nothing to say."""


class Level(StrEnum):
    """How much of the scene a formulation models, from the least to the most: the rungs of the ladder."""

    CLOSED_FORM = "closed form"
    REDUCED = "reduced equations"
    PROJECTION = "projection DAE"
    CONSTRAINT = "engine constraint"
    CONTACT = "engine contact"
    FACETS = "faceted wall"


@dataclass(frozen=True)
class Term:
    """A part of a model that can be switched on and off by a setting.

    Attributes:
        name: for a person, e.g. ``elimination of violations``.
        formulations: those that have it.
        on, off: settings with and without it, put over a preset.
        because: what it is for.
        rung: whether a model with it is a rung of the ladder by itself, as a contact of more dimensions is.
    """

    name: str
    formulations: tuple[str, ...]
    on: Mapping[str, Any]
    off: Mapping[str, Any]
    because: str
    rung: bool = False


@runtime_checkable
class TellsLevels(Protocol):
    """What an engine has besides, to be put on the ladder of models.

    Attributes:
        levels: formulation -> its rung.
        terms: what can be switched on and off.
    """

    levels: ClassVar[Mapping[str, Level]]
    terms: ClassVar[Sequence[Term]]


@runtime_checkable
class TellsCaveats(Protocol):
    """What an engine has besides, if some of its settings are not what the engine alone would do.

    An integrator of proofroll's around an engine's terms, say: whoever reads a verdict must not blame the engine.
    """

    @staticmethod
    def caveat(settings: Any) -> str:
        """What is not the engine's own with these settings: one clause without a full stop; empty: nothing."""


@runtime_checkable
class TellsDefaults(Protocol):
    """What an engine has besides, if it can say what it takes where nobody chooses: for comparing its versions."""

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """Read from the engine itself: name -> number, text or list of numbers."""


@runtime_checkable
class SupportsFrom(Protocol):
    """What an engine has besides, if its adapter does not run on every version of it.

    Attributes:
        oldest: version of the engine from which on it does; an older one is refused with both versions.
    """

    oldest: ClassVar[str]


@runtime_checkable
class WritesModels(Protocol):
    """What an engine has besides, if its own tools read a file of the model that it builds."""

    @classmethod
    def model_file(cls, scene: Scene, settings: Any) -> str:
        """The text of that file.

        Raises:
            Refused: there is none for this scene or formulation.
        """


@runtime_checkable
class Reproduces(Protocol):
    """What an engine has besides, if it can write a program that shows its behaviour without proofroll."""

    @classmethod
    def reproducer(cls, scene: Scene, settings: Any) -> str:
        """Source of a program with numpy and the engine's own interface alone.

        It assigns RADIUS [m], MASS [kg], INERTIA [kg m²], GRAVITY [m/s²] and the start, and defines ``frame(p)``,
        ``gap(p)`` (:func:`reproducer_source.wall_source`) and ``run(times)``, a generator of the ball's centre,
        velocity and angular velocity in the world at each of the times [s]; where the engine says that it has failed,
        ``run`` raises RuntimeError with its words.

        Raises:
            Refused: there is no program for this; the text says why.
        """


@runtime_checkable
class CannotLeaveOut(Protocol):
    """What an engine has besides, if some of its models hold what no scene asked for and no setting takes away.

    Attributes:
        inherent: formulation -> what is always in its model -> why.
    """

    inherent: ClassVar[Mapping[str, Mapping[str, str]]]


@runtime_checkable
class SharesEquations(Protocol):
    """What an engine has besides, if some of its formulations rest on the equations of a route of the truth.

    Attributes:
        shares: formulation -> routes (the part of a route's name before the comma or bracket). Where the truth takes
            such a route, agreement with it is news only as far as the other route agrees too, and is marked.
    """

    shares: ClassVar[Mapping[str, Sequence[str]]]


def fixed_step(settings: Settings) -> float | None:
    """The step of settings with a fixed one [s], or None."""
    step: float | None = getattr(settings, settings.resolution) if settings.resolution == "dt" else None
    return step


def whole_steps(start: float, end: float, dt: float) -> int:
    """Number of steps of size ``dt`` [s] from ``start`` to ``end`` [s].

    Raises:
        InputError: the interval is not a whole number of steps.
    """
    exact = (end - start) / dt
    steps = round(exact)
    if abs(exact - steps) > 1e-6 * max(1.0, abs(steps)):
        near, less = max(1, steps) * dt, (end - start) / max(1, math.ceil(exact))
        raise InputError(
            "dt", dt,
            f"the run is sampled at {start:.6g} s and {end:.6g} s, and no whole number of steps lies between; "
            f"sample every {near:.6g} s (`every`) or choose a step that divides the interval, as {less:.6g} s",
        )  # fmt: skip
    return steps


@runtime_checkable
class SaysWhyNot(Protocol):
    """What an engine has besides, if it can say why a formulation does not provide something.

    Attributes:
        lacking: formulation -> what it does not provide -> why, as the end of a sentence.
    """

    lacking: ClassVar[Mapping[str, Mapping[str, str]]]


def require_provided(engine: Any, formulation: str, scene: Scene) -> None:
    """Compares what a scene requires with what a formulation provides.

    Raises:
        Refused: it lacks something; the text says what, and why if the engine says it.
    """
    reasons = engine.lacking.get(formulation, {}) if isinstance(engine, SaysWhyNot) else {}
    missing = sorted(scene.requires - engine.provides[formulation])
    if missing:
        raise Refused(
            "needs " + ", ".join(f"{name}, and {reasons[name]}" if name in reasons else name for name in missing)
        )
