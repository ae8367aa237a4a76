"""The tree of joints: sorted depth-first, or refused."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

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


def clusters(joints: Sequence[Joint]) -> dict[str, list[str]]:
    """Bodies that fixed joints hold together, by the body that leads them (``world``, or the first of its cluster)."""
    leader = {WORLD: WORLD}
    found: dict[str, list[str]] = {WORLD: []}
    for joint in joints:  # sorted: the parent comes first
        leader[joint.child] = leader[joint.parent] if joint.kind == "fixed" else joint.child
        found.setdefault(leader[joint.child], []).append(joint.child)
    return found


def check_masses(bodies: Sequence[Body], joints: Sequence[Joint]) -> None:
    """Whatever can move has a mass and moments of inertia.

    Raises:
        InputError: a moving body, with all that is fixed to it, has none.
    """
    by_name = {body.name: body for body in bodies}
    for leader, members in clusters(joints).items():
        if leader == WORLD:
            continue
        heavy = [by_name[name] for name in members if by_name[name].mass > 0]
        if not heavy:
            raise InputError(f"bodies.{leader}.mass", 0.0, "a body without mass can move here; give it one or fix it")
        moments = [np.linalg.eigvalsh(body.inertia) for body in heavy]
        if not any(low > 0 for low, *_ in moments):
            advice = "a moving body needs positive moments of inertia about all axes; give small ones"
            raise InputError(f"bodies.{heavy[0].name}.inertia", heavy[0].inertia, advice)
