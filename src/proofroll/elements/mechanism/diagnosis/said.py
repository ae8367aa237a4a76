"""Hypotheses about what an engine says of its bodies and reactions: frames, points, signs and times of its samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, apart, hypothesis
from proofroll.core.diagnosis.samples import (
    another_clock,
    at_start,
    both,
    reported_quaternions,
    reported_vectors,
    single_precision_run,
)
from proofroll.core.diagnosis.vectors import Reported
from proofroll.elements.mechanism.diagnosis.equations import placed_of
from proofroll.elements.mechanism.placed import Placed

if TYPE_CHECKING:
    import xarray as xr

BODY, PARENT = "body axes", "the axes of the parent body"
_UNITS = {
    "p_WB": ("the origin of the body's frame", "m"),
    "v_WB": ("the velocity of that origin", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def _state(element: Any, data: xr.Dataset) -> FloatArray:
    """Poses and twists of all bodies, by the mechanism's own length and time [m]."""
    length, T = element.length, element.natural_time
    parts = [data["p_WB"], data["v_WB"] * T, data["w_WB"] * (length * T), data["q_WB"] * length]
    return np.concatenate(parts, axis=-1)


def _frames(evidence: Evidence) -> dict[str, FloatArray]:
    return {BODY: placed_of(evidence.element.mechanism, evidence.truth).R_WB[:, :-1]}


def _axes_at_start(element: Any) -> Mapping[str, FloatArray]:
    return {BODY: element.start.R_WB[0, :-1]}


def _of_centres(told: Reported, evidence: Evidence) -> Iterator[Cause]:
    """That positions or velocities are those of the centres of mass."""
    com = np.array([body.com for body in evidence.element.mechanism.bodies])
    if told.name == "w_WB" or not np.any(com) or told.said.shape != told.true.shape:
        return
    placed = placed_of(evidence.element.mechanism, evidence.truth)
    arm = np.einsum("tnij,nj->tni", placed.R_WB[:, :-1], com)
    shift = arm if told.name == "p_WB" else np.cross(placed.w_WB, arm)
    what = "position" if told.name == "p_WB" else "velocity"
    says = f"{told.name} is the {what} of the centres of mass, not of the origins of the bodies' frames"
    yield told.cause("centre of mass", says, told.true + shift[-len(told.true) :], "give the origins of the frames")


def _size(element: Any, name: str) -> float:
    """What a mechanism of its size has of a quantity in its time."""
    length, time = element.length, element.natural_time
    return float({"p_WB": length, "v_WB": length / time, "w_WB": 1 / time}[name])


def _attitudes(evidence: Evidence) -> FloatArray:
    assert evidence.truth is not None
    return np.asarray(evidence.truth["q_WB"].to_numpy())


@hypothesis(
    "reactions",
    "the true wrench on the child at the joint with another sign, frame, point, joint or time is what is said",
)
def reactions(evidence: Evidence) -> Iterator[Cause]:
    """Forces and moments of joints, of those whose three components are determinate."""
    found = both(evidence)
    if found is None:
        return
    run, truth = found
    mechanism = evidence.element.mechanism
    placed = placed_of(mechanism, truth)
    ends = [(each.name, each.a, each.b, each.position_b) for each in mechanism.connections]
    for kind, unit in (("force", "N"), ("torque", "N m")):
        whole = [end for end in ends if all(_known(run, truth, f"{kind}.{end[0]}.{axis}") for axis in "xyz")]
        if not whole:
            continue
        said, true = (_stacked(data, kind, [end[0] for end in whole])[1:] for data in (run, truth))
        R = placed.R_WB[1:]
        frames = {
            BODY: np.stack([R[:, mechanism.body_index[end[2]]] for end in whole], axis=1),
            PARENT: np.stack([R[:, mechanism.body_index[end[1]]] for end in whole], axis=1),
        }
        what = f"the {'force' if kind == 'force' else 'moment'} on the child at the joint"
        told = Reported(kind, what, unit, said, true, truth["time"].to_numpy()[1:], frames)
        yield from told.causes(evidence.step)
        yield from _of_other_joints(told, [end[0] for end in whole])
        if kind == "torque":
            yield from _about_centres(told, placed, truth, whole, evidence)


def _known(run: Any, truth: Any, name: str) -> bool:
    return all(name in data and bool(np.all(np.isfinite(data[name].to_numpy()[1:]))) for data in (run, truth))


def _stacked(data: Any, kind: str, names: list[str]) -> FloatArray:
    """Shape (time, joints, 3)."""
    return np.stack([np.stack([data[f"{kind}.{n}.{a}"].to_numpy() for a in "xyz"], axis=-1) for n in names], axis=1)


def _of_other_joints(told: Reported, names: list[str]) -> Iterator[Cause]:
    """That reactions stand at other joints than those whose they are."""
    order = []
    for i in range(len(names)):
        order.append(int(np.argmin([apart(told.said[:, i], told.true[:, j]) for j in range(len(names))])))
    if order != list(range(len(names))):
        moved = "; ".join(f"at {names[i]} stands that of {names[j]}" for i, j in enumerate(order) if i != j)
        says = f"the {told.name} is of another joint: {moved}"
        yield told.cause("other joint", says, told.true[:, order], "look at the order of joints in the engine")


def _about_centres(told: Reported, placed: Placed, truth: Any, whole: list[Any], evidence: Evidence) -> Iterator[Cause]:
    """That moments are about the centre of mass of the child, or about the world's origin."""
    bodies = {body.name: body for body in evidence.element.mechanism.bodies}
    if any(not _known(truth, truth, f"force.{end[0]}.{axis}") for end in whole for axis in "xyz"):
        return
    force = _stacked(truth, "force", [end[0] for end in whole])[1:]
    at = np.stack([placed.point(end[2], end[3])[1:] for end in whole], axis=1)
    centre = np.stack(
        [placed.point(end[2], bodies[end[2]].com if end[2] in bodies else (0, 0, 0))[1:] for end in whole], axis=1
    )
    remedy = "give the moment at the joint"
    says = "torque is the moment about the centre of mass of the child, not at the joint"
    yield told.cause("point of moment", says, told.true + np.cross(at - centre, force), remedy)
    says = "torque is the moment about the origin of the world, not at the joint"
    yield told.cause("point of moment", says, told.true + np.cross(at, force), remedy)


CLOCK = another_clock(_state, ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque", "motion"))
SAID: tuple[Any, ...] = (
    CLOCK,
    reported_vectors(_UNITS, _frames, CLOCK, _size, _of_centres),
    at_start(_axes_at_start, frozenset()),
    reported_quaternions(_attitudes),
    single_precision_run,
    reactions,
)
