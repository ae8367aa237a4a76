"""Engine Drake: a ball with Drake's terms of motion, and mechanisms as continuous or discrete plants."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import Any, ClassVar

from proofroll.adapter import MechanismCapability, Scene
from proofroll_drake import ball, contact, mechanism
from proofroll_drake.ball import DrakeBall
from proofroll_drake.mechanism import DrakeMechanism
from proofroll_drake.settings import PRESETS, DrakeSettings


class Drake:
    """Drake's multibody plant through pydrake. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "drake"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        "terms": ball.PROVIDES,
        "continuous": mechanism.CONTINUOUS,
        "discrete": mechanism.DISCRETE,
        "contact": mechanism.CONTACT,
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {"terms": {}} | mechanism.LACKING
    made_for: ClassVar[Mapping[str, frozenset[str]]] = {"contact": frozenset({MechanismCapability.CONTACT})}
    inherent: ClassVar[Mapping[str, Mapping[str, str]]] = {"terms": ball.INHERENT}
    settings: ClassVar[type[DrakeSettings]] = DrakeSettings
    presets: ClassVar[Mapping[str, Mapping[str, DrakeSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("drake")

    @staticmethod
    def family(settings: DrakeSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return contact.family(settings)

    @staticmethod
    def build(scene: Scene, settings: DrakeSettings) -> Any:
        """See :class:`proofroll.core.engine.Engine`; builds a run of the formulation."""
        kind = DrakeBall if settings.formulation == "terms" else DrakeMechanism
        return kind.build(scene, settings)

    @staticmethod
    def caveat(settings: DrakeSettings) -> str:
        """See :class:`proofroll.core.engine_abilities.TellsCaveats`."""
        return "rolling and integration are ours, around Drake's terms" if settings.formulation == "terms" else ""
