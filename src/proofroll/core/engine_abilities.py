"""Optional protocols of an engine."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, ClassVar, Protocol, runtime_checkable

from proofroll.core.errors import Refused
from proofroll.core.events import Event
from proofroll.core.scene import Scene


@runtime_checkable
class LocatesEvents(Protocol):
    """Ability of an engine that locates stick-slip events more closely than its samples."""

    def events(self) -> Sequence[Event]:
        """The events so far, in order, each with its bracket (one step wide for a fixed step)."""


@runtime_checkable
class TellsRemarks(Protocol):
    """Ability of an engine that makes remarks on a run that went well."""

    def remarks(self) -> Sequence[str]:
        """One clause each, without a full stop; none if there is nothing to say."""


class Level(StrEnum):
    """Share of the scene that a formulation models, from the least to the most: the rungs of the ladder."""

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
        because: purpose of the term.
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
    """Ability of an engine that has a place on the ladder of models.

    Attributes:
        levels: formulation -> its rung.
        terms: parts of the model that can be switched on and off.
    """

    levels: ClassVar[Mapping[str, Level]]
    terms: ClassVar[Sequence[Term]]


@runtime_checkable
class TellsCaveats(Protocol):
    """Ability of an engine with settings that are not what the engine alone would do.

    An integrator of proofroll's around an engine's terms, say: whoever reads a verdict must not blame the engine.
    """

    @staticmethod
    def caveat(settings: Any) -> str:
        """Clause on the part of these settings that is not the engine's own; empty: none."""


@runtime_checkable
class TellsFamily(Protocol):
    """Ability of an engine whose formulations solve laws of different families, which have limits of their own.

    As short steps do not bring one family to another, whoever reads a verdict must know which it is.
    """

    @staticmethod
    def family(settings: Any) -> Mapping[str, str]:
        """Clause on the law that a model with these settings follows, by the capability that it is of."""


def laws(engine: Any, settings: Any) -> dict[str, str]:
    """Clauses on the laws of what a formulation provides, by capability; none where the engine tells none."""
    told = engine.family(settings) if isinstance(engine, TellsFamily) else {}
    return {need: clause for need, clause in told.items() if need in engine.provides[settings.formulation]}


@runtime_checkable
class LowersOrder(Protocol):
    """Ability of an engine whose order of convergence drops with something in a scene."""

    @staticmethod
    def lowered(settings: Any) -> Mapping[str, int]:
        """Lower order of convergence by the capability that causes it, as ``provides`` names it."""


def lowest(order: int | None, lowered: Mapping[str, int], requires: Collection[str]) -> int | None:
    """Order of convergence for a scene with these requirements, the lowest of those declared; None: none is."""
    return None if order is None else min([order, *(lowered[name] for name in lowered.keys() & set(requires))])


def declared_order(engine: Any, settings: Any, scene: Scene) -> int | None:
    """The order of convergence in ``dt`` that an engine declares for a scene; None: none."""
    lowered = engine.lowered(settings) if isinstance(engine, LowersOrder) else {}
    return lowest(settings.order, lowered, scene.requires)


@runtime_checkable
class TellsDefaults(Protocol):
    """Ability of an engine that tells its default values: for comparing its versions."""

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """Read from the engine itself: name -> number, text or list of numbers."""


@runtime_checkable
class SupportsFrom(Protocol):
    """Ability of an engine whose adapter does not run on every version of it.

    Attributes:
        oldest: version of the engine from which on it does; an older one is refused with both versions.
    """

    oldest: ClassVar[str]


@runtime_checkable
class WritesModels(Protocol):
    """Ability of an engine whose own tools read a file of the model."""

    @classmethod
    def model_file(cls, scene: Scene, settings: Any) -> str:
        """Text of the model file. Raises Refused if there is none for this scene or formulation."""


@runtime_checkable
class Reproduces(Protocol):
    """Ability of an engine that can write a program to show its behaviour without proofroll."""

    @classmethod
    def reproducer(cls, scene: Scene, settings: Any) -> str:
        """Source of a program with numpy and the engine's own interface alone.

        Of a ball it assigns RADIUS [m], MASS [kg], INERTIA [kg m²], GRAVITY [m/s²] and the start, and defines
        ``frame(p)``, ``gap(p)`` (:func:`proofroll.elements.ball_on_surface.reproducer_source.cut_program`) and
        ``run(times)``, a generator of its centre, velocity and angular velocity in the world at each of the times [s];
        where the engine says that it has failed, ``run`` raises RuntimeError with its words.

        Raises:
            Refused: there is no program for this; the text says why.
        """


@runtime_checkable
class CannotLeaveOut(Protocol):
    """Ability of an engine with models that hold terms no scene asked for and no setting removes.

    Attributes:
        inherent: formulation -> what is always in its model -> why.
    """

    inherent: ClassVar[Mapping[str, Mapping[str, str]]]


@runtime_checkable
class SharesEquations(Protocol):
    """Ability of an engine with formulations that rest on the equations of a route of the truth.

    Attributes:
        shares: formulation -> routes (the part of a route's name before the comma or bracket). Where the truth takes
            such a route, agreement with it is news only as far as the other route agrees too, and is marked.
    """

    shares: ClassVar[Mapping[str, Sequence[str]]]


@runtime_checkable
class SaysWhyNot(Protocol):
    """Ability of an engine that gives reasons for what a formulation does not provide.

    Attributes:
        lacking: formulation -> what it does not provide -> why, as the end of a sentence.
    """

    lacking: ClassVar[Mapping[str, Mapping[str, str]]]


@runtime_checkable
class MadeFor(Protocol):
    """Ability of an engine to offer a formulation for certain scenes only.

    Without what it is made for such a formulation is the same model as another one; asked for by name it builds it.

    Attributes:
        made_for: formulation -> capabilities; a scene has to require one of them.
    """

    made_for: ClassVar[Mapping[str, frozenset[str]]]


def offered(formulation: str, requires: Collection[str], made_for: Mapping[str, Collection[str]]) -> bool:
    """True if a formulation is offered for a scene with these requirements (:class:`MadeFor`)."""
    return formulation not in made_for or not set(requires).isdisjoint(made_for[formulation])


def require_provided(engine: Any, formulation: str, scene: Scene) -> None:
    """Compares what a scene requires with what a formulation provides.

    Raises:
        Refused: it lacks something; the text says what, and why if the engine says it.
    """
    reasons = engine.lacking.get(formulation, {}) if isinstance(engine, SaysWhyNot) else {}
    missing = sorted(scene.requires - engine.provides[formulation])
    if missing:
        purposes = engine.made_for if isinstance(engine, MadeFor) else {}
        able = [
            name
            for name, given in engine.provides.items()
            if scene.requires <= given and offered(name, scene.requires, purposes)
        ]
        instead = (
            f"choose formulation={' or '.join(able)}" if able else f"no formulation of {engine.name} has all of that"
        )
        needs = ", ".join(f"{name}, and {reasons[name]}" if name in reasons else name for name in missing)
        raise Refused(f"needs {needs}; {instead}")
