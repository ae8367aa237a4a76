"""The tree of joints: sorted depth-first, or refused."""

from __future__ import annotations

from collections.abc import Sequence

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.checks import WORLD
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.parts import Body


def depth_first(bodies: Sequence[Body], joints: Sequence[Joint]) -> tuple[Joint, ...]:
    """The joints, each after the joint of its parent and directly before those of its descendants.

    Some engines are silently wrong in another order (Pinocchio's crba).

    Raises:
        InputError: a body with two parents or none, or a cycle.
    """
    holder: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in holder:
            other = holder[joint.child].name
            advice = f"the body has two parents, through {other} and {joint.name}; make one of these joints a loop"
            raise InputError(f"joints.{joint.name}.child", joint.child, advice)
        holder[joint.child] = joint
    for body in bodies:
        if body.name not in holder:
            raise InputError(f"bodies.{body.name}", body.name, "no joint has this body as its child; add a free joint")
    children: dict[str, list[Joint]] = {}
    for joint in joints:
        children.setdefault(joint.parent, []).append(joint)
    found: list[Joint] = []
    waiting = children.get(WORLD, [])[::-1]
    while waiting:  # without recursion: chains are long
        joint = waiting.pop()
        found.append(joint)
        waiting += children.get(joint.child, [])[::-1]
    if len(found) < len(joints):
        lost = next(joint for joint in joints if joint not in found)
        advice = "the joints form a cycle that never reaches the world; make one of its joints a loop"
        raise InputError(f"joints.{lost.name}.parent", lost.parent, advice)
    return tuple(found)


def check_masses(bodies: Sequence[Body], joints: Sequence[Joint]) -> None:
    """Whatever a joint moves has a mass, if not in the body itself, then in one that it carries.

    Raises:
        InputError: a body that moves carries no mass, and its joint has no armature.
    """
    carried = {body.name: body.mass for body in bodies} | {WORLD: 0.0}
    for joint in reversed(joints):  # sorted: the children come last
        carried[joint.parent] += carried[joint.child]
        if not carried[joint.child] and joint.nv and not joint.armature:
            raise InputError(
                f"bodies.{joint.child}.mass", 0.0, "a body without mass can move here; give it one or fix it"
            )
