"""An engine on a scene of several elements: one independent model for each, as no force couples elements."""

import dataclasses
from collections.abc import Collection, Iterator, Mapping, Sequence
from enum import Enum
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.controlled_engine import CommandedEngine, bare, commanded
from proofroll.core.element import Element
from proofroll.core.engine import Sample, fixed_step
from proofroll.core.engine_abilities import LocatesEvents, TellsRemarks, WatchesEvents, require_provided
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.core.plugins import resolve_settings
from proofroll.core.scene import Scene

AnySample = Sample | Mapping[str, Sample]
"""Sample of a scene; with several elements one sample for each, by the element's name."""

# Arrays of a sample that every engine gives.
REQUIRED = ("p_WB", "v_WB", "w_WB")


class IndependentElements:
    """Elements of a scene in separate models, by element name, advanced together."""

    def __init__(self, kind: Any, scene: Scene, settings: Any) -> None:
        self.parts, self._others = {}, []
        self.steps: list[float | None] = []
        for element, alone in zip(scene.elements, each_alone(scene), strict=True):
            chosen = _settings_for(kind, alone, settings)
            require_provided(kind, chosen.formulation, alone)
            self.parts[element.name] = commanded(kind.build(alone.for_an_engine, chosen), element, fixed_step(chosen))
            self.steps.append(fixed_step(chosen))
            if chosen.formulation != settings.formulation:
                self._others.append(f"{element.name} is in formulation {chosen.formulation}, preset {chosen.preset}")
        if len(self._others) == len(self.parts):
            raise Refused(f"formulation {settings.formulation} represents no element of this scene")

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for part in self.parts.values():
            part.advance(t)

    def sample(self) -> Mapping[str, Sample]:
        """One sample for each element, by its name."""
        return {name: part.sample() for name, part in self.parts.items()}

    def built(self) -> Mapping[str, Any]:
        """The engine's account of each element's model, by the element's name."""
        return {name: part.built() for name, part in self.parts.items()}

    def remarks(self) -> Sequence[str]:
        """Remarks of all parts, and the elements that were built in another formulation."""
        telling = [part for part in map(bare, self.parts.values()) if isinstance(part, TellsRemarks)]
        return [*self._others, *(remark for part in telling for remark in part.remarks())]


def each_alone(scene: Scene) -> list[Scene]:
    """Scenes of one element each, with the questions that concern it."""
    return [
        dataclasses.replace(scene, elements=(element,), asks=tuple(filter(element.askable.get, scene.asks)))
        for element in scene.elements
    ]


def formulation_for(requires: Collection[str], formulation: str, provides: Mapping[str, Collection[str]]) -> str | None:
    """Formulation that builds an element in a run of the given formulation.

    It is the run's own if that provides all. If the run's formulation knows no capability of this kind of element at
    all, it is the first formulation of the engine that provides all.

    Args:
        requires: capabilities that the element alone requires.
        formulation: of the run.
        provides: capabilities of each formulation of the engine.

    Returns:
        None if there is none.
    """
    if set(requires) <= set(provides[formulation]):
        return formulation
    kinds = {kind for need in requires for kind in (type(need) if isinstance(need, Enum) else (need,))}
    if kinds & set(provides[formulation]):
        return None
    return next((name for name, capabilities in provides.items() if set(requires) <= set(capabilities)), None)


def represents(scene: Scene, formulation: str, provides: Mapping[str, Collection[str]]) -> bool:
    """True if every element can be built in a run of the formulation, and at least one in the formulation itself."""
    formulations = [formulation_for(alone.requires, formulation, provides) for alone in each_alone(scene)]
    return None not in formulations and formulation in formulations


def build(kind: Any, scene: Scene, settings: Any) -> Any:
    """Engine at time 0 with a copy of the scene.

    Raises:
        Refused: the formulation does not provide what the scene requires, or cannot represent it.
    """
    if len(scene.elements) > 1:
        return IndependentElements(kind, scene, settings)
    require_provided(kind, settings.formulation, scene)
    return commanded(kind.build(scene.for_an_engine, settings), scene.elements[0], fixed_step(settings))


def asking(engine: Any) -> tuple[float, float]:
    """Wall and processor time that an engine's controllers took so far [s]; not the engine's own."""
    spent = [part.asking for part in _parts(engine) if isinstance(part, CommandedEngine)]
    return sum(wall for wall, _ in spent), sum(processor for _, processor in spent)


