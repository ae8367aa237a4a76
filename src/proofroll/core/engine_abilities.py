"""Optional protocols of an engine."""

from collections.abc import Collection, Mapping, Sequence, Set
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, ClassVar, Protocol, runtime_checkable

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Sample
from proofroll.core.errors import Refused
from proofroll.core.events import Event
from proofroll.core.scene import Scene


@runtime_checkable
class LocatesEvents(Protocol):
    """Ability of an engine that locates stick-slip events more closely than its samples."""

    def events(self) -> Sequence[Event] | None:
        """The events so far, in order, each with its bracket (one step wide for a fixed step); None: not located."""


@runtime_checkable
class WatchesEvents(Protocol):
    """Ability of an engine whose search for events costs time, so that only runs that want events make it."""

    def watch_events(self) -> None:
        """Looks for events in all steps from now on; called before the first ``advance``, or never."""


@runtime_checkable
class TakesTargets(Protocol):
    """Ability of an engine whose held signals are set from outside, see :mod:`proofroll.core.controlled_engine`."""

    def drive(self, values: FloatArray) -> None:
        """Sets the held signals, constant until the next call; called between two calls of ``advance``."""


class Batch(Protocol):
    """Copies of scenes that an engine moves together; ``device``: place for a reader, ``cpu`` for the processor."""

    device: str

    def advance(self, t: float) -> None:
        """Moves all copies to time ``t`` [s]; one whose state is not finite ends no other, and raises nothing."""

    def sample(self) -> Sample:
        """State of all copies now: arrays of a run's sample with the copies in front, (copies, bodies, 3)."""


@runtime_checkable
class RunsBatches(Protocol):
    """Ability of an engine that moves many copies of scenes together, as engines for training do."""

    @classmethod
    def build_batch(cls, scenes: Sequence[Scene], pattern: Sequence[int], settings: Any) -> Batch:
        """Copies at time 0: the ``scenes`` have one structure, and ``pattern`` is the index of one for each copy.

        Raises:
            Refused: the engine cannot move such scenes together; the text says why.
        """


@runtime_checkable
class TellsRemarks(Protocol):
    """Ability of an engine that comments on a successful run."""

    def remarks(self) -> Sequence[str]:
        """Remarks, each a clause without a full stop."""


class Level(StrEnum):
    """Amount of a scene that a formulation models, from the least to the most: the rungs of the ladder."""

    CLOSED_FORM = "closed form"
    REDUCED = "reduced equations"
    PROJECTION = "projection DAE"
    CONSTRAINT = "engine constraint"
    CONTACT = "engine contact"


def by_hand(level: str | None) -> bool:
    """True if a rung of the ladder solves equations derived by hand for the scene, which are no engine's model."""
    return level in {Level.CLOSED_FORM, Level.REDUCED, Level.PROJECTION}


@dataclass(frozen=True)
class Term:
    """A part of a model that a setting switches on and off.

    Attributes:
        name: for a person, e.g. ``elimination of violations``.
        formulations: names of the formulations that have the term.
        on, off: settings with and without it, which override a preset.
        because: purpose of the term.
        rung: True if a model with it is a rung of the ladder by itself, as a contact of more dimensions is.
    """

    name: str
    formulations: tuple[str, ...]
    on: Mapping[str, Any]
    off: Mapping[str, Any]
    because: str
    rung: bool = False


@runtime_checkable
class TellsLevels(Protocol):
    """Ability of an engine that has rungs on the ladder of models.

    Attributes:
        levels: formulation -> its rung.
        terms: parts of the model that can be switched on and off.
    """

    levels: ClassVar[Mapping[str, Level]]
    terms: ClassVar[Sequence[Term]]


@runtime_checkable
class HasTitle(Protocol):
    """Ability of an engine that has another name for readers than its code name.

    Attributes:
        title: as its makers spell it.
        witness: True for a solver that cross-checks the truth, as our own do: it is shown and never recommended.
    """

    title: ClassVar[str]
    witness: ClassVar[bool]


def title_of(engine: Any) -> str:
    """Name of an engine for a reader; without one its code name."""
    return engine.title if isinstance(engine, HasTitle) else str(engine.name)


@runtime_checkable
class TellsCaveats(Protocol):
    """Ability of an engine with settings that the engine alone would not have.

    An example is proofroll's own integrator around an engine's equations: the engine is not to blame for its errors.
    """

    @staticmethod
    def caveat(settings: Any) -> str:
        """Clause on the part of these settings that is not the engine's own; empty: none."""


