"""Subject of a check: an engine on a scene; distance of two states; causes of a wrong motion."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, TypeVar
from unittest import SkipTest

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import ROUNDINGS, certify
from proofroll.core.dataset import from_samples
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.engine import EPSILON, Sample, precision_of
from proofroll.core.engine_abilities import MadeFor, offered
from proofroll.core.errors import Diverged, InputError, Missing, Refused
from proofroll.core.multi_element import build
from proofroll.core.plugins import load_element_kinds
from proofroll.core.scene import Scene

T = TypeVar("T")
# Simulated time of a check of the motion [s]: the ball goes a sixth of a turn round the cylinder.
_SPAN = 0.05
# Number of samples of a run for the diagnosis, and their number per natural time: splines through them resolve it.
_SAMPLES, _PART = 36, 100


def scenes() -> dict[str, Scene]:
    """Conformance scenes of all kinds of elements, by name; those of each kind start with the most demanding."""
    return {name: scene for kind in load_element_kinds() for name, scene in _made(kind.conformance_scenes).items()}


def truth_scenes() -> dict[str, Scene]:
    """Scenes of all kinds of elements that reveal confused reference frames, by name."""
    return {name: scene for kind in load_element_kinds() for name, scene in _made(kind.truth_scenes).items()}


def contrasts() -> dict[str, tuple[Scene, Scene]]:
    """Scenes in whose run one law acts, with the same scene without it, of kinds that have such, by the law's name."""
    kinds = [kind for kind in load_element_kinds() if hasattr(kind, "contrasts")]
    return {name: scenes for kind in kinds for name, scenes in _made(kind.contrasts).items()}


def alike_scenes() -> dict[str, Sequence[Scene]]:
    """Scenes of one structure, the last one with velocities that overflow, of kinds that have such, by name."""
    kinds = [kind for kind in load_element_kinds() if hasattr(kind, "alike_scenes")]
    return {name: scenes for kind in kinds for name, scenes in _made(kind.alike_scenes).items()}


@cache
def _made(by: Callable[[], Mapping[str, T]]) -> Mapping[str, T]:
    return by()


def lacking_capabilities(engine: Any, formulation: str, scene: Scene) -> frozenset[str]:
    """Capabilities that the scene requires and the formulation does not provide."""
    provides = engine.provides.get(formulation, ()) if isinstance(engine.provides, Mapping) else ()
    return scene.requires - frozenset(provides)


def checked_on(engine: Any, formulation: str, scene: Scene) -> bool:
    """True if the formulation provides what the scene requires, and is offered for it."""
    purposes = engine.made_for if isinstance(engine, MadeFor) else {}
    return not lacking_capabilities(engine, formulation, scene) and offered(formulation, scene.requires, purposes)


def require(condition: object, message: str) -> None:
    """Raises AssertionError with this message unless the condition holds."""
    if not condition:
        raise AssertionError(message)


