"""The law check of one route: takes its record piece by piece and collects what the laws leave."""

from __future__ import annotations

from typing import TYPE_CHECKING

from proofroll.truth.check.laws.contacts import contact_laws
from proofroll.truth.check.laws.joints import Coordinates, joint_laws
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.motion import joined, kinematics, momenta
from proofroll.truth.check.laws.record import Passage, Pieces
from proofroll.truth.check.laws.residuals import COARSE, LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.transitions import transition

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism


class LawCheck:
    """Laws of a mechanism, to which the record of one route is held.

    Attributes:
        residuals: remainders of the laws so far.
    """

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes a mechanism in SI units with its natural length [m] and rate [1/s]."""
        self._scene, self.residuals = LawScene(mechanism, length, rate), LawResiduals(rate=rate)
        self._coordinates, self._fastest = Coordinates(self._scene), dict[str, float]()

    def take(self, pieces: Pieces) -> None:
        """Checks pieces of one stretch, in order of time."""
        residuals = self.residuals
        residuals.coarse = COARSE if pieces.coarse else 1.0
        residuals.points += pieces.time.size
        kinematics(self._scene, pieces, residuals)
        joined(self._scene, pieces, residuals)
        loads = BodyLoads(self._scene, pieces)
        axes = joint_laws(self._scene, pieces, residuals, self._coordinates, loads)
        contact_laws(self._scene, pieces, residuals, loads)
        momenta(self._scene, pieces, residuals, loads, axes)

    def passes(self, passage: Passage) -> dict[int, float]:
        """Checks the transition after the pieces that were taken last.

        Returns:
            Impulse along each driven joint, by its number, of an impact [N s, N m s]; NaN where not determinate.
        """
        self.residuals.coarse = 1.0
        self.residuals.events += 1
        return transition(self._scene, passage, self.residuals, self._coordinates, self._fastest)