@runtime_checkable
class BringsAPart(Protocol):
    """Ability of an engine whose adapter computes a part of some formulations, which a user of the engine lacks."""

    @staticmethod
    def brought(settings: Any) -> str:
        """Part of the computation with these settings that the adapter brings, as ``integrator``; empty: none."""


@runtime_checkable
class TellsFamily(Protocol):
    """Ability of an engine whose formulations solve different laws (of contact, say), each with a limit of its own.

    No step makes such laws agree, so verdicts name the law.
    """

    @staticmethod
    def family(settings: Any) -> Mapping[str, str]:
        """Capability -> clause on the law that a model with these settings follows for it."""


def laws(engine: Any, settings: Any) -> dict[str, str]:
    """Capability that a formulation provides -> clause on its law; empty if the engine names none."""
    clauses = engine.family(settings) if isinstance(engine, TellsFamily) else {}
    return {need: clause for need, clause in clauses.items() if need in engine.provides[settings.formulation]}


@runtime_checkable
class LowersOrder(Protocol):
    """Ability of an engine whose order of convergence drops with something in a scene."""

    @staticmethod
    def lowered(settings: Any) -> Mapping[str, int]:
        """Capability, as in ``provides`` -> lower order of convergence that it causes."""


@runtime_checkable
class TellsLines(Protocol):
    """Ability of an engine that says what a setting is in a user's own model of it."""

    @staticmethod
    def lines(settings: Any) -> list[str]:
        """Lines of the engine's own file or program that make the settings; a comment for what none can set."""


@dataclass(frozen=True, kw_only=True)
class OwnOptions:
    """Options of an engine in a person's own file, as settings of its adapter.

    Attributes:
        engine: name of the engine.
        words: options for a reader.
        settings: setting -> its value, as text.
        of_contacts: further settings, of formulations that have contacts.
        others: clauses on options that the adapter sets otherwise.
        others_of_contacts: further ones, of formulations with contacts.
        switches: for a reader, an option of the file and another value -> settings with that value.
    """

    engine: str
    words: str
    settings: Mapping[str, str]
    of_contacts: Mapping[str, str]
    others: list[str]
    others_of_contacts: list[str] = field(default_factory=list)
    switches: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def lowest(order: int | None, lowered: Mapping[str, int], requires: Collection[str]) -> int | None:
    """Order of convergence for a scene: the declared one, or the lowest that a required capability causes.

    Args:
        order: declared by the settings; None: none is, and so the result is None.
        lowered: capability -> lower order.
        requires: capabilities that the scene requires.
    """
    return None if order is None else min([order, *(lowered[name] for name in lowered.keys() & set(requires))])


def declared_order(engine: Any, settings: Any, scene: Scene) -> int | None:
    """The order of convergence in ``dt`` that an engine declares for a scene; None: none."""
    lowered = engine.lowered(settings) if isinstance(engine, LowersOrder) else {}
    return lowest(settings.order, lowered, scene.requires)


@runtime_checkable
class TellsDefaults(Protocol):
    """Ability of an engine that lists its default values, to compare versions of it."""

    @staticmethod
    def defaults() -> Mapping[str, Any]:
        """Default values read from the engine itself: name -> number, text or list of numbers."""


@runtime_checkable
class SupportsFrom(Protocol):
    """Ability of an engine whose adapter does not run with old versions.

    Attributes:
        oldest: oldest version of the engine that the adapter supports; an older one is refused.
    """

    oldest: ClassVar[str]


@runtime_checkable
class WritesModels(Protocol):
    """Ability of an engine that has a file format for models, which its own tools read."""

    @classmethod
    def model_file(cls, scene: Scene, settings: Any) -> str:
        """Text of the model file. Raises Refused if there is none for this scene or formulation."""


@runtime_checkable
class Reproduces(Protocol):
    """Ability of an engine that can write a program to show its behaviour without proofroll."""

    @classmethod
    def reproducer(cls, scene: Scene, settings: Any) -> str:
        """Source of a program that uses only numpy and the engine's own interface.

        It defines ``run(times)``, a generator of what the element's program checks at each time [s], of a
        mechanism places [m], energy [J] and how far joints are open [m]. If the engine fails, it raises RuntimeError.

        Raises:
            Refused: there is no program for this; the text says why.
        """


@runtime_checkable
class CannotLeaveOut(Protocol):
    """Ability of an engine whose models hold terms that a scene may not ask for and no setting removes.

    Attributes:
        inherent: formulation -> term that is always in its model -> reason.
    """

    inherent: ClassVar[Mapping[str, Mapping[str, str]]]