@dataclass(frozen=True)
class Subject:
    """An engine with settings on a scene.

    Attributes:
        engine: the engine's class.
        settings: complete settings.
        scene: the simulated scene.
    """

    engine: Any
    settings: Any
    scene: Scene

    def build(self) -> Any:
        """Engine with the scene at time 0; raises SkipTest if it refuses the scene."""
        try:
            return build(self.engine, self.scene, self.settings)
        except (Refused, Missing) as refusal:
            raise SkipTest(f"refused: {refusal}") from None

    def at(self, t: float) -> Any:
        """Engine newly built and advanced to time ``t`` [s] at once."""
        engine = self.build()
        engine.advance(t)
        return engine

    def samples(self, times: FloatArray) -> list[Sample]:
        """Samples of the engine at times [s]; the first time is 0."""
        engine = self.build()
        samples = [engine.sample()]
        for t in times[1:].tolist():
            engine.advance(t)
            samples.append(engine.sample())
        return samples

    def finer(self, factor: float) -> Subject:
        """Subject with its resolution (step or tolerance) multiplied by ``factor``."""
        name = self.settings.resolution
        value = getattr(self.settings, name) * factor
        return dataclasses.replace(self, settings=dataclasses.replace(self.settings, **{name: value}))

    @property
    def fixed_step(self) -> bool:
        """True if the resolution is a step rather than a tolerance."""
        return bool(self.settings.resolution == "dt")

    def span(self, parts: int, at_least: float = _SPAN) -> float:
        """Time [s] of at least ``at_least`` [s] that is ``parts`` equal numbers of whole steps."""
        if not self.fixed_step:
            return at_least
        step = float(self.settings.dt)
        return math.ceil(at_least / (parts * step)) * parts * step

    @property
    def epsilon(self) -> float:
        """Machine epsilon of the engine's arithmetic."""
        return EPSILON[precision_of(self.settings)]

    @property
    def closeness(self) -> float:
        """Largest :meth:`distance` of two runs of one motion, made with different calls of ``advance``.

        With a fixed step both make the same steps: solvers of implicit steps leave about 1e-8, a lost or doubled step
        1e-2. With a tolerance, some hundred steps each contribute about the tolerance.
        """
        if self.settings.resolution is None:
            distance = 1e-9
        else:
            distance = (
                1e-7 if self.fixed_step else max(1e-9, 1e3 * float(getattr(self.settings, self.settings.resolution)))
            )
        return max(distance, ROUNDINGS * self.epsilon)

    def distance(self, sample: Sample, rival: Sample) -> float:
        """Largest difference of two states, in units of the scene (:meth:`scaled`)."""
        return float(np.max(np.abs(self.scaled(sample) - self.scaled(rival))))

    def scaled(self, sample: Sample) -> FloatArray:
        """Position, velocity and angular velocity of a sample in units of the scene, shape (numbers,)."""
        length = max(element.length for element in self.scene.elements)
        start = float(np.max(np.abs(self.start.v_WB)))
        speed = start or length / self.scene.natural_time
        parts = (sample.p_WB / length, sample.v_WB / speed, sample.w_WB * length / speed)
        return np.concatenate([np.ravel(part) for part in parts])

    @cached_property
    def start(self) -> Sample:
        """Sample at time 0."""
        sample: Sample = self.build().sample()
        return sample


def bits(sample: Sample) -> bytes:
    """All numbers of a sample as bytes, for an exact comparison."""
    parts = (getattr(sample, item.name) for item in dataclasses.fields(sample))
    return b"".join(np.asarray(part, dtype=np.float64).tobytes() for part in parts if part is not None)


class UnlikeSceneError(AssertionError):
    """Difference between the scene and an engine's model or motion; :func:`failure_message` adds its causes."""

    def __init__(self, subject: Subject, sentence: str) -> None:
        super().__init__(sentence)
        self.subject = subject


def failure_message(error: UnlikeSceneError) -> str:
    """Message of a failed check, with the proven causes of the difference, if there are any."""
    from proofroll.core.truth import truth

    subject, sentence = error.subject, str(error)
    scene, step = subject.scene, subject.settings.dt if subject.fixed_step else None
    interval = scene.natural_time / _PART
    if step is not None:
        interval = max(math.floor(interval / step), 1) * step
    times = np.asarray(interval * np.arange(_SAMPLES), dtype=np.float64)
    try:
        lines = [line.as_dict() for line in certify(subject.build(), scene, subject.settings)]
        causes = [] if all(line["holds"] for line in lines) else diagnose_scene(scene, lines, step=step)
        if not causes:
            run = from_samples(scene, times, subject.samples(times))
            causes = diagnose_scene(scene, lines, run, truth(scene, times), step)
    except (Diverged, Missing, Refused, InputError):
        return sentence  # there is no run to diagnose
    except Exception as behind:  # any error of the engine, on a longer run than the check made
        return f"{sentence}\nno cause was found: {type(behind).__name__}: {behind}"
    return "\n".join([sentence, *(f"cause: {item.sentence}: {item.cause.remedy}" for item in causes)])
