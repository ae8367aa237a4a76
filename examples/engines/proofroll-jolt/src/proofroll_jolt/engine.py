"""Engine Jolt: rigid bodies of a game engine in C++, by the Python wheel culverin."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import ClassVar

from proofroll.adapter import Scene
from proofroll_jolt.mechanism import LACKING, PROVIDES, JoltMechanism
from proofroll_jolt.settings import PRESETS, JoltSettings


class Jolt:
    """Jolt Physics through culverin. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "jolt"
    title: ClassVar[str] = "Jolt"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"impulse": PROVIDES}
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = {"impulse": LACKING}
    settings: ClassVar[type[JoltSettings]] = JoltSettings
    presets: ClassVar[Mapping[str, Mapping[str, JoltSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package, which tells none of Jolt."""
        return "culverin " + importlib.metadata.version("culverin")

    @staticmethod
    def build(scene: Scene, settings: JoltSettings) -> JoltMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return JoltMechanism.build(scene, settings)
