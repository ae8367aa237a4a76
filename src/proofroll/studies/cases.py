"""The one place that makes cases."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from proofroll.core.scene import Scene
from proofroll.running.case import Case, EngineFacts


def case_of(
    name: str, scene: Scene, given: Iterable[str], engine: EngineFacts, until: float, every: float, **others: Any
) -> Case:
    """A case of any study.

    Args:
        name: of the scene, or its path.
        scene: loaded with these parameters and questions.
        given: names of its parameters that are not left at their defaults.
        engine: with complete settings.
        until: last time [s].
        every: sampling interval [s].
        **others: fields of :class:`proofroll.running.case.Case` that have defaults, but what the scene says itself.
    """
    parameters = {parameter: scene.parameters[parameter] for parameter in given}
    return Case(name, parameters, scene.digest, engine, until, every, asks=scene.asks, **others)
