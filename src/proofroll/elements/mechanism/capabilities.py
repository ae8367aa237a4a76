"""Capabilities that a mechanism requires of a formulation, and the check that it provides them."""

from collections.abc import Collection, Mapping
from enum import StrEnum

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.joint import FACTS
from proofroll.elements.mechanism.light_joints import lacks_inertia
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.signal import varies


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
    ACTUATORS = "actuators of joints"
    SATURATION = "limits of efforts"
    COUPLINGS = "couplings of joints"
    COUPLINGS_OF_MANY = "couplings of three or more joints"
    MASSLESS = "joints that move a mass through loops or couplings alone"
    SIGNALS = "drives and targets that change in time"


ALL_JOINTS = frozenset(MechanismCapability[kind.upper()] for kind in FACTS)
ALL_LOOPS = frozenset(item for item in MechanismCapability if item.name.endswith("_LOOP"))
FORCES = frozenset({MechanismCapability.SPRINGS, MechanismCapability.JOINT_SPRINGS})


def required(mechanism: Mechanism) -> frozenset[str]:
    """Capabilities that a mechanism requires, but for redundant constraints, which only an analysis finds."""
    capability = MechanismCapability
    needs: set[str] = {*mechanism.unmodelled}
    needs |= {capability[joint.kind.upper()] for joint in mechanism.joints}
    needs |= {capability[f"{loop.kind.upper()}_LOOP"] for loop in mechanism.loops}
    joints, pairs, actuators = mechanism.joints, mechanism.pairs, mechanism.actuators
    asked: dict[str, bool] = {
        capability.SPRINGS: bool(mechanism.springs),
        capability.JOINT_SPRINGS: any(joint.stiffness or joint.damping or joint.torque for joint in joints),
        capability.JOINT_FRICTION: any(joint.friction for joint in joints),
        capability.ARMATURE: any(joint.armature for joint in joints),
        capability.STOPS: any(joint.limits for joint in joints),
        capability.REBOUNDS: any(joint.restitution for joint in joints),
        capability.CONTACT: bool(pairs),
        capability.CONTACT_FRICTION: any(pair.friction for pair in pairs),
        capability.CONTACT_REBOUNDS: any(pair.restitution for pair in pairs),
        capability.ACTUATORS: bool(actuators),
        capability.SATURATION: any(actuator.limit is not None for actuator in actuators),
        capability.COUPLINGS: bool(mechanism.couplings),
        capability.COUPLINGS_OF_MANY: any(len(coupling.terms) > 2 for coupling in mechanism.couplings),
        capability.MASSLESS: lacks_inertia(mechanism),
        capability.SIGNALS: any(map(varies, mechanism.signals)),
    }
    needs |= {need for need, applies in asked.items() if applies}
    return frozenset(needs)


def require(mechanism: Mechanism, provided: Collection[str], reasons: Mapping[str, str]) -> None:
    """Checks that a formulation provides all that a mechanism requires.

    Raises:
        Refused: capabilities are missing; the text names them, with a reason where ``reasons`` has one.
    """
    missing = sorted(required(mechanism) - set(provided))
    if missing:
        raise Refused(
            "needs " + ", ".join(f"{need}, and {reasons[need]}" if need in reasons else need for need in missing)
        )
