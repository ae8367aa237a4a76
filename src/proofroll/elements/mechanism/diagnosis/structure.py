"""Hypotheses of structure: another axis of a joint, lost terms between bodies, missing rows of loops."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES, Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import CauseRow, Residuals, differing, scale_of
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.errors import InputError
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.elements.mechanism.diagnosis.equations import Change, is_motion, of_run, placed_of, stretch
from proofroll.elements.mechanism.diagnosis.residuals import MOTION, by_rows
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import to_rpy

_REMEDY = "an axis is given in the frame of the parent body; look at whose frame the engine takes"
# Lines of the certificate that follow from the joints' axes.
_OF_AXES = {
    "forces", "torques", "acceleration", "angular acceleration", f"acceleration{OF_FIRST_STEPS}",
    f"angular acceleration{OF_FIRST_STEPS}",
}  # fmt: skip


@hypothesis("joint axis", "seen from the parent, the child turns about one direction throughout, which is not the axis")
def other_axis(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: a joint turns about another axis than the scene's."""
    mechanism = evidence.element.mechanism
    yield from _axes_at_start(evidence)
    pair = run_and_truth(evidence)
    if pair is None or not is_motion(pair[0]):
        return
    placed = placed_of(mechanism, pair[0])
    for joint in mechanism.joints:
        if joint.kind != JointKind.REVOLUTE:
            continue
        parent, child = (mechanism.body_index[name] for name in (joint.parent, joint.child))
        turning = placed.w_WB[:, child] - placed.spin(joint.parent)
        seen = np.einsum("tji,tj->ti", placed.R_WB[:, parent], turning)
        axis = joint.parent_frame[:, 2]
        fitted = np.linalg.svd(seen)[2][0]
        fitted = fitted * np.sign(fitted @ axis or 1.0)
        difference, remainder = (
            float(np.max(np.linalg.norm(seen - np.outer(seen @ n, n), axis=-1))) for n in (axis, fitted)
        )
        if above_round_off(difference, float(np.max(np.abs(seen)))) and _turns_about(
            placed, parent, child, fitted, axis
        ):
            says = f"the joint {joint.name} turns about ({_shown(fitted)}) of its parent, not about ({_shown(axis)})"
            change = float(np.linalg.norm(fitted - axis))
            off = Difference(f"turning of {joint.name} across its axis", "rad/s", difference, MOTION)
            yield off.cause(f"axis of {joint.name}", says, remainder, _REMEDY, 2, change=change)


def _turns_about(placed: Placed, parent: int, child: int, seen: FloatArray, axis: FloatArray) -> bool:
    """True if the poses turn about ``seen`` and not about ``axis``, so that not only the spin is reported wrongly."""
    relative = np.swapaxes(placed.R_WB[:, parent], 1, 2) @ placed.R_WB[:, child]
    turns = relative @ relative[0].T
    moved, unmoved = (float(np.max(np.linalg.norm(turns @ n - n, axis=-1))) for n in (seen, axis))
    return moved <= CLOSES * unmoved


def _axes_at_start(evidence: Evidence) -> Iterator[Cause]:
    """Causes from axes in the certificate that differ from the scene's, one for each joint."""
    joints = evidence.element.mechanism.joints
    pair = evidence.vectors("joint axes", len(joints))
    if pair is None or evidence.read_back("joint axes"):
        return
    axes, expected = pair
    off = np.nan_to_num(np.max(np.abs(axes - expected), axis=1))
    difference = Difference("joint axes at time 0", "1", float(np.max(off)), ("motion",))
    for i, joint in enumerate(joints):
        both = f"({_shown(axes[i])}) in the world, not ({_shown(expected[i])})"
        says = f"the joint {joint.name} was built with the axis {both}"
        remainder = float(np.max(np.delete(off, i), initial=0.0))
        yield difference.cause("joint axis", says, remainder, _REMEDY)


