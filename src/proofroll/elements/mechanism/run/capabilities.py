"""Capabilities that a mechanism requires of a formulation, and the check that it provides them."""

import math
from collections.abc import Collection, Iterator, Mapping
from enum import StrEnum

from proofroll.core.engine_abilities import needed
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.dynamics.analysis import lacks_inertia
from proofroll.elements.mechanism.dynamics.held_signals import has_held
from proofroll.elements.mechanism.scene.joint_kinds import FACTS
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.shapes.pair_rules import CURVED
from proofroll.elements.mechanism.scene.signal import is_held, varies


class MechanismCapability(StrEnum):
    """Capability of a formulation; each is a text for a person."""

    FIXED = "fixed joints"
    REVOLUTE = "revolute joints"
    PRISMATIC = "prismatic joints"
    CYLINDRICAL = "cylindrical joints"
    UNIVERSAL = "universal joints"
    SPHERICAL = "spherical joints"
    PLANAR = "planar joints"
    FREE = "free bodies"
    FIXED_LOOP = "loops closed by fixed joints"
    REVOLUTE_LOOP = "loops closed by revolute joints"
    PRISMATIC_LOOP = "loops closed by prismatic joints"
    CYLINDRICAL_LOOP = "loops closed by cylindrical joints"
    UNIVERSAL_LOOP = "loops closed by universal joints"
    SPHERICAL_LOOP = "loops closed by spherical joints"
    PLANAR_LOOP = "loops closed by planar joints"
    DISTANCE_LOOP = "loops closed by struts"
    REDUNDANT = "redundant constraints"
    SPRINGS = "springs between points"
    SPRING_LAWS = "springs with a force of their own"
    BUSHINGS = "bushings"
    APPLIED_FORCES = "applied forces and moments"
    JOINT_SPRINGS = "springs, dampers and drives of joints"
    JOINT_FRICTION = "dry friction in joints"
    ARMATURE = "inertia of drives"
    STOPS = "stops of joints"
    REBOUNDS = "rebounds from stops (restitution)"
    CONTACT = "contact between bodies"
    CONTACT_FRICTION = "friction of contacts between bodies"
    UNBOUNDED_FRICTION = "contacts that never slip (friction = inf)"
    STATIC_FRICTION = "static friction of contacts above their kinetic friction"
    CONTACT_REBOUNDS = "rebounds of bodies from each other (restitution)"
    TURNING_FRICTION = "friction of contacts against rolling and spinning"
    SHARED_CONE = "one cone of sliding, spinning and rolling friction"
    SLIP_REBOUNDS = "slips that impacts reverse (tangential restitution)"
    VERTICES = "contact of points (vertices, ends of cables)"
    SPHERES = "contact of spheres"
    ELLIPSOIDS = "contact of ellipsoids"
    DISCS = "contact of flat discs"
    PLANES = "contact with planes"
    BOXES = "contact of boxes"
    CAPSULES = "contact of capsules"
    CYLINDERS = "contact of cylinders"
    BORES = "contact with bores"
    SHAFTS = "contact with endless shafts"
    BOWLS = "contact with bowls"
    CONES = "contact with cones"
    TORI = "contact with tori"
    DECLARED_WALLS = "contact with walls by formula"
    ACTUATORS = "actuators of joints"
    SATURATION = "limits of efforts"
    COUPLINGS = "couplings of joints"
    COUPLINGS_OF_MANY = "couplings of three or more joints"
    MASSLESS = "joints that move a mass through loops or couplings alone"
    SIGNALS = "drives and targets that change in time"
    HELD = "targets held between instants"
    MOTIONS = "prescribed motions of joints"
    ORIENTATION = "the orientation of a ball that rolls"


