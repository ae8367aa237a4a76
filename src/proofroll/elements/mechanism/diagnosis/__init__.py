"""Diagnosis of a mechanism: hypotheses of wrongly reported motion, and of wrong motion."""

from functools import cache

from proofroll.core.diagnosis import Hypothesis
from proofroll.core.diagnosis.fitting import built_otherwise
from proofroll.core.entry_points import loaded
from proofroll.elements.mechanism.diagnosis import contacts
from proofroll.elements.mechanism.diagnosis.contacts import REPORTED_FORCES
from proofroll.elements.mechanism.diagnosis.contacts_at_start import at_start
from proofroll.elements.mechanism.diagnosis.impacts import impacts, laws_of_impacts
from proofroll.elements.mechanism.diagnosis.joint_laws import (
    of_actuators,
    of_couplings,
    of_stops,
    soft_couplings,
    soft_stops,
)
from proofroll.elements.mechanism.diagnosis.numbers import (
    any_gravity,
    damped_motion,
    factors_of_all,
    friction_of_each_joint,
    of_applied_forces,
    of_bushings,
    of_each_body,
    of_each_joint,
    of_motions,
    of_several,
    rolling_resistance,
)
from proofroll.elements.mechanism.diagnosis.reactions import reactions, reactions_at_start
from proofroll.elements.mechanism.diagnosis.reporting_errors import REPORTING_ERRORS, start_not_taken
from proofroll.elements.mechanism.diagnosis.residuals import COVERED, GIVEN, PLACED, STATE
from proofroll.elements.mechanism.diagnosis.structure import (
    axis_of_first_steps,
    loop_lacks_row,
    lost_coupling,
    other_axis,
)

BUILT = built_otherwise([name for name in GIVEN if name != "joint axes"], COVERED, PLACED, STATE)
# Entry points of hypotheses about mechanisms that other packages test, each a :class:`Hypothesis`.
GROUP = "proofroll.mechanism_hypotheses"
_OF_WHOLE_RUNS: tuple[Hypothesis, ...] = (
    start_not_taken,
    *REPORTING_ERRORS,
    reactions,
    reactions_at_start,
    BUILT,
    *REPORTED_FORCES,
    *contacts.HYPOTHESES,
    at_start,
    impacts,
    laws_of_impacts,
    other_axis,
    axis_of_first_steps,
    factors_of_all,
    damped_motion,
    of_several,
    rolling_resistance,
    of_motions,
    of_applied_forces,
    of_bushings,
)
_OF_PARTS: tuple[Hypothesis, ...] = (
    of_actuators,
    of_couplings,
    soft_couplings,
    of_stops,
    soft_stops,
    of_each_body,
    of_each_joint,
    friction_of_each_joint,
    lost_coupling,
    loop_lacks_row,
    any_gravity,
)


@cache
def hypotheses() -> tuple[Hypothesis, ...]:
    """All hypotheses. Of two causes with equal proof the earlier is named, so announced ones precede single parts."""
    return (*_OF_WHOLE_RUNS, *(item for _, item in loaded(GROUP, of=Hypothesis)), *_OF_PARTS)
