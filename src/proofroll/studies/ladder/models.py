"""Models for a scene: rungs of the ladder, terms to switch in each, and whether a term is needed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from proofroll.core.dataset import part
from proofroll.core.engine_abilities import Level, offered
from proofroll.core.errors import ProofrollError
from proofroll.core.multi_element import represents
from proofroll.core.number_format import number
from proofroll.core.scene import Scene
from proofroll.running.case import EngineDescription
from proofroll.running.timing import Interval, interval_text

if TYPE_CHECKING:
    import xarray as xr

# A ratio of costs below this saves nothing.
_FELT = 1.02
# A change by less than this part of the quantity's size is accumulated round-off.
_ROUND_OFF = 1e-9


@dataclass(frozen=True)
class LadderModel:
    """An engine with options, on the scene with some parameters.

    Attributes:
        engine: its name.
        options: settings that override the preset; formulation and preset are among them.
        parameters: of the scene, which override the given ones.
        asks: results wanted besides the motion.
    """

    engine: str
    options: Mapping[str, Any]
    parameters: Mapping[str, float] = field(default_factory=dict)
    asks: tuple[str, ...] = ()

    @property
    def formulation(self) -> str:
        """Name of the engine's model."""
        return str(self.options["formulation"])


@dataclass(frozen=True)
class Rung:
    """A model of the ladder.

    Attributes:
        level: its level.
        model: the model to run; None if there is none.
        variant: its difference from the formulation's own model, e.g. ``condim=4``; empty for that one.
        message: reason why there is no model.
    """

    level: Level
    model: LadderModel | None
    variant: str = ""
    message: str = ""


@dataclass(frozen=True)
class Switch:
    """A term of a model, to be compared with and without it.

    Attributes:
        term: name for a person.
        kind: ``scene`` or ``engine``.
        model: the model in which it is switched.
        on, off: the model with and without it; None if it cannot be left out.
        because: purpose of the term.
    """

    term: str
    kind: str
    model: LadderModel
    on: LadderModel | None
    off: LadderModel | None
    because: str


def rungs(engines: Mapping[str, EngineDescription | ProofrollError], requires: frozenset[str]) -> list[Rung]:
    """Rungs from the simplest to the fullest model: each formulation, with its preset ``matched`` or its first one."""
    ladder: list[Rung] = []
    for level in Level:
        count = len(ladder)
        for description in engines.values():
            if isinstance(description, ProofrollError):
                continue
            for formulation, presets in description.presets.items():
                fits = requires & set(description.provides[formulation]) and offered(
                    formulation, requires, description.made_for
                )
                if description.levels.get(formulation) != level or not fits:
                    continue
                preset = "matched" if "matched" in presets else next(iter(presets))
                model = LadderModel(description.name, {"formulation": formulation, "preset": preset})
                ladder.append(Rung(level, model))
                for term in description.terms:
                    if term.rung and formulation in term.formulations:
                        variant = ",".join(f"{key}={value}" for key, value in term.on.items())
                        ladder.append(Rung(level, _with(model, term.on), variant))
        if len(ladder) == count:
            ladder.append(Rung(level, None, message="no engine that was asked has a model of this level"))
    return ladder


def _with(model: LadderModel, options: Mapping[str, Any]) -> LadderModel:
    return LadderModel(model.engine, {**model.options, **options}, model.parameters, model.asks)


def switches(
    ladder: Sequence[Rung], engines: Mapping[str, EngineDescription | ProofrollError], scene: Scene, truth: xr.Dataset
) -> list[Switch]:
    """Models with and without each optional term.

    Terms of the scene are switched in one model of each engine and level, terms of an engine in each model that has
    them. Models that cannot represent the scene are left out.
    """
    switches_of_terms: list[Switch] = []
    models = [
        (rung.level, rung.model)
        for rung in ladder
        if rung.model is not None
        and not rung.variant
        and isinstance(told := engines[rung.model.engine], EngineDescription)
        and represents(scene, rung.model.formulation, told.provides)
    ]
    seen: set[tuple[str, Level]] = set()
    for level, model in models:
        description = engines[model.engine]
        assert isinstance(description, EngineDescription)  # it has a rung
        if (model.engine, level) not in seen:
            switches_of_terms += _of_the_scene(model, scene, truth, description.inherent.get(model.formulation, {}))
        seen.add((model.engine, level))
    for _, model in models:
        description = engines[model.engine]
        assert isinstance(description, EngineDescription)
        switches_of_terms += [
            Switch(
                term=term.name,
                kind="engine",
                model=model,
                on=_with(model, term.on),
                off=_with(model, term.off),
                because=term.because,
            )
            for term in description.terms
            if model.formulation in term.formulations
        ]
    return switches_of_terms


