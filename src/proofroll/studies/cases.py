"""The one place that makes cases."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from proofroll.core.scene import Scene
from proofroll.running.case import Case, EngineFacts


def case_of(
    name: str, scene: Scene, given: Iterable[str], engine: EngineFacts, until: float, every: float, **others: Any
) -> Case:
    """A case of any study, on a scene that was loaded with what it is asked and with the parameters ``given``.

    Times are those of :class:`proofroll.running.case.Case` [s], ``others`` its fields that have defaults.
    """
    parameters = {parameter: scene.parameters[parameter] for parameter in given}
    return Case(name, parameters, scene.digest, engine, until, every, asks=scene.asks, **others)
