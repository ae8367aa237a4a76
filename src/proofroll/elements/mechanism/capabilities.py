"""Capabilities that a mechanism requires of a formulation, and the check that it provides them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from enum import StrEnum

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.joint import FACTS
from proofroll.elements.mechanism.model import Mechanism


class MechanismCapability(StrEnum):
    """Capability of a formulation; each is a text for a person."""

    FIXED = "fixed joints"
    REVOLUTE = "revolute joints"
    PRISMATIC = "prismatic joints"
    UNIVERSAL = "universal joints"
    SPHERICAL = "spherical joints"
    PLANAR = "planar joints"
    FREE = "free bodies"
    FIXED_LOOP = "loops closed by fixed joints"
    REVOLUTE_LOOP = "loops closed by revolute joints"
    PRISMATIC_LOOP = "loops closed by prismatic joints"
    UNIVERSAL_LOOP = "loops closed by universal joints"
    SPHERICAL_LOOP = "loops closed by spherical joints"
    PLANAR_LOOP = "loops closed by planar joints"
    REDUNDANT = "redundant constraints"
    SPRINGS = "springs between points"
    JOINT_SPRINGS = "springs, dampers and drives of joints"
    JOINT_FRICTION = "dry friction in joints"
    ARMATURE = "inertia of drives"
    STOPS = "stops of joints"
    REBOUNDS = "rebounds from stops (restitution)"
    CONTACT = "contact between bodies"
    CONTACT_FRICTION = "friction of contacts between bodies"
    CONTACT_REBOUNDS = "rebounds of bodies from each other (restitution)"


ALL_JOINTS = frozenset(MechanismCapability[kind.upper()] for kind in FACTS)
ALL_LOOPS = frozenset(item for item in MechanismCapability if item.name.endswith("_LOOP"))
FORCES = frozenset({MechanismCapability.SPRINGS, MechanismCapability.JOINT_SPRINGS})


def required(mechanism: Mechanism) -> frozenset[str]:
    """Capabilities that a mechanism requires; redundancy of its rows, which is found by analysis, is not among them."""
    capability = MechanismCapability
    needs: set[str] = {*mechanism.unmodelled}
    needs |= {capability[joint.kind.upper()] for joint in mechanism.joints}
    needs |= {capability[f"{loop.kind.upper()}_LOOP"] for loop in mechanism.loops}
    if mechanism.springs:
        needs.add(capability.SPRINGS)
    for joint in mechanism.joints:
        if joint.stiffness or joint.damping or joint.torque:
            needs.add(capability.JOINT_SPRINGS)
        if joint.friction:
            needs.add(capability.JOINT_FRICTION)
        if joint.armature:
            needs.add(capability.ARMATURE)
        if joint.limits:
            needs.add(capability.STOPS)
        if joint.restitution:
            needs.add(capability.REBOUNDS)
    for pair in mechanism.pairs:
        needs.add(capability.CONTACT)
        if pair.friction:
            needs.add(capability.CONTACT_FRICTION)
        if pair.restitution:
            needs.add(capability.CONTACT_REBOUNDS)
    return frozenset(needs)


def require(mechanism: Mechanism, provided: Collection[str], reasons: Mapping[str, str]) -> None:
    """Compares what a mechanism asks with what a formulation provides.

    Raises:
        Refused: it lacks something; the text says what, and why where a reason is given.
    """
    missing = sorted(required(mechanism) - set(provided))
    if missing:
        raise Refused(
            "needs " + ", ".join(f"{need}, and {reasons[need]}" if need in reasons else need for need in missing)
        )