def _of_the_scene(model: LadderModel, scene: Scene, truth: xr.Dataset, inherent: Mapping[str, str]) -> list[Switch]:
    """Switches for the optional terms of the scene's elements."""
    switches_of_terms: list[Switch] = []
    for element in scene.elements:
        for term in element.optional_terms(scene.parameters, part(scene, element, truth)):
            if term.capability in inherent:
                switches_of_terms.append(
                    Switch(
                        term=term.name, kind="scene", model=model, on=None, off=None, because=inherent[term.capability]
                    )
                )
            elif not term.asks or not scene.asks:
                on = LadderModel(model.engine, model.options, term.put, term.asks)
                off = LadderModel(model.engine, model.options, term.taken)
                switches_of_terms.append(
                    Switch(term=term.name, kind="scene", model=model, on=on, off=off, because=term.because)
                )
    return switches_of_terms


class Need(StrEnum):
    """Need of a term; the value is a text for a person."""

    NEEDED = "needed"
    NOT_NEEDED = "paid for, not needed"
    FREE = "free"
    HARMFUL = "harmful"
    INHERENT = "inherent"
    NO_ANSWER = "no answer"


@dataclass(frozen=True)
class Ran:
    """A model that was run.

    Attributes:
        settings: None if the engine could not be asked.
        status, message: end of the run.
        error: of the quantity; None if there is no answer.
        seconds_per_second: wall time per simulated second; None if unknown.
    """

    settings: dict[str, Any] | None
    status: str
    message: str
    error: float | None
    seconds_per_second: Interval | None

    @property
    def ending(self) -> str:
        """Status and message of the run."""
        return f"{self.status}, {self.message}"


def need_of_term(
    on: Ran, off: Ran, change: float | None, cost: Interval | None, *, tolerance: float | None, bar: float, scale: float
) -> tuple[Need, str]:
    """Need of a term, and its reason.

    A term is needed if leaving it out changes the quantity by more than the tolerance. Without a tolerance the limit is
    the smaller of the two errors, and at least round-off. The limit is never below the truth's error bar.

    Args:
        on: the model with the term, compared with the truth that has it.
        off: the model without it.
        change: of the quantity between the two; None if one of them has no answer.
        cost: ratio of the run times with and without the term; None: unknown.
        tolerance: allowed error; None: see above.
        bar: error bar of the truth.
        scale: size of the quantity.
    """
    if on.error is None or on.error > scale:
        fault = on.ending if on.error is None else f"the answer is off by {number(on.error)}, more than its whole size"
        return Need.NO_ANSWER, f"with it: {fault}"
    if off.error is None or change is None:
        return Need.NEEDED, f"without it: {off.ending}"
    limit = max(bar, max(min(on.error, off.error), _ROUND_OFF * scale) if tolerance is None else tolerance)
    allowed = f"{'the error that is left anyway' if tolerance is None else 'the tolerance'}, {number(limit)}"
    if change > limit:
        if off.error > on.error:
            return Need.NEEDED, f"without it the answer moves by {number(change)}, more than {allowed}"
        return Need.HARMFUL, f"without it the error falls from {number(on.error)} to {number(off.error)}"
    moved = f"without it the answer moves by {number(change)}, no more than {allowed}"
    if cost is None:
        return Need.FREE, f"{moved}; its price is not known"
    interval = f"{cost.low:.2f} … {cost.high:.2f}, {interval_text(cost.confidence)}"
    price = f"it takes {cost.value:.2f} times as long with it ({interval})"
    return (Need.NOT_NEEDED if cost.low > _FELT else Need.FREE), f"{moved}; {price}"
