"""One case: a scene with numbers, in an engine with settings, over a time grid; and what came of it."""

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
    from proofroll.core.engine_abilities import Term


class Status(StrEnum):
    """Status of a case at its end."""

    DONE = "done"
    DIVERGED = "diverged"
    REFUSED = "refused"  # the engine says that it cannot represent the scene
    WRONG_MODEL = "wrong model"  # what the engine built is not the scene, so it was not run (certificate)
    ANOTHER_SCENE = "another scene"  # it ran, but what it ran is not this scene (KnowsAnotherScene)
    NO_TRUTH = "no truth"  # it ran, but there is no truth to hold it against
    MISSING = "missing"
    CRASHED = "crashed"
    TIMEOUT = "timeout"
    LEFT_OUT = "left out"  # the processor time of a study did not suffice (TimeBudget)


# A crash, a hang or a missing engine may be gone next time; these are the engine's answer and stay.
LASTING = frozenset({Status.DONE, Status.DIVERGED, Status.REFUSED, Status.WRONG_MODEL})


@dataclass(frozen=True)
class EngineDescription:
    """Description of an engine before any settings are chosen.

    Attributes:
        name: of the engine, with the place of another interpreter in which it runs, ``mujoco@3.8.1``.
        version: of the engine.
        interpreter: path of the Python that it runs in.
        provides: formulation -> what it can represent, sorted.
        presets: formulation -> preset -> complete settings.
        summary: one line for a person.
        levels: formulation -> rung of the ladder of models; empty if not declared.
        terms: parts of the model that can be switched on and off.
        inherent: formulation -> what is always in its model -> why.
        defaults: its default values.
        oldest: version from which on its adapter supports it; empty: not declared.
        made_for: formulation -> capabilities, sorted; it is offered to scenes that require one of them. None: to all.
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


@dataclass(frozen=True)
class EngineFacts:
    """Facts of an engine with some settings.

    Attributes:
        name: of the engine, with the place of another interpreter in which it runs, ``mujoco@3.8.1``.
        version: of the engine.
        code: hash of the adapter and of everything that it runs on, so that stored results never outlive a change.
        settings: complete settings of the formulation, by name.
        resolution: name of the setting that trades speed for accuracy, ``dt`` or ``rtol``.
        order: declared order of convergence, or None.
        highest: order where the scene does not lower it; None: as declared.
        lowered: requirement of a scene -> order of convergence with it, see
            :class:`proofroll.core.engine_abilities.LowersOrder`.
        shares: routes of the truth that it shares, see :class:`proofroll.core.engine_abilities.SharesEquations`.
        caveat: part of these settings that is not the engine's own, shown beside its verdicts; empty: none.
        families: of the laws that it solves, see :class:`proofroll.core.engine_abilities.TellsFamily`.
        family: those of them that a scene asks for; empty: none.
        precision: in which it computes, see :func:`proofroll.core.engine.precision_of`.
        scheme: rule of its steps, see :class:`proofroll.core.engine.Scheme`; empty: it declares none.
        libraries: versions of Python, numpy and scipy, on which the last digits hang; in another interpreter also a
            hash of all its packages.
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
    families: dict[str, str] = field(default_factory=dict)
    family: str = ""
    precision: str = "double"
    scheme: str = ""
    libraries: dict[str, str] = field(default_factory=dict)

    @property
    def step(self) -> float | None:
        """The fixed step [s]; None: it adapts, or there is none."""
        return float(self.settings["dt"]) if self.resolution == "dt" else None

    def on(self, requires: Collection[str]) -> EngineFacts:
        """Facts with the order of convergence and the laws for a scene with these requirements."""
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
        timed: whether a second, clean run that only advances is timed.
        time_limit: seconds after which the case is ended, but for those in which others had the processor [s].
        asks: results wanted besides the motion; see :class:`proofroll.core.scene.Scene`.
        turns: whether samples are taken between those every ``every`` where turns of angles have to be counted
            (:func:`proofroll.core.turns.samples_between`); no study needs that, and an adaptive step ends at each.
        between: of the truth, times off the grid at which some engine is sampled [s]
            (:func:`proofroll.core.time_grid.off_grid`); an engine's follow from its step.
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

    @cached_property
    def key(self) -> str:
        """Hash of all that decides the result; where an interpreter lies does not, what it has does."""
        left_out = {"time_limit", *(name for name in ("asks", "turns", "between") if not getattr(self, name))}
        content = {name: value for name, value in asdict(self).items() if name not in left_out}
        content["engine"]["name"] = plain_name(self.engine.name)
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:24]

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Case:
        """The case again from ``asdict``."""
        some = {name: tuple(content.get(name, ())) for name in ("asks", "between")}
        return cls(**{**content, "engine": EngineFacts(**content["engine"]), **some})


@dataclass(frozen=True)
class Result:
    """Result of a case.

    Attributes:
        status: success, or the way in which it failed.
        message: one sentence about it.
        wall_seconds: inside ``advance`` during the sampled run [s].
        build_seconds: before the first step: one ``build`` with what it compiles [s], or None.
        seconds_per_second: median wall seconds per simulated second of clean runs that only advance, or None.
        timings: of the single clean runs, wall seconds per simulated second.
        certificate: lines of the certificate, as dictionaries.
        versions: of the engine, of proofroll, Python, numpy and scipy, as the process that ran it has them.
        trajectory: file of the trajectory in the store, or None if there is none.
        checksum: sha256 of that file.
        spent: where the wall time of the case went, by cause [s]; ``advance`` and ``clean runs`` are the engine's.
            Empty in records from before it was measured.
        processor: the same in seconds of the worker's processor, which others on the machine do not lengthen [s].
        interpreter: path of the Python that ran it.
        host: name of the machine of a cluster on which it ran, where no speed is measured; empty: it ran at home.
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

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Result:
        """The result again from ``asdict``."""
        return cls(**{**content, "status": Status(content["status"])})


def hosts(results: Iterable[Result]) -> dict[str, int]:
    """Machine of a cluster -> how many of the results it made; empty where all were made here."""
    return dict(sorted(Counter(result.host for result in results if result.host).items()))


def told_hosts(counts: Mapping[str, int]) -> list[str]:
    """A sentence about results from other machines, see :func:`hosts`; none where there are none."""
    if not counts:
        return []
    names = ", ".join(f"{count} on {name}" for name, count in counts.items())
    return [f"Made on machines of a cluster: {names}. No speed is measured there."]
