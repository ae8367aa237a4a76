"""Hypotheses of a start that is not taken, and of wrongly reported motion: frames, points, signs and times."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, known_difference, largest_difference, longest
from proofroll.core.diagnosis import Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import differing
from proofroll.core.diagnosis.samples import (
    another_clock,
    at_start,
    reported_quaternions,
    reported_vectors,
    run_and_truth,
    single_precision_run,
)
from proofroll.core.diagnosis.vectors import ReportedVector, delay_text, in_steps
from proofroll.core.errors import InputError, ProofrollError
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.diagnosis.equations import placed_of
from proofroll.elements.mechanism.diagnosis.residuals import MOTION, TOUCHING_MOTION
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts
from proofroll.elements.mechanism.run.dataset import quaternions
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.joint import Joint
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION
from proofroll.elements.mechanism.scene.model import Mechanism

if TYPE_CHECKING:
    import xarray as xr

_COVERS = ("state", *dict.fromkeys((*TOUCHING_MOTION, *MOTION)))
_REMEDY = "put the scene's start into the engine's own state before the first step"
_AT_ONCE = (
    100.0  # rate at which a dropped velocity vanishes, in natural ones: within a step, and not by a law of forces
)
_FIRST = 4  # samples from the start on that are compared
BODY, SURFACE = "body axes", "the surface's axes e1, e2, e3"


def surface_axes(element: Any, placed: Placed) -> FloatArray | None:
    """Axes of the wall where its ball is, as columns, (time, 3, 3); None: the element is no ball on a wall."""
    if element.on_wall is None:
        return None
    surface = element.on_wall.surface
    return np.asarray(surface.frame(surface.locate(placed.p_WB[:, element.on_wall.index])))


def frames_of(element: Any, placed: Placed) -> dict[str, FloatArray]:
    """Frames of all bodies by name, (time, bodies, 3, 3); of a body without axes of its wall those of the world."""
    frames, axes = {BODY: placed.R_WB[:, :-1]}, surface_axes(element, placed)
    if axes is not None:
        of_bodies = np.tile(np.eye(3), (*placed.p_WB.shape[:2], 1, 1))
        of_bodies[:, element.on_wall.index] = axes
        frames[SURFACE] = of_bodies
    return frames


# Lines of the certificate that follow from velocities.
_FOLLOWS = frozenset(
    {"forces", "torques", "forces of contact", "efforts", "couplings", "drives"}
    | {f"{turning}acceleration{OF_FIRST_STEPS}" for turning in ("", "angular ")}
)
_UNITS = {
    "p_WB": ("the origin of the body's frame", "m"),
    "v_WB": ("the velocity of that origin", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def _state(element: Any, data: xr.Dataset) -> FloatArray:
    """Poses and twists of all bodies, each scaled to a length by the mechanism's own length and time [m]."""
    length, T = element.length, element.natural_time
    parts = [data["p_WB"], data["v_WB"] * T, data["w_WB"] * (length * T), quaternions(data) * length]
    return np.concatenate(parts, axis=-1)


