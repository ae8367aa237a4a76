"""An engine on a scene: one model of a scene of one element, or, as no force couples elements, a model of each."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from proofroll.core.element import Element
from proofroll.core.engine import Sample
from proofroll.core.engine_abilities import LocatesEvents, TellsRemarks, require_provided
from proofroll.core.events import Event
from proofroll.core.scene import Scene

AnySample = Sample | Mapping[str, Sample]
"""What an engine samples: of a scene of several elements one sample for each, by its name."""


class EachAlone:
    """The elements of a scene in models of their own, advanced together; by the names of the elements."""

    def __init__(self, kind: Any, scene: Scene, settings: Any) -> None:
        self.parts = {
            element.name: kind.build(
                dataclasses.replace(scene, elements=(element,), asks=tuple(filter(element.asked, scene.asks))), settings
            )
            for element in scene.elements
        }

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        for part in self.parts.values():
            part.advance(t)

    def sample(self) -> Mapping[str, Sample]:
        """One for each element."""
        return {name: part.sample() for name, part in self.parts.items()}

    def built(self) -> Mapping[str, Any]:
        """One for each element."""
        return {name: part.built() for name, part in self.parts.items()}

    def remarks(self) -> Sequence[str]:
        """Those of all."""
        telling = [part for part in self.parts.values() if isinstance(part, TellsRemarks)]
        return [remark for part in telling for remark in part.remarks()]


def build(kind: Any, scene: Scene, settings: Any) -> Any:
    """The scene in an engine at time 0.

    Raises:
        Refused: the formulation does not provide what the scene requires, or cannot represent it.
    """
    require_provided(kind, settings.formulation, scene)
    return kind.build(scene, settings) if len(scene.elements) == 1 else EachAlone(kind, scene, settings)


def sample_of(scene: Scene, element: Element, sample: AnySample) -> Sample:
    """The part of a sample that belongs to one element."""
    if isinstance(sample, Sample):
        assert len(scene.elements) == 1  # of several, a sample is a mapping
        return sample
    return sample[element.name]


def events_of_engine(engine: Any, element: Element) -> Sequence[Event] | None:
    """What the engine located for an element (:class:`proofroll.core.engine_abilities.LocatesEvents`), or None."""
    part = engine.parts[element.name] if isinstance(engine, EachAlone) else engine
    return list(part.events()) if isinstance(part, LocatesEvents) else None
