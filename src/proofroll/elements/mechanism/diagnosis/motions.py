"""Hypotheses of prescribed motions that come late, backwards, or in other units."""

from collections.abc import Iterator

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.elements.mechanism.diagnosis.equations import is_motion, of_start, placed_of
from proofroll.elements.mechanism.diagnosis.residuals import COVERED
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.signal import delayed, varies

_COVERS = ("motion", *COVERED, "drive")
_DEGREE = np.pi / 180


@hypothesis(
    "prescribed motion",
    "at every sample, the coordinate of the joint is that of the changed motion, and not of the scene's; without a "
    "run, its acceleration at time 0",
)
def of_motions(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: one prescribed motion is a step late, has the wrong sign, or is in other units of angle."""
    mechanism, datasets = evidence.element.mechanism, run_and_truth(evidence)
    if not mechanism.prescribed:
        return
    placed = placed_of(mechanism, datasets[0]) if datasets is not None and is_motion(datasets[0]) else None
    start = of_start(evidence) if placed is None else None
    for joint, _, at_v in mechanism.prescribed:
        unit = joint.unit
        if placed is not None:
            # the sample at time 0 is given to an engine
            times, values = placed.time[1:], placed.along(joint)[0][1:, 0]
            what, units, part = f"coordinate of {joint.name}", unit, 0
        elif start is not None:
            times, values = np.zeros(1), start.v_rates[0][[at_v]]
            what, units, part = f"acceleration of {joint.name} at time 0", f"{unit}/s^2", 2
        else:
            return
        motion = _values(joint, 1.0, 0.0, times)[part]
        difference = float(np.max(np.abs(values - motion), initial=0.0))
        if not above_round_off(difference, float(np.max(np.abs(motion), initial=0.0))):
            continue
        for says, factor, delay, remedy in _mistakes(joint, evidence.step):
            remainder = float(np.max(np.abs(values - _values(joint, factor, delay, times)[part])))
            yield Cause(
                id=f"motion of {joint.name}",
                says=f"the motion of {joint.name} {says}",
                quantity=what,
                unit=units,
                before=difference,
                after=remainder,
                remedy=remedy,
                fitted=0,
                covers=_COVERS,
            )


def _values(joint: Joint, factor: float, delay: float, times: FloatArray) -> FloatArray:
    """Places, rates and accelerations of a motion with a factor and a delay [s], (3, times)."""
    assert joint.motion is not None  # as of all prescribed ones
    parts = moved(delayed(joint.motion, delay), times)
    return np.array([factor * np.broadcast_to(part, times.shape) for part in parts])


def _mistakes(joint: Joint, step: float | None) -> Iterator[tuple[str, float, float, str]]:
    """Words, factor, delay [s] and remedy of each mistake."""
    if step and joint.motion is not None and varies(joint.motion):
        yield "is a step late", 1.0, step, "evaluate it at the time of each stage of the step"
    yield "has the opposite sign", -1.0, 0.0, "it is along the joint's axis, of the child from the parent"
    if joint.kind == JointKind.REVOLUTE:
        yield "is taken for degrees", _DEGREE, 0.0, "the scene's motion is in radians"
        yield "is in degrees", 1 / _DEGREE, 0.0, "the scene's motion is in radians"