@runtime_checkable
class SharesEquations(Protocol):
    """Ability of an engine with formulations that use the same equations as a route of the truth.

    Agreement with such a route proves little: it counts only as far as the other route agrees, too, and is marked.

    Attributes:
        shares: formulation -> routes (the part of a route's name before the comma or bracket).
    """

    shares: ClassVar[Mapping[str, Sequence[str]]]


@runtime_checkable
class SaysWhyNot(Protocol):
    """Ability of an engine that gives reasons for the capabilities that a formulation lacks.

    Attributes:
        lacking: formulation -> capability that it does not provide -> reason, as the end of a sentence.
    """

    lacking: ClassVar[Mapping[str, Mapping[str, str]]]


@runtime_checkable
class MadeFor(Protocol):
    """Ability of an engine to offer a formulation for certain scenes only.

    For other scenes such a formulation is the same model as another one; it can still be asked for by name.

    Attributes:
        made_for: formulation -> capabilities; a scene has to require one of them.
    """

    made_for: ClassVar[Mapping[str, frozenset[str]]]


def offered(formulation: str, requires: Collection[str], made_for: Mapping[str, Collection[str]]) -> bool:
    """True if a formulation is offered for a scene with these requirements (:class:`MadeFor`)."""
    return formulation not in made_for or not set(requires).isdisjoint(made_for[formulation])


@dataclass(frozen=True)
class Steps:
    """Claim of a formulation: runs with ever shorter steps lead to the motion that the laws of contact tell.

    Attributes:
        exact_cone: True if friction keeps Coulomb's cone itself, and not one that is convex or has edges.
        hard_contact: True if what presses does not give way, or by less with each shorter step.
        settings: overrides of the preset ``matched``.
    """

    exact_cone: bool
    hard_contact: bool
    settings: Mapping[str, Any] = field(default_factory=dict)


@runtime_checkable
class ServesAsReference(Protocol):
    """Ability of an engine whose runs can stand for a truth where no route of the truth follows a motion.

    Attributes:
        references: formulation -> its claim.
    """

    references: ClassVar[Mapping[str, Steps]]


def stepped(
    declared: Mapping[str, tuple[Mapping[str, Steps], Mapping[str, Collection[str]]]], needs: Set[str]
) -> list[str]:
    """Engines with formulation, ``name[formulation=…]``, of a reference by steps and of its witness, or fewer.

    The reference is the first with hard contacts and exact cones, its witness the first of another engine. Engines of
    the witness that are no reference may have softer contacts or other cones.

    Args:
        declared: engine -> its claims by formulation, and what its formulations provide.
        needs: capabilities that a scene requires.
    """
    able = [
        (engine, formulation, claim)
        for engine, (claims, provides) in declared.items()
        for formulation, claim in claims.items()
        if needs <= set(provides[formulation])
    ]
    exact = [item for item in able if item[2].exact_cone and item[2].hard_contact][:1]
    witness = [item for item in able if exact and item[0] != exact[0][0]][:1]
    return [f"{engine}[formulation={formulation}]" for engine, formulation, _ in [*exact, *witness]]


def require_provided(engine: Any, formulation: str, scene: Scene) -> None:
    """Checks that a formulation provides all that a scene requires.

    Raises:
        Refused: the formulation lacks a capability; the text has its name, the engine's reason if any, and able ones.
    """
    reasons = engine.lacking.get(formulation, {}) if isinstance(engine, SaysWhyNot) else {}
    missing = sorted(scene.requires - engine.provides[formulation])
    if missing:
        purposes = engine.made_for if isinstance(engine, MadeFor) else {}
        able = [
            name
            for name, capabilities in engine.provides.items()
            if scene.requires <= capabilities and offered(name, scene.requires, purposes)
        ]
        apart = set(missing) & set().union(*engine.provides.values())  # in formulations that lack something else
        lack = "all that the scene needs" if apart else "all of that" if len(missing) > 1 else "that"
        none = f"no formulation of {engine.name}'s adapter has {lack}"
        instead = f"choose formulation={' or '.join(able)}" if able else none
        raise Refused(f"{needed(missing, reasons)}; {instead}")


def needed(missing: Sequence[str], reasons: Mapping[str, str]) -> str:
    """Clause on capabilities that are missing: first those without a reason, then those of each reason together."""
    by_reason: dict[str, list[str]] = {"": []}
    for name in missing:
        by_reason.setdefault(reasons.get(name, ""), []).append(name)
    clauses = [", ".join(names) + (f", and {reason}" if reason else "") for reason, names in by_reason.items() if names]
    return f"needs {', '.join(clauses)}"
