"""Engine adapter of the projection method."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import proofroll
from proofroll.core.engine_abilities import Level, Term, require_provided
from proofroll.core.heyoka_library import with_heyoka
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.family import Family, of_contact
from proofroll.engines.projection.settings import PRESETS, ProjectionSettings
from proofroll.engines.projection.smooth import mechanism
from proofroll.engines.projection.smooth.mechanism import ProjectionMechanism
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody
from proofroll.papers.blajer_2006.ball.model import NO_OTHER_BODIES
from proofroll.papers.blajer_2006.projection import run as ball


class Projection:
    """Blajer's projection method, for a ball on any surface that guides it and for mechanisms."""

    name: ClassVar[str] = "projection"
    title: ClassVar[str] = "projection solver"
    witness: ClassVar[bool] = True
    provides: ClassVar[Mapping[str, frozenset[str]]] = {
        **ball.PROVIDES,
        "dependent": mechanism.PROVIDES,
    }
    lacking: ClassVar[Mapping[str, Mapping[str, str]]] = dict.fromkeys(ball.FORMULATIONS, NO_OTHER_BODIES)
    settings: ClassVar[type[ProjectionSettings]] = ProjectionSettings
    presets: ClassVar[Mapping[str, Mapping[str, ProjectionSettings]]] = PRESETS
    levels: ClassVar[Mapping[str, Level]] = {
        **dict.fromkeys(ball.FORMULATIONS, Level.PROJECTION),
        "dependent": Level.CONSTRAINT,
    }
    terms: ClassVar[Sequence[Term]] = (
        Term(
            name="elimination of violations",
            formulations=tuple(PRESETS),
            on={"elimination": True},
            off={"elimination": False},
            because="takes away the slip that a step leaves (Blajer 2002); where rolling is linear with constant "
            "coefficients, as in the rotating frame, there is none",
        ),
    )
    inherent: ClassVar[Mapping[str, Mapping[str, str]]] = ball.INHERENT

    @staticmethod
    def family(_: ProjectionSettings) -> Mapping[str, str]:
        """See :class:`proofroll.core.engine_abilities.TellsFamily`."""
        return of_contact(Family.HARD)

    @staticmethod
    def version() -> str:
        """Version of proofroll, which includes the method, and of heyoka if installed."""
        return with_heyoka(proofroll.__version__)

    @classmethod
    def build(cls, scene: Scene, settings: ProjectionSettings) -> RunOnBody | ProjectionMechanism:
        """See :class:`proofroll.core.engine.Engine`; ``dependent`` gives a run of a mechanism."""
        if settings.formulation == "dependent":
            return ProjectionMechanism(scene, settings)
        require_provided(cls, settings.formulation, scene)
        return ball.ball_run(scene, settings)
