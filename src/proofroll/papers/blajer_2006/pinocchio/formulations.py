"""Formulation of a ball that rolls in a cylinder with Pinocchio, and what it has."""

import dataclasses
from collections.abc import Mapping

from proofroll.core.engine_abilities import Level, Term
from proofroll.core.errors import Refused
from proofroll.core.formulations import Formulation
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, NO_OTHER_BODIES
from proofroll.papers.blajer_2006.pinocchio.rows_run import RowsRun
from proofroll.papers.blajer_2006.pinocchio.settings import PRESETS, CompositeSettings

_ORIENTATION = Term(
    name="orientation",
    formulations=("composite",),
    on={"orientation": True},
    off={"orientation": False},
    because="turns the ball's own axes; its inertia is the same about all of them, so the motion does not ask for it",
)


def _run(scene: Scene, settings: CompositeSettings) -> RunOnBody:
    """Run of the scene's ball, with the orientation if the scene requires it.

    Raises:
        Refused: the scene requires the orientation, and the settings exclude it.
    """
    asked = MechanismCapability.ORIENTATION in scene.requires
    if asked and settings.orientation is False:
        raise Refused(f"needs {MechanismCapability.ORIENTATION}, which orientation=false leaves out")
    if settings.orientation is None:
        settings = dataclasses.replace(settings, orientation=asked)
    return on_body(RowsRun(rolling_ball(scene), settings), scene)


FORMULATIONS: Mapping[str, Formulation] = {
    "composite": Formulation(
        presets=PRESETS["composite"],
        provides=ALL_OF_A_BALL,
        level=Level.CONSTRAINT,
        build=_run,
        lacking=NO_OTHER_BODIES,
        terms=(_ORIENTATION, "projection"),
    )
}
