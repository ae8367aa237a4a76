"""Hypotheses about what an engine says of its bodies and joints: frames, points, signs and times of its samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, worth
from proofroll.core.diagnosis.lines import differing, single_precision
from proofroll.core.diagnosis.quaternions import quaternions, rounded
from proofroll.core.diagnosis.vectors import Reported, apart, late, said_delay
from proofroll.elements.mechanism.diagnosis.equations import placed_of
from proofroll.elements.mechanism.placed import Placed

BODY, PARENT = "body axes", "the axes of the parent body"
_UNITS = {
    "p_WB": ("the origin of the body's frame", "m"),
    "v_WB": ("the velocity of that origin", "m/s"),
    "w_WB": ("the angular velocity", "rad/s"),
}


def _both(evidence: Evidence) -> tuple[Any, Any, Placed] | None:
    """Run, truth and the true bodies, if they are of the same times."""
    run, truth = evidence.run, evidence.truth
    if run is None or truth is None or run.sizes["time"] != truth.sizes["time"] or run.sizes["time"] < 3:
        return None
    return run, truth, placed_of(evidence.element.mechanism, truth)


class Vectors:
    """Positions, velocities and angular velocities of the bodies."""

    id: ClassVar[str] = "said"
    grounds: ClassVar[str] = "the true vectors of all bodies with another sign, unit, frame or time are what is said"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        both = _both(evidence)
        if both is None:
            return
        run, truth, placed = both
        if any(cause.proven for cause in WholeRun.test(evidence)):
            return
        time, frames = truth["time"].to_numpy(), {BODY: placed.R_WB[:, :-1]}
        for name, (what, unit) in _UNITS.items():
            said, true = run[name].to_numpy(), truth[name].to_numpy()
            told = Reported.after_start(name, what, unit, said, true, time, frames, _size(evidence, name))
            yield from told.causes(evidence.step)
            yield from _of_centres(told, placed, evidence)


def _of_centres(told: Reported, placed: Placed, evidence: Evidence) -> Iterator[Cause]:
    """That positions or velocities are those of the centres of mass."""
    com = np.array([body.com for body in evidence.element.mechanism.bodies])
    if told.name == "w_WB" or not np.any(com) or told.said.shape != told.true.shape:
        return
    arm = np.einsum("tnij,nj->tni", placed.R_WB[:, :-1], com)
    shift = arm if told.name == "p_WB" else np.cross(placed.w_WB, arm)
    what = "position" if told.name == "p_WB" else "velocity"
    says = f"{told.name} is the {what} of the centres of mass, not of the origins of the bodies' frames"
    yield told.cause("centre of mass", says, told.true + shift[-len(told.true) :], "give the origins of the frames")


def _size(evidence: Evidence, name: str) -> float:
    """What a mechanism of its size has of a quantity in its time."""
    length, time = evidence.element.length, evidence.element.natural_time
    return float({"p_WB": length, "v_WB": length / time, "w_WB": 1 / time}[name])


class WholeRun:
    """All that is said belongs to another time than it is said to."""

    id: ClassVar[str] = "late"
    grounds: ClassVar[str] = "positions, velocities and attitudes are the true ones, all shifted by one time"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        both = _both(evidence)
        if both is None:
            return
        run, truth, _ = both
        length, T = evidence.element.length, evidence.element.natural_time
        said, true = (
            np.concatenate(
                [data["p_WB"], data["v_WB"] * T, data["w_WB"] * (length * T), data["q_WB"] * length], axis=-1
            )
            for data in (run, truth)
        )
        if not worth(apart(said, true), float(np.max(np.abs(true)))):
            return
        found = late(truth["time"].to_numpy(), said, true)
        if found is not None:
            delay, before, after = found
            says = f"every sample is {said_delay(delay, evidence.step)}: the motion is right at another time"
            covered = ("p_WB", "v_WB", "w_WB", "q_WB", "force", "torque", "motion")
            remedy = "advance(t) has to end at t, neither a step before nor after it"
            yield Cause("late", says, "state", "m", before, after, remedy, 1, covered)


class Reactions:
    """Forces and moments of joints, of those whose three components are determinate."""

    id: ClassVar[str] = "reactions"
    grounds: ClassVar[str] = (
        "the true wrench on the child at the joint with another sign, frame, point, joint or time is what is said"
    )

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        both = _both(evidence)
        if both is None:
            return
        run, truth, placed = both
        mechanism = evidence.element.mechanism
        ends = [(joint.name, joint.parent, joint.child, joint.child_position) for joint in mechanism.joints]
        ends += [(loop.name, loop.body_a, loop.body_b, loop.position_b) for loop in mechanism.loops]
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


class Attitude:
    """The quaternions are in another order, of inverse rotations, or not of unit length."""

    id: ClassVar[str] = "quaternion"
    grounds: ClassVar[str] = "the true quaternions in another order or inverted are what is said, up to their sign"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        both = _both(evidence)
        if both is not None:
            yield from quaternions(both[0]["q_WB"].to_numpy(), both[1]["q_WB"].to_numpy())


class SinglePrecision:
    """Numbers of 24 bits."""

    id: ClassVar[str] = "float32"
    grounds: ClassVar[str] = "every number of the run, or each built one that differs, is exactly a float32"

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        yield from single_precision(evidence.lines)
        if evidence.run is not None and evidence.truth is not None:
            yield from rounded(evidence.run, evidence.truth, ("p_WB", "v_WB", "w_WB"))


class OtherAxis:
    """A joint turns about another axis than the scene's."""

    id: ClassVar[str] = "joint axis"
    grounds: ClassVar[str] = (
        "seen from the parent, the child turns about one direction throughout, which is not the axis"
    )

    @staticmethod
    def test(evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        mechanism = evidence.element.mechanism
        yield from _axes_at_start(evidence)
        both = _both(evidence)
        if both is None:
            return
        placed = placed_of(mechanism, both[0])
        for joint in mechanism.joints:
            if joint.kind != "revolute":
                continue
            parent, child = (mechanism.body_index[name] for name in (joint.parent, joint.child))
            turning = placed.w_WB[:, child] - placed.spin(joint.parent)
            seen = np.einsum("tji,tj->ti", placed.R_WB[:, parent], turning)
            axis = joint.parent_frame[:, 2]
            found = np.linalg.svd(seen)[2][0]
            found = found * np.sign(found @ axis or 1.0)
            before, after = (
                float(np.max(np.linalg.norm(seen - np.outer(seen @ n, n), axis=-1))) for n in (axis, found)
            )
            if worth(before, float(np.max(np.abs(seen)))):
                says = f"the joint {joint.name} turns about ({_shown(found)}) of its parent, not about ({_shown(axis)})"
                remedy = "an axis is given in the frame of the parent body; look at whose frame the engine takes"
                covered = ("p_WB", "v_WB", "w_WB", "q_WB", "motion", "force", "torque")
                yield Cause(
                    f"axis of {joint.name}",
                    says,
                    f"turning of {joint.name} across its axis",
                    "rad/s",
                    before,
                    after,
                    remedy,
                    2,
                    covered,
                )


def _axes_at_start(evidence: Evidence) -> Iterator[Cause]:
    """The axes that the certificate tells, one joint at a time."""
    line = next((line for line in differing(evidence.lines) if line["quantity"] == "joint axes"), None)
    joints = evidence.element.mechanism.joints
    if line is None or len(line["found"]) != 3 * len(joints):
        return
    found, expected = (np.reshape(line[key], (-1, 3)) for key in ("found", "expected"))
    off = np.nan_to_num(np.max(np.abs(found - expected), axis=1))
    for i, joint in enumerate(joints):
        both = f"({_shown(found[i])}) in the world, not ({_shown(expected[i])})"
        says = f"the joint {joint.name} was built with the axis {both}"
        after = float(np.max(np.delete(off, i), initial=0.0))
        remedy = "an axis is given in the frame of the parent body; look at whose frame the engine takes"
        yield Cause("joint axis", says, "joint axes at time 0", "1", float(np.max(off)), after, remedy, 0, ("motion",))


def _shown(vector: FloatArray) -> str:
    return ", ".join(f"{x:.4g}" for x in vector)


SAID: tuple[type[Any], ...] = (WholeRun, Vectors, Reactions, Attitude, SinglePrecision, OtherAxis)
