"""Formulations of a ball on a surface with Pinocchio, and what each has and lacks."""

import dataclasses
from collections.abc import Mapping

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.as_body import RunOnBody, on_body, rolling_ball
from proofroll.elements.ball_on_surface.model import ALL_OF_A_BALL
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.pinocchio.ball.rows_run import RowsRun
from proofroll.engines.pinocchio.settings import PinocchioSettings

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
