"""Formulations of a ball on a surface with Pinocchio, and what each has and lacks."""

import dataclasses
from collections.abc import Mapping

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.pinocchio.settings import PinocchioSettings
from proofroll.papers.blajer_2006.ball.as_body import RunOnBody, on_body, rolling_ball
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL
from proofroll.papers.blajer_2006.pinocchio.rows_run import RowsRun

PROVIDES: Mapping[str, frozenset[str]] = {"composite": ALL_OF_A_BALL}


def ball_run(scene: Scene, settings: PinocchioSettings) -> RunOnBody:
    """Run of the scene's ball.

    Raises:
        Refused: the scene requires the orientation, and the settings exclude it.
    """
    return on_body(RowsRun(rolling_ball(scene), _decided(scene, settings)), scene)


def _decided(scene: Scene, settings: PinocchioSettings) -> PinocchioSettings:
    """Settings with the orientation as the scene requires.

    Raises:
        Refused: the scene requires the orientation, and the settings exclude it.
    """
    asked = MechanismCapability.ORIENTATION in scene.requires
    if asked and settings.orientation is False:
        raise Refused(f"needs {MechanismCapability.ORIENTATION}, which orientation=false leaves out")
    return dataclasses.replace(settings, orientation=asked) if settings.orientation is None else settings
