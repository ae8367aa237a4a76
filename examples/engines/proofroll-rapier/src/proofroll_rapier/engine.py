"""Engine Rapier: rigid bodies of a game engine in Rust, by its Python wheel."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping
from typing import ClassVar

from proofroll.adapter import Family, Scene, of_contact
from proofroll_rapier.mechanism import LACKING, PROVIDES, RapierMechanism
from proofroll_rapier.settings import PRESETS, RapierSettings


class Rapier:
    """Rapier through its Python module. See :class:`proofroll.core.engine.Engine`."""

    name: ClassVar[str] = "rapier"
    title: ClassVar[str] = "Rapier"
    provides: ClassVar[Mapping[str, frozenset[str]]] = PROVIDES
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = dict.fromkeys(PROVIDES, LACKING)
    settings: ClassVar[type[RapierSettings]] = RapierSettings
    presets: ClassVar[Mapping[str, Mapping[str, RapierSettings]]] = PRESETS

    @staticmethod
    def version() -> str:
        """Version of the package."""
        return importlib.metadata.version("rapier3d")

    @staticmethod
    def family(_: RapierSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.ANISOTROPIC)

    @staticmethod
    def build(scene: Scene, settings: RapierSettings) -> RapierMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return RapierMechanism.build(scene, settings)
