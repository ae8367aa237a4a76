"""Formulations of a ball that rolls in a cylinder in Exudyn, and what each has."""

from collections.abc import Callable, Mapping

from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.engines.exudyn.integration import ExudynModel
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.papers.blajer_2006.ball.model import ALL_OF_A_BALL, RollingBall
from proofroll.papers.blajer_2006.exudyn.carrier import Carrier
from proofroll.papers.blajer_2006.exudyn.rolling_disc import RollingDisc

RUNS: Mapping[str, Callable[[RollingBall, ExudynSettings], ExudynModel]] = {
    "carrier": Carrier,
    "rolling_disc": RollingDisc,
}
PROVIDES: Mapping[str, frozenset[str]] = dict.fromkeys(RUNS, ALL_OF_A_BALL)
INHERENT: Mapping[str, Mapping[str, str]] = {
    formulation: {MechanismCapability.ORIENTATION: "the rigid body's Euler parameters are coordinates of its node"}
    for formulation in RUNS
}
