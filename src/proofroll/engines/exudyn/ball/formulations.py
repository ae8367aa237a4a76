"""Formulations of a ball on a surface in Exudyn, and what each has and lacks."""

from collections.abc import Callable, Mapping

from proofroll.elements.ball_on_surface.model import ALL_OF_A_BALL, RollingBall
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.exudyn.ball.carrier import Carrier
from proofroll.engines.exudyn.ball.contact import PenaltyContact
from proofroll.engines.exudyn.ball.generic import Generic
from proofroll.engines.exudyn.ball.rolling_disc import RollingDisc
from proofroll.engines.exudyn.integration import ExudynModel
from proofroll.engines.exudyn.settings import ExudynSettings

RUNS: Mapping[str, Callable[[RollingBall, ExudynSettings], ExudynModel]] = {
    "generic": Generic,
    "carrier": Carrier,
    "rolling_disc": RollingDisc,
    "contact": PenaltyContact,
}
PROVIDES: Mapping[str, frozenset[str]] = {
    "generic": ALL_OF_A_BALL - {MechanismCapability.ORIENTATION},
    "carrier": ALL_OF_A_BALL,
    "rolling_disc": ALL_OF_A_BALL,
    "contact": ALL_OF_A_BALL,
}
LACKING: Mapping[str, Mapping[str, str]] = {
    "generic": {MechanismCapability.ORIENTATION: "the spin of generic is a quasi-velocity, the rate of no orientation"},
}
INHERENT: Mapping[str, Mapping[str, str]] = {
    formulation: {MechanismCapability.ORIENTATION: "the rigid body's Euler parameters are coordinates of its node"}
    for formulation in ("carrier", "rolling_disc", "contact")
}
