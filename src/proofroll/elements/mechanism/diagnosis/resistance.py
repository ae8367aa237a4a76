"""Hypotheses of another rolling resistance than the scene's."""

from collections.abc import Iterator

import numpy as np

from proofroll.core.diagnosis import Cause, Evidence, hypothesis
from proofroll.core.diagnosis.fitting import change_by, factor_text, known_factor
from proofroll.elements.mechanism.diagnosis.equations import Change
from proofroll.elements.mechanism.diagnosis.pressing import Resisting
from proofroll.elements.mechanism.diagnosis.residuals import residuals_of

_REMEDY = "the moment is an arm, in metres, times the normal force of that moment, against what the scene says"
_LAWS = (
    # of a scene's law against motion alone
    (Resisting(turning=True), "the rolling resistance is against turning where the ball slips, not against its motion"),
    (
        Resisting(along_spin=True),
        "the rolling resistance acts against the whole angular velocity, spin about the normal included",
    ),
    (Resisting(by_weight=True), "the rolling resistance is its arm times the weight, not times the normal force"),
)


@hypothesis(
    "rolling resistance",
    "the equations of motion balance at every state of the run with that law, not with the scene's",
)
def rolling_resistance(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: rolling resistance has a factor, is against the whole spin, or is by the weight."""
    mechanism = evidence.element.mechanism
    if not any(contact.rolling_resistance for contact in mechanism.contacts):
        return
    moves = any(contact.bend for contact in mechanism.contacts)
    for residuals in residuals_of(evidence):
        for law, says in _LAWS if moves else _LAWS[1:]:
            yield residuals.cause("rolling resistance", says, Change(mechanism, resisting=law), _REMEDY, 0)

        def changed(factor: float) -> Change:
            return Change(mechanism, resisting=Resisting(factor))

        factor = residuals.fit(changed, 1.0)
        mistake = known_factor(factor)
        factor = mistake[0] if mistake else factor
        if np.isfinite(factor) and factor >= 0:
            says = f"the engine moves it with rolling resistance {factor_text(factor)}"
            number = 0 if mistake else 1
            yield residuals.cause("rolling resistance", says, changed(factor), _REMEDY, number, change_by(factor))
