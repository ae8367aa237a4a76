"""Gaps, slips, forces and residuals of contacts, as variables of a run and as observables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.core.events import EVENT_ORDER
from proofroll.core.observable import Observable, Role
from proofroll.elements.mechanism.contact.coulomb import largest_friction
from proofroll.elements.mechanism.contact.touching import AT_REST, Moving, touch
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.shapes.geometry import (
    carried_bodies,
    contact_moments,
    shared_pairs,
    turned_bodies,
)
from proofroll.elements.mechanism.scene.signal import varies

if TYPE_CHECKING:
    from proofroll.elements.mechanism.dynamics.placed import Placed
    from proofroll.elements.mechanism.run.sampling import MechanismSample
    from proofroll.elements.mechanism.scene.model import Mechanism


# Residuals of Coulomb's law for the forces that a run reports: zero where they obey it.
RESIDUALS = (
    ("penetration", "m", "depth to which shapes overlap"),
    ("contact_pull", "N", "normal forces that pull"),
    ("cone_excess", "N", "friction beyond its coefficient times the normal force"),
    ("friction_direction", "1", "1 + T·u/(μN|u|): friction that is less than its bound or not against the slip u"),
    ("hop_speed", "m/s", "speed along the normal of pressing contacts"),
    ("natural_map", "N", "distance of forces from where Coulomb's law projects them with the slip"),
)
# Conservation laws that hold through impacts: energy, if nothing drives the bodies; momentum, if nothing else acts on
# them.
LAWS = (
    ("energy_gain", "J", "energy beyond that at the start"),
    ("momentum_error", "N s", "momentum now minus that at the start"),
    ("angular_momentum_error", "N m s", "moment of momentum about the origin now minus that at the start"),
)
# Least force of a pressing contact and least speed of a sliding one, relative to the mechanism's weight and speed.
PRESSES, SLIDES = 1e-6, 1e-2
# Error of contact forces, in parts of the largest, that no first look lets pass. Measured: at most 0.09 where contacts
# are hard or damped, 0.9 to 1.1 where softened ones chatter, 1.2 for friction of thrice its size that drives.
_WRONG = 1.0
_AXIS = 1e-12  # largest component of a unit normal that counts as zero


class Followed(NamedTuple):
    """Geometry and motion of all contacts along a run.

    Attributes:
        gap: [m], shape (time, contacts).
        slip: speed along the surfaces [m/s], shape (time, contacts).
        normal: unit vectors from b to a, shape (time, contacts, 3).
        slide: velocity of a relative to b at the contact [m/s], shape (time, contacts, 3).
        place: points of contact [m], shape (time, contacts, 3).
    """

    gap: FloatArray
    slip: FloatArray
    normal: FloatArray
    slide: FloatArray
    place: FloatArray


# Of the last mechanism, state of its bodies -> what :func:`follow_contacts` found there: events and columns of one run
# are made from the same samples.
_FOLLOWED: list[tuple[Mechanism, dict[bytes, FloatArray]]] = []


def follow_contacts(placed: Placed) -> Followed:
    """Gaps, slip speeds, normals, sliding velocities and places of all contacts at all times."""
    mechanism, index, count = placed.mechanism, placed.mechanism.body_index, len(placed.time)
    motion = placed.p_WB, placed.R_WB[:, :-1], placed.v_WB, placed.w_WB
    states = np.concatenate([values.reshape(count, -1) for values in motion], axis=1)
    earlier_rows = next((rows for last, rows in _FOLLOWED if last is mechanism), {})
    values = np.zeros((count, len(mechanism.contacts), 11))
    keys = [state.tobytes() for state in states]
    for k, key in enumerate(keys):
        if key in earlier_rows:
            values[k] = earlier_rows[key]
            continue
        bodies = [*map(Moving, *(fields[k] for fields in motion)), AT_REST]
        for c, contact in enumerate(mechanism.contacts):
            touching = touch(contact, bodies[index[contact.body_a]], bodies[index[contact.body_b]])
            across = touching.slide - touching.normal * (touching.normal @ touching.slide)
            vectors = touching.normal, touching.slide, touching.place
            values[k, c] = touching.gap, np.linalg.norm(across), *np.concatenate(vectors).tolist()
    _FOLLOWED[:] = [(mechanism, dict(zip(keys, values, strict=True)))]
    gap, slip, *parts = np.split(values, [1, 2, 5, 8], axis=-1)
    return Followed(gap[..., 0].copy(), slip[..., 0].copy(), *(part.copy() for part in parts))


def moments_along(placed: Placed, place: FloatArray, pressed: FloatArray) -> FloatArray:
    """Moments of contact forces on each of :func:`.turned_bodies` about its centre of mass [N m], (time, bodies, 3).

    Args:
        placed: motion of the bodies.
        place: of the contacts [m], (time, contacts, 3).
        pressed: their forces [N], (time, contacts, 3).
    """
    m = placed.mechanism
    centres = [placed.point(body, m.bodies[m.body_index[body]].com) for body in turned_bodies(m.contacts)]
    return contact_moments(m.contacts, centres, place, pressed)


def kept_laws(mechanism: Mechanism) -> frozenset[str]:
    """Names of the ``LAWS`` that hold for a mechanism with contacts, through any impact."""
    if not mechanism.contacts or mechanism.actuators or any(joint.torque for joint in mechanism.joints):
        return frozenset()
    if mechanism.forces or any(varies(signal) for signal in mechanism.signals):
        return frozenset()
    ends = {name for contact in mechanism.contacts for name in (contact.body_a, contact.body_b)}
    ends |= {name for spring in mechanism.links for name in (spring.body_a, spring.body_b)}
    ends |= {name for loop in mechanism.loops for name in (loop.body_a, loop.body_b)}
    held = any(joint.kind != JointKind.FREE and "world" in {joint.parent, joint.child} for joint in mechanism.joints)
    held = held or "world" in ends or bool(np.any(mechanism.gravity))
    # resistance against motion with an arm longer than that of friction feeds more into a back spin than friction takes
    fed = any(contact.rolling_resistance * abs(contact.bend) > contact.friction for contact in mechanism.contacts)
    return frozenset(name for name, _, _ in LAWS[fed : 1 if held else None])


def event_observables(mechanism: Mechanism) -> Iterator[Observable]:
    """Observables of the events of contacts, joints and efforts."""
    if mechanism.has_events:
        meaning = "times of all events of contacts, joints and efforts"
        # of efforts at their limits no engine tells the times
        watched = bool(mechanism.contacts)
        yield Observable("event_times", "s", meaning, Role.EVENT, asked_for=False, watched=watched)
        meaning = "events of another kind than the truth's"
        yield Observable(EVENT_ORDER, "events", meaning, Role.EVENT, asked_for=False)


def contact_observables(mechanism: Mechanism, sizes: Mapping[str, float], least: float) -> Iterator[Observable]:
    """Observables of a mechanism with contacts.

    Args:
        mechanism: the mechanism.
        sizes: natural size of a quantity, by its unit.
        least: floor of an observable, relative to its natural size.
    """
    if not mechanism.contacts:
        return
    length, speed, force = (least * sizes[unit] for unit in ("m", "m/s", "N"))
    yield Observable("gaps", "m", "distances between what may touch", Role.MOTION, floor=length, apart=True)
    yield Observable("slips", "m/s", "slip speeds of the contacts", Role.MOTION, floor=speed, asked_for=False)
    meaning = "normal forces between what may touch"
    yield Observable("normal_forces", "N", meaning, Role.REACTION, floor=force, headline=True)
    meaning = "contact forces, where they are determinate"
    told: dict[str, Any] = {"asked_for": False, "at_impacts": False, "of_contacts": True, "watched": True}
    sums = bool(shared_pairs(mechanism.contacts))  # how places of one pair share its force is seldom determined
    further = {**told, "watched": not sums}
    yield Observable("contact_forces", "N", meaning, Role.REACTION, floor=force, always=_WRONG, **further)
    if sums:
        meaning = "sums of the forces of each pair that touches at several places, where they are determinate"
        yield Observable("pair_forces", "N", meaning, Role.REACTION, floor=force, **told)
    if carried_bodies(mechanism.contacts):
        meaning = "sums of the contact forces on each body that touches in several pairs, where they are determinate"
        yield Observable("net_forces", "N", meaning, Role.REACTION, floor=force, **told)
    if turned_bodies(mechanism.contacts):
        meaning = (
            "moments of the contact forces on each body that touches at several places, where they are determinate"
        )
        yield Observable("net_torques", "N m", meaning, Role.REACTION, floor=sizes["N m"], **told)  # most balance
    meaning = "share of the samples so far without a normal force"
    yield Observable("unpressed", "1", meaning, Role.REACTION, floor=1.0, asked_for=False)
    laws = [law for law in LAWS if law[0] in kept_laws(mechanism)]
    for name, unit, meaning in (*RESIDUALS, *laws):
        difference = "energy" if unit == "J" else ""
        yield Observable(
            name, unit, meaning, Role.RESIDUAL, floor=1.0 if unit == "1" else least * sizes[unit],
            asked_for=False, hangs_on_events=False, difference_of=difference,
        )  # fmt: skip


def residuals(
    followed: Followed,
    pressed: FloatArray,
    friction: FloatArray,
    weight: float,
    speed: float,
    static: FloatArray | None = None,
) -> dict[str, FloatArray]:
    """Residuals of the contact laws and ``unpressed``, by name, shape (time, contacts).

    ``penetration`` always has values; the others are NaN where neither N nor a component of the force is known.

    Args:
        followed: the contacts along the motion.
        pressed: forces on their first bodies, as of :func:`normal_forces`.
        friction: their coefficients while they slip, shape (contacts,).
        weight: of the mechanism [N].
        speed: natural speed, which scales slip against weight in the natural map [m/s].
        static: coefficients while they stick; None: the same.
    """
    kinetic = np.broadcast_to(friction, followed.slip.shape)
    friction = np.where(followed.slip > SLIDES * speed, friction, friction if static is None else static)
    n, u_n = followed.normal, np.sum(followed.normal * followed.slide, axis=-1)
    N, pressed = normal_forces(followed, pressed), pressed[..., :3]
    complete = np.all(np.isfinite(pressed), axis=-1)
    has_force = np.isfinite(N) | np.any(np.isfinite(pressed), axis=-1)
    u = followed.slide - n * u_n[..., None]
    T = np.where(complete[..., None], pressed - N[..., None] * n, 0.0)
    presses = np.asarray(PRESSES * weight < N)
    t = np.linalg.norm(T, axis=-1)
    bound = largest_friction(friction, np.where(N > 0, N, 0.0))
    excess = np.maximum(t - bound, 0.0)
    slides = np.asarray(presses & complete & (followed.slip > SLIDES * speed) & (friction > 0))
    against = np.sum(T * u, axis=-1) / (np.where(slides, bound, 1.0) * np.where(slides, followed.slip, 1.0))
    # De Saxcé's correction makes the law a projection onto the cone: λ = P(λ − r (u + μ|u_t| n))
    r = weight / speed

    def off_cone(friction: FloatArray) -> FloatArray:
        slipping = np.where(np.isinf(friction), 0.0, friction)  # of what never slips the cone is a half space
        pushed, pulled = N - r * (u_n + slipping * followed.slip), T - r * u
        length = np.linalg.norm(pulled, axis=-1)
        kept, holds = _onto_cone(pushed, length, friction)
        across = pulled * (holds / np.where(length > 0, length, 1.0))[..., None] - T
        return np.asarray(np.maximum(np.abs(kept - N), np.linalg.norm(across, axis=-1)))

    off = np.minimum(off_cone(friction), off_cone(kinetic))  # what begins to slip slides already, or still sticks
    values = {
        "penetration": np.maximum(-followed.gap, 0.0),
        "contact_pull": np.maximum(-N, 0.0),
        "cone_excess": excess,
        "friction_direction": np.where(slides, 1.0 + against, 0.0),
        "hop_speed": np.where(presses, np.abs(u_n), 0.0),
        "natural_map": np.where(presses, np.where(complete, off, 0.0), excess),
    }
    counts = np.arange(len(N))[:, None]
    values["unpressed"] = np.cumsum(np.where(counts > 0, np.logical_not(presses), 0), axis=0) / np.maximum(counts, 1)
    without_forces = {"penetration"}
    return {
        name: value if name in without_forces else np.where(has_force, value, np.nan) for name, value in values.items()
    }


def normal_forces(followed: Followed, pressed: FloatArray) -> FloatArray:
    """Normal force of each contact [N], shape (time, contacts); NaN where it is not known.

    ``pressed``: forces on the first bodies [N], (time, contacts, 3), NaN where not determinate; behind them perhaps
    moments against turning [N m] and normal forces, (time, contacts, 7).
    """
    in_use = np.abs(followed.normal) > _AXIS
    N = np.sum(np.where(in_use, pressed[..., :3], 0.0) * followed.normal, axis=-1)
    return np.asarray(np.where(np.isnan(N), pressed[..., 6], N) if pressed.shape[-1] > 3 else N)


def _onto_cone(N: FloatArray, T: FloatArray, friction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nearest point of the cone T ≤ μN to given normal forces and sizes of friction [N]: (normal force, friction)."""
    finite = np.where(np.isinf(friction), 0.0, friction)
    within = largest_friction(friction, N) >= T
    beyond = np.where(np.isinf(friction), N <= 0, -finite * T >= N)
    pressed = (N + finite * T) / (1 + finite**2)
    kept = np.where(within, N, np.where(beyond, 0.0, pressed))
    return kept, np.where(within, T, np.where(beyond, 0.0, finite * pressed))


def given_forces(mechanism: Mechanism, samples: Sequence[MechanismSample]) -> FloatArray:
    """Forces on body a of each contact [N], shape (time, contacts, 3); NaN where the engine does not know them.

    Raises:
        Diverged: the forces have another shape.
    """
    count = len(mechanism.contacts)
    empty = np.full((count, 3), np.nan)
    forces = [empty if sample.contact_force is None else np.asarray(sample.contact_force) for sample in samples]
    for force in forces:
        if force.size != 3 * count:
            raise Diverged(f"the engine gave contact_force with shape {force.shape} instead of {(count, 3)}")
    return np.array([force.reshape(count, 3) for force in forces], dtype=np.float64)
