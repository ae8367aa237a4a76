"""Bodies without inertia that fixed joints hold: in route 2, which divides by inertias, they borrow from a neighbour.

Bodies that are fixed to each other move as one, so mass may go from one to another without any change of the motion. Of
the wrenches only those of the fixed joints between them change, by what the lent mass needs, which is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from proofroll.elements.mechanism.checks import WORLD
from proofroll.elements.mechanism.model import Body, Mechanism
from proofroll.elements.mechanism.rotations import Array, from_rpy
from proofroll.elements.mechanism.tree import clusters


@dataclass(frozen=True)
class Loan:
    """What a body got (or with negative numbers gave): kg, m in its frame, kg m² about that place in its axes."""

    mass: float
    com: Array
    inertia: Array


def with_borrowed_mass(mechanism: Mechanism) -> tuple[Mechanism, dict[str, Loan]]:
    """The mechanism with inertia in every body that a fixed joint holds, and what each of them got or gave.

    What is fixed to the world gets a unit of mass and inertia from nobody.
    """
    bodies = {body.name: body for body in mechanism.bodies}
    poses = _poses(mechanism)
    loans: dict[str, Loan] = {}
    for leader, members in clusters(mechanism.joints).items():
        needy = [name for name in members if not _has_inertia(bodies[name])]
        donor = next((name for name in members if _has_inertia(bodies[name])), None)
        if leader == WORLD:
            loans |= {name: Loan(1.0, np.zeros(3), np.eye(3)) for name in needy}
        elif needy and donor is not None:
            giver, (p, R) = bodies[donor], poses[donor]
            part, inertia = giver.mass / (len(needy) + 1), np.array(giver.inertia) / (len(needy) + 1)
            loans[donor] = Loan(-part * len(needy), np.array(giver.com), -inertia * len(needy))
            for name in needy:
                p_b, R_b = poses[name]
                turned = R_b.T @ R
                loans[name] = Loan(part, R_b.T @ (p - p_b) + turned @ giver.com, turned @ inertia @ turned.T)
    changed = (_together(body, loans[body.name]) if body.name in loans else body for body in mechanism.bodies)
    return (replace(mechanism, bodies=tuple(changed)), loans) if loans else (mechanism, loans)


def lent_wrenches(mechanism: Mechanism, loans: Mapping[str, Loan], wrenches: Mapping[str, Array]) -> Array:
    """What loans add to the wrench of each joint, about its place, (joints, 6).

    Args:
        mechanism: any.
        loans: see :func:`with_borrowed_mass`.
        wrenches: force and moment about the world's origin that each loan's motion needs, N and N m.
    """
    needed = {name: wrenches[name].copy() for name in loans}
    added = np.zeros((len(mechanism.joints), 6))
    for number in reversed(range(len(mechanism.joints))):
        joint = mechanism.joints[number]
        if joint.kind == "fixed" and joint.child in needed:
            added[number] = needed[joint.child]
            needed[joint.parent] = needed.get(joint.parent, np.zeros(6)) + needed[joint.child]
    return added


def _has_inertia(body: Body) -> bool:
    return body.mass > 0 and bool(np.linalg.eigvalsh(body.inertia)[0] > 0)


def _poses(mechanism: Mechanism) -> dict[str, tuple[Array, Array]]:
    """Place and axes of each body in the frame of what leads its cluster."""
    found = {WORLD: (np.zeros(3), np.eye(3))}
    for joint in mechanism.joints:
        found[joint.child] = (np.zeros(3), np.eye(3))
        if joint.kind == "fixed":
            p, R = found[joint.parent]
            turned = R @ from_rpy(joint.orientation)
            found[joint.child] = (p + R @ joint.position - turned @ joint.child_position, turned)
    return found


def _together(body: Body, loan: Loan) -> Body:
    """The body with its loan as one body."""
    mass = body.mass + loan.mass
    com = (body.mass * np.array(body.com) + loan.mass * loan.com) / mass
    inertia = np.array(body.inertia) + loan.inertia
    for part, place in ((body.mass, np.array(body.com)), (loan.mass, loan.com)):
        arm = place - com
        inertia = inertia + part * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    x, y, z = com.tolist()
    return replace(body, mass=mass, com=(x, y, z), inertia=inertia.tolist())
