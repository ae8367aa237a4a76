"""The hypothesis that a joint turns about another axis than the scene's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.lines import differing
from proofroll.core.diagnosis.samples import both
from proofroll.elements.mechanism.diagnosis.equations import placed_of


@hypothesis("joint axis", "seen from the parent, the child turns about one direction throughout, which is not the axis")
def other_axis(evidence: Evidence) -> Iterator[Cause]:
    """A joint turns about another axis than the scene's."""
    mechanism = evidence.element.mechanism
    yield from _axes_at_start(evidence)
    found = both(evidence)
    if found is None:
        return
    placed = placed_of(mechanism, found[0])
    for joint in mechanism.joints:
        if joint.kind != "revolute":
            continue
        parent, child = (mechanism.body_index[name] for name in (joint.parent, joint.child))
        turning = placed.w_WB[:, child] - placed.spin(joint.parent)
        seen = np.einsum("tji,tj->ti", placed.R_WB[:, parent], turning)
        axis = joint.parent_frame[:, 2]
        own = np.linalg.svd(seen)[2][0]
        own = own * np.sign(own @ axis or 1.0)
        before, after = (float(np.max(np.linalg.norm(seen - np.outer(seen @ n, n), axis=-1))) for n in (axis, own))
        if above_round_off(before, float(np.max(np.abs(seen)))):
            says = f"the joint {joint.name} turns about ({_shown(own)}) of its parent, not about ({_shown(axis)})"
            remedy = "an axis is given in the frame of the parent body; look at whose frame the engine takes"
            covered = ("p_WB", "v_WB", "w_WB", "q_WB", "motion", "force", "torque")
            what = (f"turning of {joint.name} across its axis", "rad/s", before, after)
            yield Cause(f"axis of {joint.name}", says, *what, remedy, 2, covered)


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
