"""Start of contacts: which are closed, which slide, natural scales, and the check of a scene's start."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.core.last_results import kept
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import ContactMode, modes_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction, shut_by_pressing
from proofroll.elements.mechanism.contact.touching import PARALLEL, Moving, Touching, touch
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates, Solution
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion, Tree
from proofroll.elements.mechanism.dynamics.switches import NEAR
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import skew
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

# Digits of a file: gap or overlap of shapes that counts as touching, relative to a natural length, or in rad, and speed
# between shapes that touch at the start that counts as none, relative to a natural speed.
TOUCHING = 1e-9
# Speed of a followed place per unit of a joint's, relative to the length, up to which it stands: round-off is 1e-16.
_STANDS = 1e-12


def touches(mechanism: Mechanism, motion: BodyMotion, features: Sequence[int] | None = None) -> tuple[Touching, ...]:
    """Gap, normal and slide of all contacts at one instant; ``features``: that touch; None: the nearest."""
    index = mechanism.body_index
    bodies = [Moving(*values) for values in zip(motion.p_WB, motion.R_WB, motion.v_WB, motion.w_WB, strict=True)]
    asked = [None] * len(mechanism.contacts) if features is None else features[: len(mechanism.contacts)]
    pairs = zip(mechanism.contacts, asked, strict=True)
    return tuple(touch(c, bodies[index[c.body_a]], bodies[index[c.body_b]], feature) for c, feature in pairs)


def extent(mechanism: Mechanism, motion: BodyMotion) -> float:
    """Largest distance between joints, loops, springs, centres of mass, points and contacts at one instant [m]."""
    points = [(joint.child, joint.child_position) for joint in mechanism.joints]
    points += [(body.name, body.com) for body in mechanism.bodies]
    points += [(point.body, point.position) for point in mechanism.points]
    for part in (*mechanism.loops, *mechanism.links):
        points += [(part.body_a, part.position_a), (part.body_b, part.position_b)]
    index = mechanism.body_index
    places = [motion.p_WB[index[body]] + motion.R_WB[index[body]] @ np.array(position) for body, position in points]
    places += [touch.place for touch in touches(mechanism, motion)]
    return float(np.max(np.linalg.norm(np.array(places)[:, None] - np.array(places)[None], axis=-1)))


def followed_moves(mechanism: Mechanism, motion: BodyMotion, length: float) -> bool:
    """True if joints can move a followed place at once, in a mechanism of a ``length`` [m]; a wheel moves none."""
    for body, position in mechanism.followed:
        k = mechanism.body_index[body]
        by_joints = motion.J[k, :3] - skew(motion.R_WB[k] @ np.array(position)) @ motion.J[k, 3:]
        if np.any(np.abs(by_joints) > _STANDS * length):
            return True
    return False


class Scale(NamedTuple):
    """Natural length [m] and rate [1/s] of a mechanism at its start."""

    length: float
    rate: float

    @property
    def gap(self) -> float:
        """Largest gap that counts as touching [m]."""
        return TOUCHING * self.length

    @property
    def speed(self) -> float:
        """Largest speed that counts as rest [m/s]."""
        return TOUCHING * self.length * self.rate


def natural_length(mechanism: Mechanism, solution: Solution) -> float:
    """Largest of extent, prismatic travel and radii of gyration at one instant [m]; 0: it has none.

    That of a point at its place is the way to its nearest stop, or how far its speed carries it against its
    acceleration.
    """
    motion = solution.motion
    slides = [joint for joint in mechanism.joints if joint.kind == JointKind.PRISMATIC]
    ways = [abs(way) for joint in slides for way in (*joint.q0, joint.rest)]
    radii = [np.sqrt(np.trace(body.inertia) / body.mass) for body in mechanism.bodies if body.mass]
    length, pull = max([extent(mechanism, motion), *ways, *radii]), _largest(_rates(solution)[:, :3])
    stops = [abs(stop - j.q0[0]) for j in slides for stop in j.limits or () if abs(stop - j.q0[0]) > j.stop_digits]
    nearest = min(stops, default=0.0)
    return float(length or nearest or (pull and _largest(motion.v_WB) ** 2 / pull))


@kept
def natural_scale(mechanism: Mechanism) -> Scale:
    """Natural length, and the faster of the rates of gravity and of the first motion.

    Both are powers of two, so that a change of units causes no round-off. Joints at rest count as free.
    """
    solution = JointCoordinates(mechanism).solve(*mechanism.start())
    motion, rates, length = solution.motion, _rates(solution), natural_length(mechanism, solution) or 1.0
    pulls = _largest(mechanism.gravity) / length, _largest(rates[:, :3]) / length, _largest(rates[:, 3:])
    rate = max(np.sqrt(max(pulls)), _largest(motion.v_WB) / length, _largest(motion.w_WB)) or 1.0
    return Scale(*(2.0 ** round(np.log2(size)) for size in (length, rate)))


def _rates(solution: Solution) -> FloatArray:
    """Accelerations and angular accelerations of the bodies, shape (body, 6)."""
    return solution.motion.J @ solution.acceleration + solution.motion.bias


def _largest(values: ArrayLike) -> float:
    """Largest length of vectors, whatever the axes are."""
    return float(np.linalg.norm(np.atleast_2d(values), axis=-1).max(initial=0.0))


def start_digits(contacts: Sequence[object]) -> FloatArray:
    """Gap and speed of each contact that count as none: digits of a file, and of laws of joints rounding alone."""
    return np.array([NEAR if isinstance(contact, JointContact) else TOUCHING for contact in contacts])


def closed_and_still(
    touching: Sequence[Touching], lengths: FloatArray, rate: float, digits: FloatArray | float = TOUCHING
) -> tuple[list[bool], list[bool]]:
    """Two lists over the contacts: True if closed at the start and not opening, True if also at rest.

    Args:
        touching: the contacts.
        lengths: natural length along each, 1 for an angle.
        rate: natural rate [1/s].
        digits: gap and speed of each that count as none, relative to its natural ones.
    """
    rate = max(
        [rate, *(float(np.linalg.norm(touch.slide)) / size for touch, size in zip(touching, lengths, strict=True))]
    )
    least = lengths * digits
    closed_mask = [
        not touch.absent and touch.gap <= size and abs(float(touch.normal @ touch.slide)) <= size * rate
        for touch, size in zip(touching, least, strict=True)
    ]
    resting = [
        shut and bool(np.linalg.norm(touch.slide) <= size * rate)
        for shut, touch, size in zip(closed_mask, touching, least, strict=True)
    ]
    return closed_mask, resting


def at_start(
    mechanism: Mechanism, contacts: Sequence[JointContact | BodyContact | TurningFriction], touching: Sequence[Touching]
) -> ContactMode:
    """Modes of all contacts, ``touching`` at the start: open, slip where a closed one slides, else stick."""
    scale, kinds = natural_scale(mechanism), [joint.kind for joint in mechanism.joints]
    turns = [isinstance(c, JointContact) and kinds[c.joint.number] != JointKind.PRISMATIC for c in contacts]
    lengths = np.where(turns, 1.0, scale.length)
    closed_mask, resting = closed_and_still(touching, lengths, scale.rate, start_digits(contacts))
    return modes_of(shut_by_pressing(contacts, closed_mask), resting, tuple(touch.feature for touch in touching))


def check_contacts(mechanism: Mechanism) -> None:
    """Raises InputError if two bodies overlap or strike at the start, a disc lies flat, or a joint strikes its stop."""
    stopped = [joint for joint in mechanism.joints if joint.limits]
    if not (mechanism.contacts or stopped):
        return
    motion = Tree(mechanism).at(*mechanism.start())
    if not np.isfinite(extent(mechanism, motion)):
        raise InputError("geometries", "infinite", "places or sizes are too large to be computed with")
    scale = natural_scale(mechanism)
    for joint in stopped:
        assert joint.limits is not None
        (low, high), (q,), (v,) = joint.limits, joint.q0, joint.v0
        digits, least_speed = (
            joint.stop_digits,
            scale.speed if joint.kind == JointKind.PRISMATIC else TOUCHING * scale.rate,
        )
        if (q <= low + digits and v < -least_speed) or (q >= high - digits and v > least_speed):
            advice = "the joint starts on its stop and moves into it, an impact at time 0; correct v0 or start it apart"
            raise InputError(f"joints.{joint.name}.v0", v, advice)
    round_ends = {shape.name for shape in mechanism.geometries if shape.kind == "cylinder"}
    cylinders = {pair.name for pair in mechanism.pairs if round_ends & set(pair.geometries)}
    for contact, touching in zip(mechanism.contacts, touches(mechanism, motion), strict=True):
        if touching.absent:  # lines along edges cross beyond their ends
            continue
        between = f"{contact.body_a} and {contact.body_b}"
        if touching.gap < -scale.gap:
            advice = f"they overlap by {-touching.gap:.3g} m at the start; move one"
            raise InputError(f"pairs.{contact.name}", between, advice)
        if touching.gap <= scale.gap and (not touching.normal.any() or (contact.has_tip and touching.flat)):
            advice = "they touch at several points at once, without one normal; move one"
            raise InputError(f"pairs.{contact.name}", between, advice)
        slip = float(np.linalg.norm(touching.slide - touching.normal * (touching.normal @ touching.slide)))
        if touching.gap <= scale.gap and slip > scale.speed and np.isinf(contact.friction):
            advice = (
                f"they touch and slip at {slip:.3g} m/s, which friction = inf excludes; correct v0 or give a number"
            )
            raise InputError(f"pairs.{contact.name}.friction", contact.friction, advice)
        if touching.flat and touching.gap <= scale.gap and contact.pair not in cylinders:
            advice = "the disc lies flat and touches along its whole edge, not at one point; give it three spheres"
            if contact.features is not None:
                advice = f"the capsules touch along a line: {PARALLEL}; turn one"
            raise InputError(f"pairs.{contact.name}", between, advice)
        closing = -float(touching.normal @ touching.slide)
        if touching.gap <= scale.gap and closing > scale.speed:
            advice = (
                f"they touch and approach at {closing:.3g} m/s, an impact at time 0; correct v0 or start them apart"
            )
            raise InputError(f"pairs.{contact.name}", between, advice)
