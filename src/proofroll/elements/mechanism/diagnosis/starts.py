"""Hypothesis that an engine does not take the scene's start."""

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache

import numpy as np

from proofroll.core.arrays import FloatArray, largest_difference, longest
from proofroll.core.diagnosis import Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.diagnosis.contacts import COVERS
from proofroll.elements.mechanism.diagnosis.residuals import MOTION
from proofroll.elements.mechanism.run.dataset import quaternions
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION
from proofroll.elements.mechanism.scene.model import Mechanism

_COVERS = ("state", *dict.fromkeys((*COVERS, *MOTION)))
_REMEDY = "put the scene's start into the engine's own state before the first step"
_AT_ONCE = (
    100.0  # rate at which a dropped velocity vanishes, in natural ones: within a step, and not by a law of forces
)
_FIRST = 4  # samples from the start on that are compared


@hypothesis(
    "start",
    "the first samples are those of the scene from another start; or the velocity of the start vanishes in one step",
)
def start_not_taken(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: velocities of the start are dropped, or the engine begins where all coordinates are zero."""
    yield from _lost_in_a_step(evidence)
    pair = run_and_truth(evidence)
    if pair is None:
        return
    run, true = pair
    if "p_WB" not in run or run.sizes["time"] < _FIRST:
        return
    times = true["time"].to_numpy()[:_FIRST]
    poses, expected = (_poses(data["p_WB"].to_numpy(), quaternions(data)) for data in (run, true))
    # an engine may report at time 0 what it was given
    distance = largest_difference(poses[1:_FIRST], expected[1:_FIRST])
    if not above_round_off(distance, longest(expected)):
        return
    for says, other_model in _other_starts(evidence.element.mechanism):
        moved = _moved(other_model, tuple(times.tolist()))
        if moved is None:
            continue
        remainder = largest_difference(poses[1:_FIRST], moved[1:])
        yield Difference("first samples", "m", distance, _COVERS).cause("start", says, remainder, _REMEDY)


def _lost_in_a_step(evidence: Evidence) -> Iterator[Cause]:
    """Cause: the first steps take away the velocities of the start, all in the same time."""
    element, start = evidence.element, evidence.element.start
    lines = {str(line["quantity"]): line for line in evidence.lines}
    names = [f"{name}{OF_FIRST_STEPS}" for name in ("acceleration", "angular acceleration")]
    if not all(name in lines and np.size(lines[name]["found"]) == start.v_WB.size for name in names):
        return
    lengths = np.array([1.0, element.length])
    velocity = np.stack([start.v_WB[0], start.w_WB[0]]) * lengths[:, None, None]
    poses, expected = (
        np.array([np.reshape(lines[name][key], start.v_WB[0].shape) for name in names]) * lengths[:, None, None]
        for key in ("found", "expected")
    )
    square = float(np.sum(velocity**2))
    rate = float(np.sum((expected - poses) * velocity)) / square if square else 0.0
    if rate * element.natural_time > _AT_ONCE:
        distance, remainder = longest(poses - expected), longest(poses - expected + rate * velocity)
        says = "the start was not taken: the velocities of the start vanish in the first step"
        off = Difference("acceleration of the first steps", "m/s^2", distance, _COVERS)
        yield off.cause("start", says, remainder, _REMEDY)


def _poses(places: FloatArray, turns: FloatArray) -> FloatArray:
    """Places [m] and turns by which samples of bodies are compared, shape (time, numbers)."""
    turns = turns * np.where(turns[..., :1] < 0, -1.0, 1.0)
    return np.concatenate([places.reshape(len(places), -1), turns.reshape(len(turns), -1)], axis=1)


def _other_starts(mechanism: Mechanism) -> Iterator[tuple[str, Mechanism]]:
    """The mechanism from the starts that an engine has by itself, each with a clause."""
    if mechanism.prescribed:
        return
    resting = tuple(replace(joint, v0=(0.0,) * joint.nv) for joint in mechanism.joints)
    if any(np.any(joint.v0) for joint in mechanism.joints):
        says = "the start was not taken: it begins at rest, without the velocities of the scene"
        yield says, replace(mechanism, joints=resting)
    if mechanism.loops or mechanism.couplings or not any(map(_away, mechanism.joints)):
        return
    try:
        home = tuple(replace(joint, q0=_home(joint)) for joint in mechanism.joints)
    except InputError:  # zero lies beyond a stop
        return
    yield "the start was not taken: all coordinates begin at zero", replace(mechanism, joints=home)
    both = tuple(replace(joint, q0=_home(joint)) for joint in resting)
    yield "the start was not taken: it begins at rest with all coordinates at zero", replace(mechanism, joints=both)


def _home(joint: Joint) -> tuple[float, ...]:
    """Coordinates of a joint at zero, with the quaternion of no turn."""
    turns = (1.0, 0.0, 0.0, 0.0) if joint.kind in WITH_QUATERNION else ()
    return (0.0,) * (joint.nq - len(turns)) + turns


def _away(joint: Joint) -> bool:
    return tuple(joint.q0) != _home(joint)


# Cached: every run of a comparison that differs asks for the same few motions.
@lru_cache(maxsize=32)
def _moved(mechanism: Mechanism, times: tuple[float, ...]) -> FloatArray | None:
    """Poses of the true motion of a mechanism at the first times; None: it cannot start so, or has no truth."""
    from proofroll.core.scene import Scene
    from proofroll.core.truth import truth

    try:
        check_contacts(mechanism)
        true = truth(Scene("start", "", (MechanismElement(mechanism),)), np.array(times))
    except ProofrollError:
        return None
    return _poses(true["p_WB"].to_numpy(), quaternions(true))
