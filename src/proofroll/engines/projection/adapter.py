"""Engine adapter of the projection method."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import proofroll
from proofroll.core.engine_abilities import Level, Term
from proofroll.core.heyoka_library import with_heyoka
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.engines.projection.settings import PRESETS, ProjectionSettings
from proofroll.engines.projection.smooth import mechanism
from proofroll.engines.projection.smooth.mechanism import ProjectionMechanism

ELIMINATION = "elimination of violations"  # a term


class Projection:
    """Blajer's projection method for mechanisms."""

    name: ClassVar[str] = "projection"
    title: ClassVar[str] = "projection solver"
    witness: ClassVar[bool] = True
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"dependent": mechanism.PROVIDES}
    settings: ClassVar[type[ProjectionSettings]] = ProjectionSettings
    presets: ClassVar[Mapping[str, Mapping[str, ProjectionSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {"dependent": Level.CONSTRAINT}
    terms: ClassVar[Sequence[Term]] = (
        Term(
            name=ELIMINATION,
            formulations=tuple(PRESETS),
            on={"elimination": True},
            off={"elimination": False},
            because="takes away the violation of the constraints that a step leaves (Blajer 2002)",
        ),
    )

    @staticmethod
    def family(_: ProjectionSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.HARD)

    @staticmethod
    def version() -> str:
        """Version of proofroll, which includes the method, and of heyoka if installed."""
        return with_heyoka(proofroll.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: ProjectionSettings) -> ProjectionMechanism:
        """See :class:`proofroll.core.engine.Engine`."""
        return ProjectionMechanism(scene, settings)
