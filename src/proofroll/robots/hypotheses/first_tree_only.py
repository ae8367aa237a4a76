"""Of several trees under the world only the first is kept."""

from __future__ import annotations

from proofroll.robots.hypotheses import RobotEvidence, RobotHypothesis
from proofroll.robots.model import WORLD, Robot, RobotJoint


def _change(evidence: RobotEvidence) -> Robot | None:
    robot, kept = evidence.robot, {WORLD}
    joints: list[RobotJoint] = []
    for joint in robot.joints:
        if joint.parent in kept and not (joint.parent == WORLD and joints):
            kept.add(joint.child)
            joints.append(joint)
    if len(joints) == len(robot.joints):
        return None
    moving = {joint.name for joint in joints}
    mimics = tuple(mimic for mimic in robot.mimics if {mimic.joint, mimic.other} <= moving)
    bodies = {name: body for name, body in robot.bodies.items() if name in kept}
    return robot.change(joints=tuple(joints), bodies=bodies, mimics=mimics)


HYPOTHESIS = RobotHypothesis(
    "only the first tree under the world is read",
    {"pinocchio": "4.1.0"},
    "put everything under one body of the world, or read each tree from a file of its own",
    _change,
)