def _of_centres(vector: ReportedVector, evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: positions or velocities are those of the centres of mass."""
    com = np.array([body.com for body in evidence.element.mechanism.bodies])
    if vector.name == "w_WB" or not np.any(com) or vector.reported.shape != vector.true.shape:
        return
    placed = placed_of(evidence.element.mechanism, evidence.truth)
    arm = np.einsum("tnij,nj->tni", placed.R_WB[:, :-1], com)
    shift = arm if vector.name == "p_WB" else np.cross(placed.w_WB, arm)
    what = "position" if vector.name == "p_WB" else "velocity"
    says = f"{vector.name} is the {what} of the centres of mass, not of the origins of the bodies' frames"
    yield vector.cause(
        "centre of mass", says, vector.true + shift[-len(vector.true) :], "give the origins of the frames"
    )


def _of_contacts(vector: ReportedVector, evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: positions or velocities of what touches are those of the point of contact, or spins its normal's."""
    mechanism = evidence.element.mechanism
    if not mechanism.contacts or vector.reported.shape != vector.true.shape:
        return
    placed = placed_of(mechanism, evidence.truth)
    followed = follow_contacts(placed)
    shift, normal = np.zeros_like(placed.p_WB), np.zeros_like(placed.p_WB)
    for body, index in mechanism.body_index.items():
        ends = [k for k, item in enumerate(mechanism.contacts) if body in {item.body_a, item.body_b}]
        if index >= 0 and len(ends) == 1:  # of several contacts none is the one that is meant
            shift[:, index] = followed.place[:, ends[0]] - placed.p_WB[:, index]
            normal[:, index] = followed.normal[:, ends[0]]
    spin = np.sum(placed.w_WB * normal, axis=-1, keepdims=True) * normal
    at_contact = "of the contact point, not of the origin of the body's frame"
    others = {
        "p_WB": ((f"is the position {at_contact}", shift),),
        "v_WB": ((f"is the velocity {at_contact}", np.cross(placed.w_WB, shift)),),
        "w_WB": (
            ("lacks the spin about the normal of the contact", -spin),
            ("is the spin about the normal of the contact alone", spin - placed.w_WB),
            ("has the spin about the normal of the contact with the wrong sign", -2 * spin),
        ),
    }
    remedy = f"give {vector.name} of the body's frame, along the axes of the world"
    for says, change in others[vector.name]:
        explained = vector.true + change[-len(vector.true) :]
        yield vector.cause("contact point", f"{vector.name} {says}", explained, remedy)


@hypothesis("late start", "the positions at time 0 are those of the true path at another time, to second order")
def starts_late(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the start lies on the true path before or after time 0; tested with the certificate's line alone."""
    element = evidence.element
    v, a = element.start.v_WB[0], element.first_motion.acceleration
    pair = evidence.vectors("position", len(v))
    if evidence.run is not None or pair is None or evidence.read_back("position") or not np.any(v):
        return
    off = pair[0] - pair[1]
    ahead = float(np.sum(off * v) / np.sum(v * v))
    says = f"the start is {delay_text(-ahead, evidence.step)}: the bodies have moved before time 0"
    remainder, change = longest(off - v * ahead - a * ahead**2 / 2), in_steps(ahead, evidence.step)
    place = Difference("position at time 0", "m", longest(off))
    yield place.cause("late", says, remainder, "sample before the first step", 1, change=change)


@hypothesis(
    "centres of mass at time 0",
    "the scene's own vectors at time 0, of the centres of mass, are those of the certificate",
)
def centres_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: vectors at time 0 are those of the centres of mass, and nothing else differs."""
    element, wrong = evidence.element, {line["quantity"]: line for line in differing(evidence.lines)}
    com, start = np.array([body.com for body in element.mechanism.bodies]), element.start
    w, turning = start.w_WB[0], element.first_motion.angular_acceleration
    arm = np.einsum("nij,nj->ni", start.R_WB[0, :-1], com)
    acceleration = np.cross(turning, arm) + np.cross(w, np.cross(w, arm))
    shifts = {"position": arm, "velocity": np.cross(w, arm), "acceleration": acceleration}
    shifts[f"acceleration{OF_FIRST_STEPS}"] = acceleration
    meant = {"position": "p_WB is the position", "velocity": "v_WB is the velocity"}
    meant |= {"acceleration": "the acceleration is that", f"acceleration{OF_FIRST_STEPS}": meant["velocity"]}
    if set(wrong) - shifts.keys():
        return
    for name, line in wrong.items():
        off = np.reshape(line["found"], (-1, 3)) - np.reshape(line["expected"], (-1, 3))
        if off.shape == arm.shape:
            says = f"{meant[name]} of the centres of mass, not of the origins of the bodies' frames"
            apart = Difference(f"{name} at time 0", str(line["unit"]), known_difference(off, 0 * off))
            remainder = known_difference(off, shifts[name])
            yield apart.cause("centre of mass", says, remainder, "give the origins of the frames")


def _size(element: Any, name: str) -> float:
    """Natural size of a quantity of a mechanism, from its length and natural time."""
    length, time = element.length, element.natural_time
    return float({"p_WB": length, "v_WB": length / time, "w_WB": 1 / time}[name])


def _attitudes(evidence: Evidence) -> FloatArray:
    assert evidence.truth is not None
    return quaternions(evidence.truth)


CLOCK = another_clock(_state, MOTION)
REPORTING_ERRORS: tuple[Any, ...] = (
    CLOCK,
    starts_late,
    reported_vectors(
        _UNITS,
        lambda evidence: frames_of(evidence.element, placed_of(evidence.element.mechanism, evidence.truth)),
        CLOCK,
        _size,
        lambda vector, evidence: (*_of_centres(vector, evidence), *_of_contacts(vector, evidence)),
    ),
    at_start(lambda element: {name: frame[0] for name, frame in frames_of(element, element.start).items()}, _FOLLOWS),
    centres_at_start,
    reported_quaternions(_attitudes),
    single_precision_run,
)


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
    names = [f"{name}{OF_FIRST_STEPS}" for name in ("acceleration", "angular acceleration")]
    pairs = [pair for name in names if (pair := evidence.vectors(name, len(start.v_WB[0]))) is not None]
    if len(pairs) < len(names):
        return
    lengths = np.array([1.0, element.length])[:, None, None]
    velocity = np.stack([start.v_WB[0], start.w_WB[0]]) * lengths
    poses, expected = (np.stack(sides) * lengths for sides in zip(*pairs, strict=True))
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
    if mechanism.loops or mechanism.couplings or all(tuple(joint.q0) == _home(joint) for joint in mechanism.joints):
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