@hypothesis(
    "joint axis at time 0",
    "the child's first rotation gives the axis; with it the mechanism has the engine's accelerations and reactions",
)
def axis_of_first_steps(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: in the scene's pose, a joint starts to turn about another axis than the scene's."""
    lines, element = {str(line["quantity"]): line for line in evidence.lines}, evidence.element
    wrong = {str(line["quantity"]) for line in differing(evidence.lines)}
    turning = lines.get(f"angular acceleration{OF_FIRST_STEPS}")
    if not wrong or wrong - _OF_AXES or turning is None or not turning["found"]:
        return
    start, mechanism = element.start, element.mechanism
    rate, w = np.vstack([np.reshape(turning["found"], (-1, 3)), np.zeros(3)]), start.w_WB[0]
    for index, joint in enumerate(mechanism.joints):
        if joint.kind != JointKind.REVOLUTE:
            continue
        parent, child = (mechanism.body_index[name] for name in (joint.parent, joint.child))
        above = np.zeros(3) if parent == len(w) else w[parent]
        R_P, R_C = start.R_WB[0, parent], start.R_WB[0, child]
        axis_seen = R_P.T @ (rate[child] - rate[parent] - np.cross(above, w[child] - above))
        size = float(np.linalg.norm(axis_seen))
        if not size:
            continue
        axis = joint.parent_frame[:, 2]
        axis_seen = axis_seen / size * np.sign(axis_seen @ axis or 1.0)
        try:
            turned = replace(
                joint,
                axis=tuple(R_C.T @ R_P @ axis_seen),
                orientation=to_rpy(R_P.T @ R_C),
                q0=(0.0,),
                rest=joint.rest - joint.q0[0],
            )
            joints = (*mechanism.joints[:index], turned, *mechanism.joints[index + 1 :])
            expected = _first(MechanismElement(replace(mechanism, joints=joints)))
        except InputError:  # its loops do not close, or a motion has it begin elsewhere
            continue
        difference, remainder = (_apart(lines, values) for values in ({}, expected))  # in tolerances
        seen = difference > 1
        left = float(np.max((remainder / np.where(seen, difference, 1.0))[seen], initial=0.0))
        says = f"the joint {joint.name} turns about ({_shown(axis_seen)}) of its parent, not about ({_shown(axis)})"
        largest = float(np.max(difference))
        off = Difference("first motion and reactions, in tolerances,", "1", largest, MOTION)
        explains, change = int(np.sum(seen)), float(np.linalg.norm(axis_seen - axis))
        name = f"axis of {joint.name}"
        yield off.cause(name, says, left * largest, _REMEDY, 2, explains=explains, change=change)


def _first(element: Any) -> dict[str, FloatArray]:
    """Expected values of the lines of the certificate that depend on joint axes."""
    motion, wrench = element.first_motion, element.first_wrench
    accelerations = {"acceleration": motion.acceleration, "angular acceleration": motion.angular_acceleration}
    return {"forces": wrench[:, :3], "torques": wrench[:, 3:], **accelerations} | {
        f"{name}{OF_FIRST_STEPS}": values for name, values in accelerations.items()
    }


def _apart(lines: Mapping[str, Mapping[str, Any]], expected: Mapping[str, FloatArray]) -> FloatArray:
    """Differences of lines that depend on joint axes, in tolerances: from ``expected``, or else from the scene."""
    parts = [np.zeros(1)]
    for name in sorted(_OF_AXES & lines.keys()):
        line = lines[name]
        if line["found"] and line["difference"]:
            off = np.subtract(line["found"], np.ravel(expected.get(name, line["expected"])))
            parts.append(np.abs(np.nan_to_num(off)) / scale_of(line) / line["tolerance"])
    return np.concatenate(parts)


def _shown(vector: FloatArray) -> str:
    return ", ".join(f"{x:.4g}" for x in np.round(vector, 9) + 0.0)  # not -0


# Opening of a broken loop, relative to the mechanism's size, and largest relative residual that counts as balanced.
_OPEN = 1e-4
_BALANCED = 1e-3


@by_rows("tree out of order", "the equations balance without the terms that an algorithm for depth-first order loses")
def lost_coupling(evidence: Evidence, _: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: the mass matrix lacks terms between a body and its descendants, all or one pair."""
    mechanism: Mechanism = evidence.element.mechanism
    pairs = _ancestry(mechanism)
    says = "the mass matrix lacks terms between a body and those that hang on it, as when a tree is not depth-first"
    remedy = "add bodies depth-first, or take the mass matrix from an algorithm that does not need that order"
    singles = [np.zeros_like(pairs) for _ in range(int(np.sum(pairs)) // 2)]
    for single, (row, column) in zip(singles, np.argwhere(np.triu(pairs)), strict=True):
        single[row, column] = single[column, row] = 1.0
    for lost in [pairs, *singles] if singles else ():
        yield CauseRow("tree out of order", says, Change(mechanism, coupling=lost), remedy)


def _ancestry(mechanism: Mechanism) -> FloatArray:
    """Mask of pairs of velocities whose joints are ancestor and descendant in the tree, (nv, nv)."""
    above = {joint.child: joint for joint in mechanism.joints}
    slices = dict(zip((joint.name for joint in mechanism.joints), mechanism.v_slices, strict=True))
    mask = np.zeros((mechanism.nv, mechanism.nv))
    for joint in mechanism.joints:
        parent = above.get(joint.parent)
        while parent is not None:
            mask[slices[joint.name], slices[parent.name]] = mask[slices[parent.name], slices[joint.name]] = 1.0
            parent = above.get(parent.parent)
    return mask


@hypothesis(
    "missing row",
    "the loop opens along some of its rows and along no other, and the equations balance along the motions that "
    "the others allow: nothing pulls it together there, as a stiff spring would",
)
def loop_lacks_row(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: a loop lacks one or more of its rows."""
    mechanism = evidence.element.mechanism
    part = stretch(evidence.element, evidence.run) if mechanism.loops and evidence.run is not None else None
    if part is None:
        return
    seen = of_run(evidence.element, evidence.run, part)
    if not seen.consistent:
        return
    rows = [seen.tree.loop_rows(state.motion) for state in seen.each]
    opened = np.max(np.abs([row.residual for row in rows]), axis=0)
    if np.max(opened) <= _OPEN * evidence.element.length:
        return
    off = Difference("opening of loops", "m", float(np.max(opened)), MOTION)
    for k, loop in enumerate(mechanism.loops):
        of_loop = rows[0].loop == k
        lost = np.flatnonzero(of_loop & (opened > CLOSES * np.max(opened)))
        if not len(lost) or np.max(np.abs(seen.left(Change(mechanism), tuple(lost.tolist())))) > _BALANCED:
            continue
        remainder = float(np.max(np.delete(opened, lost), initial=0.0))
        many = "a row" if len(lost) == 1 else f"{len(lost)} of its rows"
        says = f"the loop {loop.name} lacks {many}: it opens there freely, and holds less than a {loop.kind} joint"
        remedy = f"a {loop.kind} loop has {int(np.sum(of_loop))} rows; a point that is held gives three of them"
        yield off.cause("missing row", says, remainder, remedy)
