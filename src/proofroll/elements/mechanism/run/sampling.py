"""Fields of a sample and of a built model that engines give of a mechanism, and the mechanism of a scene."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from proofroll.core.engine import Regularised, Sample
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.dynamics.analysis import Start, general_place
from proofroll.elements.mechanism.dynamics.held_signals import begun
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array

# Relative singular value below which a constraint row of an engine depends on the others. It does not follow
# analysis.RANK: an engine's rows have other units and weights.
DEPENDENT = 1e-9
# Length of a constraint row relative to the longest, below which the row is round-off.
ROUND_OFF = 1e-12


@dataclass(frozen=True, slots=True)
class MechanismSample(Sample):
    """State of the bodies, arrays over them, and reactions of the joints.

    Attributes:
        joint_force, joint_torque: on the child of each joint, then on body_b of each loop, at the joint, world axes
            [N, N m], shape (joints + loops, 3); NaN where the engine does not know them.
        contact_force: on the body of the first geometry of each contact, world axes [N], shape (contacts, 3); zero
            where nothing touches, NaN where the engine does not know it.
        effort: of each actuator at its joint, clamped [N m, N], shape (actuators,).
        coupling: of each coupling on its joint_b [N m, N], shape (couplings,).
        drive: of prescribed motions, along each joint's coordinate [N m, N], shape (joints,); NaN for joints without.
        friction, stop: of dry friction and of a stop along each joint's coordinate [N m, N], shape (joints,); NaN for
            joints where the engine does not know them.
    """

    joint_force: Array | None = None
    joint_torque: Array | None = None
    contact_force: Array | None = None
    effort: Array | None = None
    coupling: Array | None = None
    drive: Array | None = None
    friction: Array | None = None
    stop: Array | None = None


@dataclass(frozen=True)
class MechanismBuilt:
    """Model read back from the engine at time 0 (never from the scene). None: the engine does not know it.

    Attributes:
        mass: of the bodies [kg], shape (bodies,).
        com: centre of mass in the body's frame [m], shape (bodies, 3).
        inertia: about the centre of mass, in the body's axes [kg m²], shape (bodies, 3, 3).
        joint_position: of each joint in the world [m], shape (joints, 3).
        joint_axis: its axis in the world, unit vectors, NaN for a joint without one, shape (joints, 3).
        gravity: acceleration of gravity in the world [m/s²], shape (3,).
        contact_gap: of each contact [m], shape (contacts,).
        contact_normal: unit vectors from b to a in the world, shape (contacts, 3).
        contact_place: point of contact in the world [m], shape (contacts, 3): on the shape that is not a plane, for two
            spheres on a.
        contact_friction, contact_restitution: coefficients that the engine made of the pair's, shape (contacts,).
        contact_static, contact_tangential: coefficients of static friction and of tangential restitution, of an engine
            that has them, shape (contacts,).
        contact_rolling: lever arm of rolling resistance [m], shape (contacts,).
        terms: capabilities that the model holds of those that a scene may do without
            (:class:`proofroll.core.element_abilities.HasOptionalCapabilities`).
        contact_response: rates of all slides caused by unit forces on body a of each contact, world axes [1/kg] (the
            Delassus matrix), shape (contacts, 3, contacts, 3); for a pair without friction only along normals.
        rows: number of the engine's constraint rows.
        rank: number of independent ones among them.
        mobility: velocities of the engine's model less ``rank``.
        acceleration: of the origin of each body's frame [m/s²], shape (bodies, 3).
        angular_acceleration: of each body in the world [rad/s²], shape (bodies, 3).
        mass_matrix_error: largest difference between the engine's mass matrix and the forces of its inverse dynamics
            for unit accelerations, relative to the matrix's largest element; for an engine that has both.
        mass_matrix, velocity_forces, gravity_forces: M, h and g of M v̇ + h + g = τ at time 0, in the velocities of
            the tree, (nv, nv), (nv,), (nv,); M with the armature of joints, g minus the weights.
        regularised: names of these quantities that the model softens, with tolerance and reason; the tolerance of
            ``acceleration`` and of ``angular_acceleration`` is relative to the largest component of any body.
    """

    mass: Array | None = None
    com: Array | None = None
    inertia: Array | None = None
    joint_position: Array | None = None
    joint_axis: Array | None = None
    gravity: Array | None = None
    rows: int | None = None
    rank: int | None = None
    mobility: int | None = None
    acceleration: Array | None = None
    angular_acceleration: Array | None = None
    mass_matrix_error: float | None = None
    mass_matrix: Array | None = None
    velocity_forces: Array | None = None
    gravity_forces: Array | None = None
    regularised: Mapping[str, Regularised] = field(default_factory=dict)
    contact_gap: Array | None = None
    contact_normal: Array | None = None
    contact_place: Array | None = None
    contact_friction: Array | None = None
    contact_restitution: Array | None = None
    contact_response: Array | None = None
    contact_static: Array | None = None
    contact_tangential: Array | None = None
    contact_rolling: Array | None = None
    terms: frozenset[str] | None = None


def mechanism_of(scene: Any) -> Mechanism:
    """Mechanism of a scene with one element, or the given mechanism itself; its held signals are set from outside.

    Raises:
        Refused: the scene has other elements.
    """
    if isinstance(scene, Mechanism):
        return begun(scene)
    mechanisms = [getattr(element, "mechanism", None) for element in scene.elements]
    if len(mechanisms) != 1 or not isinstance(mechanisms[0], Mechanism):
        raise Refused("needs a scene of one mechanism, and this formulation represents nothing else")
    return begun(mechanisms[0])


def row_rank(rows: Array) -> int:
    """Rank of constraint rows, each first scaled to length 1, shape (rows, velocities).

    Rows shorter than ``ROUND_OFF`` of the longest are what cancellation leaves of rows that are zero: scaled to length
    1 they would count as constraints, in a frame that is turned and not in one that is not.
    """
    sizes = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[sizes[:, 0] > ROUND_OFF * sizes.max(initial=0.0)]
    if not rows.size:
        return 0
    values = np.linalg.svd(rows / np.linalg.norm(rows, axis=1, keepdims=True), compute_uv=False)
    return int((values > DEPENDENT * values[0]).sum())


def independent_anywhere(
    start: Start, rows: Callable[[Start], tuple[Array, Array]], moved: Callable[[Start, Array], Start]
) -> int:
    """Number of independent constraint rows at the start or, where it is larger, at a :func:`general_place` near it."""
    near = general_place(start, rows, moved)
    return max(row_rank(rows(start)[1]), row_rank(rows(near)[1]))


def of_drives(mechanism: Mechanism, forces: Array) -> Array:
    """Forces that impose motions, by joint [N, N m], from those of the prescribed ones; NaN for joints without."""
    by_joint = np.full(len(mechanism.joints), np.nan)
    by_joint[[mechanism.joint_index[joint.name] for joint, _, _ in mechanism.prescribed]] = forces
    return by_joint


def unsaid(mechanism: Mechanism) -> tuple[Array, Array]:
    """Unknown forces and moments of joints and loops: NaN, shape (joints + loops, 3) each."""
    count = len(mechanism.joints) + len(mechanism.loops)
    return np.full((count, 3), np.nan), np.full((count, 3), np.nan)