ALL_JOINTS = frozenset(MechanismCapability[kind.upper()] for kind in FACTS)
ALL_LOOPS = frozenset(item for item in MechanismCapability if item.name.endswith("_LOOP"))
_FORCES = ("SPRINGS", "SPRING_LAWS", "BUSHINGS", "APPLIED_FORCES", "JOINT_SPRINGS")
FORCES = frozenset(MechanismCapability[name] for name in _FORCES)
# Kind of a geometry -> the capability to let it touch; a sphere of radius 0 is a vertex.
_SHAPES = {
    "sphere": "SPHERES", "ellipsoid": "ELLIPSOIDS", "circle": "DISCS", "plane": "PLANES", "box": "BOXES",
    "capsule": "CAPSULES", "cylinder": "CYLINDERS", "bore": "BORES", "shaft": "SHAFTS", "bowl": "BOWLS",
    "cone": "CONES", "torus": "TORI", "declared": "DECLARED_WALLS",
}  # fmt: skip
CURVED_WALLS = frozenset(MechanismCapability[_SHAPES[kind]] for kind in CURVED)
ALL_SHAPES = frozenset(MechanismCapability[name] for name in (*_SHAPES.values(), "VERTICES"))


def _touching(mechanism: Mechanism) -> Iterator[str]:
    """Capabilities that the geometries of pairs require."""
    names = {name for pair in mechanism.pairs for name in pair.geometries}
    for geometry in (geometry for geometry in mechanism.geometries if geometry.name in names):
        is_vertex = geometry.kind == "sphere" and not geometry.radius
        yield MechanismCapability["VERTICES" if is_vertex else _SHAPES[geometry.kind]]


def required(mechanism: Mechanism) -> frozenset[str]:
    """Capabilities that a mechanism requires, but for redundant constraints, which only an analysis finds."""
    capability = MechanismCapability
    needs: set[str] = {*mechanism.unmodelled}
    needs |= {capability[joint.kind.upper()] for joint in mechanism.joints}
    needs |= {capability[f"{loop.kind.upper()}_LOOP"] for loop in mechanism.loops}
    needs |= {*_touching(mechanism)}
    joints, pairs, actuators = mechanism.joints, mechanism.pairs, mechanism.actuators
    loads = mechanism.signals[: len(mechanism.signals) - len(mechanism.prescribed)]
    asked: dict[str, bool] = {
        capability.SPRINGS: bool(mechanism.springs),
        capability.SPRING_LAWS: any(spring.force for spring in mechanism.springs),
        capability.BUSHINGS: bool(mechanism.bushings),
        capability.APPLIED_FORCES: bool(mechanism.forces),
        capability.JOINT_SPRINGS: any(joint.stiffness or joint.damping or joint.torque for joint in joints),
        capability.JOINT_FRICTION: any(joint.friction for joint in joints),
        capability.ARMATURE: any(joint.armature for joint in joints),
        capability.STOPS: any(joint.limits for joint in joints),
        capability.REBOUNDS: any(joint.restitution for joint in joints),
        capability.CONTACT: bool(pairs),
        capability.CONTACT_FRICTION: any(0 < pair.friction < math.inf for pair in pairs),
        capability.UNBOUNDED_FRICTION: any(math.isinf(pair.friction) for pair in pairs),
        capability.STATIC_FRICTION: any(pair.static != pair.friction for pair in pairs),
        capability.CONTACT_REBOUNDS: any(pair.restitution for pair in pairs),
        capability.TURNING_FRICTION: any(
            pair.cone == "separate" and (pair.rolling_resistance or pair.spinning_friction) for pair in pairs
        ),
        capability.SHARED_CONE: mechanism.shares_cone,
        capability.SLIP_REBOUNDS: any(pair.tangential_restitution for pair in pairs),
        capability.ACTUATORS: bool(actuators),
        capability.SATURATION: any(actuator.limit is not None for actuator in actuators),
        capability.COUPLINGS: bool(mechanism.couplings),
        capability.COUPLINGS_OF_MANY: any(len(coupling.terms) > 2 for coupling in mechanism.couplings),
        capability.MASSLESS: lacks_inertia(mechanism),
        capability.SIGNALS: any(varies(signal) for signal in loads if not is_held(signal)),
        capability.MOTIONS: bool(mechanism.prescribed),
        capability.HELD: bool(mechanism.cells) or has_held(mechanism),
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
        raise Refused(needed(missing, reasons))