def watch_events(engine: Any) -> None:
    """Lets an engine look for events in its steps (:class:`proofroll.core.engine_abilities.WatchesEvents`)."""
    for part in _parts(engine):
        if isinstance(model := bare(part), WatchesEvents):
            model.watch_events()


def _parts(engine: Any) -> Collection[Any]:
    return engine.parts.values() if isinstance(engine, IndependentElements) else [engine]


def step_of(engine: Any, settings: Any) -> float | None:
    """Largest fixed step of the models of an engine [s]; None: all adapt their steps."""
    steps = engine.steps if isinstance(engine, IndependentElements) else [fixed_step(settings)]
    return max((step for step in steps if step is not None), default=None)


def _settings_for(kind: Any, alone: Scene, settings: Any) -> Any:
    """Settings for one element: the given ones, or those of the formulation that :func:`formulation_for` chooses.

    The latter have the same preset, if the formulation has it, and the same step.
    """
    provides = {name: kind.provides[name] for name in kind.presets}
    name = formulation_for(alone.requires, settings.formulation, provides)
    if name in {None, settings.formulation}:
        return settings
    presets = kind.presets[name]
    options = {"formulation": name} | ({"preset": settings.preset} if settings.preset in presets else {})
    resolved = resolve_settings(kind, options)
    step = fixed_step(settings)
    return resolved if step is None or fixed_step(resolved) is None else dataclasses.replace(resolved, dt=step)


def sample_of(scene: Scene, element: Element, sample: AnySample) -> Sample:
    """Part of a sample that belongs to one element. Raises Diverged if it is missing or of the wrong type."""
    if len(scene.elements) == 1 and isinstance(sample, element.sample_type):
        return sample  # the usual case, without the slow test for a mapping
    state = sample.get(element.name, sample) if isinstance(sample, Mapping) else sample
    if not isinstance(state, element.sample_type) or (state is sample and len(scene.elements) > 1):
        addition = " for each element, by its name" if len(scene.elements) > 1 else ""
        type_name = element.sample_type.__name__
        raise Diverged(f"the engine's sample() gave {type(state).__name__} instead of a {type_name}{addition}")
    return state


def arrays(scene: Scene, sample: AnySample, t: float) -> Iterator[tuple[str, FloatArray]]:
    """Every array of a sample at time ``t`` [s] with its name.

    Raises:
        Diverged: one is missing, is not of real numbers, or does not have the shape for the scene's bodies.
    """
    for element in scene.elements:
        state, bodies = sample_of(scene, element, sample), len(element.bodies)
        for name, width in state.widths.items():
            value = getattr(state, name)
            if value is None and name not in REQUIRED:
                continue
            try:
                values = np.asarray(value)
            except ValueError:  # rows of different lengths
                values = np.asarray(None)
            if values.dtype.kind not in "fiu":
                raise Diverged(f"the engine gave {name}, which is no array of real numbers at {t:g} s")
            shape = (width,) if bodies == 1 else (bodies, width)
            if values.shape not in {shape, (bodies, width)}:
                raise Diverged(f"the engine gave {name} with shape {values.shape} instead of {shape} at {t:g} s")
            yield name, values


def shaped(scene: Scene, sample: AnySample, t: float) -> AnySample:
    """The sample itself, after its shapes were checked; raises as :func:`arrays`."""
    for _ in arrays(scene, sample, t):
        pass
    return sample


def copied(sample: AnySample) -> AnySample:
    """The sample with arrays of its own, for an engine may fill its arrays anew at its next step."""
    if isinstance(sample, Mapping):
        return {name: _copied(state) if isinstance(state, Sample) else state for name, state in sample.items()}
    return _copied(sample)


def _copied(sample: Sample) -> Sample:
    members = ((item.name, getattr(sample, item.name)) for item in dataclasses.fields(sample))
    return dataclasses.replace(
        sample, **{name: np.array(values) for name, values in members if isinstance(values, np.ndarray)}
    )


def events_of_engine(engine: Any, element: Element) -> Sequence[Event] | None:
    """Events located by the engine for an element (:class:`proofroll.core.engine_abilities.LocatesEvents`), or None.

    Raises:
        Diverged: the engine gave something else than events.
    """
    part = bare(engine.parts[element.name] if isinstance(engine, IndependentElements) else engine)
    if not isinstance(part, LocatesEvents):
        return None
    located = part.events()
    if located is None:
        return None
    if not (isinstance(located, Sequence) and all(isinstance(event, Event) for event in located)):
        raise Diverged("the engine's events() gave something else than a sequence of Event")
    return list(located)
