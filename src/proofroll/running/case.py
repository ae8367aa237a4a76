"""Case: a scene with parameters, in an engine with settings, over a time grid; and its result."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, Any

from proofroll.core.engine_abilities import lowest
from proofroll.core.limits import TIME_LIMIT
from proofroll.core.plugins import plain_name

if TYPE_CHECKING:
    from proofroll.core.engine_abilities import Steps, Term


class Status(StrEnum):
    """Status of a case at its end."""

    DONE = "done"
    DIVERGED = "diverged"
    REFUSED = "refused"  # the engine says that it cannot represent the scene
    WRONG_MODEL = "wrong model"  # the engine's model contradicts the scene (certificate), so it was not run
    ANOTHER_SCENE = "another scene"  # it ran, but with a model of a different kind (KnowsAnotherScene)
    NO_TRUTH = "no truth"  # it ran, but there is no truth to compare it with
    MISSING = "missing"
    CRASHED = "crashed"
    TIMEOUT = "timeout"
    LEFT_OUT = "left out"  # the processor time of a study did not suffice (TimeBudget)
    NOT_RUN = "not run"  # another step of a row whose own step has no result


# Results that are stored for good; a crash, a hang or a missing engine may not occur next time.
LASTING = frozenset({Status.DONE, Status.DIVERGED, Status.REFUSED, Status.WRONG_MODEL})


@dataclass(frozen=True)
class EngineDescription:
    """Description of an engine before any settings are chosen.

    Attributes:
        name: of the engine; with ``@`` and the place of its interpreter, if another one, ``mujoco@3.8.1``.
        version: of the engine.
        interpreter: path of the Python that it runs in.
        provides: formulation -> its capabilities, sorted.
        presets: formulation -> preset -> complete settings.
        summary: one line for a person.
        levels: formulation -> rung of the ladder of models; empty if not declared.
        terms: parts of the model that can be switched on and off.
        inherent: formulation -> term that is always in its model -> reason.
        defaults: its default values.
        oldest: oldest version that its adapter supports; empty: not declared.
        made_for: formulation -> capabilities, sorted; it is offered only to scenes that require one of them. A
            formulation that is missing here is offered to all.
        references: formulation -> its claim to be a reference by steps.
    """

    name: str
    version: str
    interpreter: str
    provides: dict[str, list[str]]
    presets: dict[str, dict[str, dict[str, Any]]]
    summary: str
    levels: dict[str, str]
    terms: list[Term]
    inherent: dict[str, dict[str, str]]
    defaults: dict[str, Any]
    oldest: str = ""
    made_for: dict[str, list[str]] = field(default_factory=dict)
    references: dict[str, Steps] = field(default_factory=dict)


@dataclass(frozen=True)
class EngineFacts:
    """Facts of an engine with some settings, which decide its results.

    Attributes:
        name: of the engine; with ``@`` and the place of its interpreter, if another one, ``mujoco@3.8.1``.
        version: of the engine.
        code: hash of the adapter and of all code that it runs on; a change invalidates stored results; or empty.
        settings: complete settings of the formulation, by name.
        resolution: name of the setting that trades speed for accuracy, ``dt`` or ``rtol``.
        order: declared order of convergence, or None.
        highest: declared order before a scene lowered it; None: not yet asked for a scene.
        lowered: requirement of a scene -> order of convergence with it, see
            :class:`proofroll.core.engine_abilities.LowersOrder`.
        shares: routes of the truth that it shares, see :class:`proofroll.core.engine_abilities.SharesEquations`.
        caveat: part of these settings that is not the engine's own, shown beside its verdicts; empty: none.
        brought: part of the computation that its adapter brings, as ``integrator``; empty: none.
        families: capability -> law that it solves, see :class:`proofroll.core.engine_abilities.TellsFamily`.
        family: clauses on the laws of its model that the scene requires, in one text; may be empty.
        precision: of its arithmetic, see :func:`proofroll.core.engine.precision_of`.
        scheme: integration rule, see :class:`proofroll.core.engine.Scheme`; empty: it declares none.
        level: rung of the ladder of models, see :class:`proofroll.core.engine_abilities.Level`; empty: not declared.
        title: name of the engine for a reader, see :class:`proofroll.core.engine_abilities.HasTitle`.
        witness: True if it cross-checks the truth and is never recommended.
        provides: formulation -> its capabilities, sorted.
        libraries: versions of Python, numpy and scipy, which decide the last digits; in another interpreter also a hash
            of all its packages.
        steps: of a truth that is a reference by steps, engine and formulation of the reference and of its witness, as
            ``name[formulation=…]`` -> version and code.
    """

    name: str
    version: str
    code: str
    settings: dict[str, Any]
    resolution: str | None = None
    order: int | None = None
    highest: int | None = None
    lowered: dict[str, int] = field(default_factory=dict)
    shares: list[str] = field(default_factory=list)
    caveat: str = ""
    brought: str = ""
    families: dict[str, str] = field(default_factory=dict)
    family: str = ""
    precision: str = "double"
    scheme: str = ""
    level: str = ""
    title: str = ""
    witness: bool = False
    provides: dict[str, list[str]] = field(default_factory=dict)
    libraries: dict[str, str] = field(default_factory=dict)
    steps: dict[str, str] = field(default_factory=dict)

    @property
    def step(self) -> float | None:
        """The fixed step [s]; None: it adapts, or there is none."""
        return float(self.settings["dt"]) if self.resolution == "dt" else None

    @property
    def formulated(self) -> str:
        """Engine with its formulation, as a setting."""
        return f"{self.name}[formulation={self.settings.get('formulation')}]"

    def on(self, requires: Collection[str]) -> EngineFacts:
        """Facts for a scene with these requirements: its order of convergence and its laws."""
        laws = dict.fromkeys(clause for need, clause in self.families.items() if need in requires)
        order = lowest(self.order, self.lowered, requires)
        return replace(
            self, order=order, highest=self.highest or self.order, lowered={}, family="; ".join(laws), families={}
        )


@dataclass(frozen=True)
class Case:
    """Request of one run.

    Attributes:
        scene: name of the scene.
        parameters: values of its parameters that differ from the defaults.
        scene_digest: hash of the scene with these parameters.
        engine: the engine with complete settings.
        until, every: last time and sampling interval [s].
        timed: True if the speed is measured in further, clean runs that only advance.
        time_limit: wall time after which the case is ended, without time in which others had the processor [s].
        asks: results wanted besides the motion; see :class:`proofroll.core.scene.Scene`.
        turns: True if further samples are taken where turns of angles have to be counted
            (:func:`proofroll.core.whole_turns.samples_between`). Studies do without, as an adaptive step ends at each.
        between: for the truth, times off the grid at which some engine is sampled [s]
            (:func:`proofroll.core.time_grid.off_grid`); those of an engine follow from its step.
        without_events: True if no events are wanted, so that nothing looks for them in the engine's steps.
    """

    scene: str
    parameters: dict[str, float]
    scene_digest: str
    engine: EngineFacts
    until: float
    every: float
    timed: bool = False
    time_limit: float = TIME_LIMIT
    asks: tuple[str, ...] = ()
    turns: bool = False
    between: tuple[float, ...] = ()
    without_events: bool = False

    @cached_property
    def key(self) -> str:
        """Hash of everything that decides the result; the path of an interpreter is left out, its packages are not."""
        optional = ("asks", "turns", "between", "without_events")
        left_out = {"time_limit", *(name for name in optional if not getattr(self, name))}
        content = {name: value for name, value in asdict(self).items() if name not in left_out}
        content["engine"]["name"] = plain_name(self.engine.name)
        for words in ("level", "title", "witness", "provides", "brought"):  # for people
            del content["engine"][words]
        if not self.engine.steps:
            del content["engine"]["steps"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Case:
        """Inverse of ``dataclasses.asdict``."""
        some = {name: tuple(content.get(name, ())) for name in ("asks", "between")}
        return cls(**{**content, "engine": EngineFacts(**content["engine"]), **some})


@dataclass(frozen=True)
class Result:
    """Result of a case.

    Attributes:
        status: success, or the way in which it failed.
        message: one sentence about it.
        wall_seconds: inside ``advance`` during the sampled run [s].
        build_seconds: of one ``build``, with its compilation [s], or None.
        seconds_per_second: median wall seconds per simulated second of clean runs that only advance, or None.
        timings: of the single clean runs, wall seconds per simulated second.
        certificate: lines of the certificate, as dictionaries.
        versions: of the engine, proofroll, Python, numpy and scipy in the process that ran it.
        trajectory: file of the trajectory in the store, or None if there is none.
        checksum: sha256 of that file.
        spent: wall time of the case by activity [s]; ``advance`` and ``clean runs`` are the engine's. Empty in old
            records.
        processor: processor time of the worker by activity [s], which other processes do not lengthen.
        interpreter: path of the Python that ran it.
        host: name of the machine of a cluster that ran it, where no speed is measured; empty: this machine.
        cut: True if a limit of time ended a truth, which a slower machine would have ended earlier; it is not stored.
    """

    status: Status
    message: str
    wall_seconds: float = 0.0
    build_seconds: float | None = None
    seconds_per_second: float | None = None
    timings: list[float] = field(default_factory=list)
    certificate: list[dict[str, Any]] = field(default_factory=list)
    versions: dict[str, str] = field(default_factory=dict)
    trajectory: str | None = None
    checksum: str | None = None
    spent: dict[str, float] = field(default_factory=dict)
    processor: dict[str, float] = field(default_factory=dict)
    interpreter: str = ""
    host: str = ""
    cut: bool = False

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Result:
        """Inverse of ``dataclasses.asdict``."""
        return cls(**{**content, "status": Status(content["status"])})


def hosts(results: Iterable[Result]) -> dict[str, int]:
    """Machine of a cluster -> number of results that it made; empty if all were made on this machine."""
    return dict(sorted(Counter(result.host for result in results if result.host).items()))


def host_sentences(counts: Mapping[str, int]) -> list[str]:
    """Sentence about results from other machines, see :func:`hosts`; no sentence if there are none."""
    if not counts:
        return []
    names = ", ".join(f"{count} on {name}" for name, count in counts.items())
    return [f"Made on machines of a cluster: {names}. No speed is measured there."]
