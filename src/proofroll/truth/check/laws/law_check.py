"""Law check of a record with all forces on free bodies at the points of its pieces."""

from __future__ import annotations

from proofroll.truth.check.laws.contacts import contact_laws
from proofroll.truth.check.laws.joints import Coordinates, joint_laws
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.motion import joined, kinematics, momenta
from proofroll.truth.check.laws.record import Pieces
from proofroll.truth.check.laws.residuals import COARSE, LawResiduals
from proofroll.truth.check.laws.scene import LawScene


def laws_of_pieces(scene: LawScene, pieces: Pieces, residuals: LawResiduals) -> None:
    """Checks pieces in one mode, in order of time."""
    residuals.coarse = COARSE if pieces.coarse else 1.0
    residuals.points += pieces.time.size
    kinematics(scene, pieces, residuals)
    joined(scene, pieces, residuals)
    loads = BodyLoads(scene, pieces)
    joint_laws(scene, pieces, residuals, Coordinates(scene), loads)
    contact_laws(scene, pieces, residuals, loads)
    momenta(scene, pieces, residuals, loads)
