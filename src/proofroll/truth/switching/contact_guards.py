"""Guards that end a stretch with contacts, for both routes: values that are negative while a mode lasts."""

import itertools
from collections.abc import Callable, Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.contact.distributions import ContactCones, Distribution, best_distribution, cones_of
from proofroll.elements.mechanism.contact.joint_laws import JointContact, off_stops
from proofroll.elements.mechanism.contact.modes import (
    FAINT,
    REST,
    Acting,
    ContactMode,
    Features,
    features_of,
    heading_of,
    slip_velocity,
)
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.contact.touching import FLAT, Touching
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.truth.followed_paths import time_accuracy

_UNLOADED = 1e-11  # normal force, in natural units, that is round-off where a contact leaves
# Value of Painlevé's measure (1 without friction) that counts as zero.
LEAST_RESPONSE = 1e-3
# Speed of a contact in the motion that begins, and a difference of directions, that count as none: the distribution is
# known to 1e-8.
_MOVES = 1e-6
_NO_LOAD = 1e-9  # normal force, relative to the largest, that counts as none where contacts share a load
_FEW = 6  # contacts that share a load, up to which all groups of them are tried
TURNED = 0.5  # cosine of the angle by which a line may turn in a stretch
_TOGETHER = 1e-13  # relative to the mechanism's size: gaps of contacts of a face that bounces, by round-off
# Borders between features of solids that are passed at one instant at most, and length, relative to the mechanism's
# size, by which features are left and still the nearest: round-off.
_MOST_BORDERS, _ON_BORDER = 4, 1e-13
NOT_SHARED = -1.0  # value of a guard that no shared load concerns
_BORNE = 1e-9  # part of a bound by which friction of a distribution that holds may exceed it
_DIGITS = 1e-14  # relative to the mechanism's size: round-off of a gap that has just opened


Touchable = BodyContact | JointContact | TurningFriction


class ContactGuard(NamedTuple):
    """A condition that ends a stretch.

    Attributes:
        contact: index of the contact; -1: all contacts.
        kind: ``close``: a gap closes; ``lift``: a normal force reaches zero; ``still``: a slip stops; ``break``: the
            friction of a sticking contact reaches its bound; ``turn``: its line has turned so far that its sense has
            to be taken anew; ``flat``: a disc lies flat, capsules touch along a line, or
            a ball comes to the tip of a cone; ``tear``: Painlevé's measure
            reaches zero; ``share``: the motion begins to depend on how contacts share a load; ``grip``: no distribution
            of a shared load that sticking contacts can bear is left; ``pass``: the nearest features of solids are left.
        border: number of the border by which features are left.
    """

    contact: int
    kind: Literal["close", "lift", "still", "break", "turn", "flat", "tear", "share", "grip", "pass"]
    border: int = 0


class SolvedContacts(NamedTuple):
    """Motion and forces at a state in a mode.

    Attributes:
        touching: geometry and sliding velocity of each contact.
        mode: the mode, with lines of contacts as they lie now.
        velocity, acceleration: in the route's own coordinates.
        slide_rate: rate of each sliding velocity, (contacts, 3).
        force: on body a of each contact, (contacts, 3).
        response: Painlevé's measure, 1 without friction.
        splits: ways to split a load that contacts share: changes of the normal forces, (contacts, ways).
        spread: change of the acceleration with these, the whole of unit length.
        shifts: changes of all forces with these, (contacts, 3, ways).
    """

    touching: Sequence[Touching]
    mode: ContactMode
    velocity: Array
    acceleration: Array
    slide_rate: Array
    force: Array
    response: float
    splits: Array
    spread: float
    shifts: Array


def guards_of(contacts: Sequence[Touchable], mode: ContactMode) -> list[ContactGuard]:
    """Guards of a mode, in an order that both routes share."""
    guards: list[ContactGuard] = []
    on_stops = off_stops(contacts, [acting.kind != "open" for acting in mode])
    for k, (contact, acting) in enumerate(zip(contacts, mode, strict=True)):
        features = contact.features if isinstance(contact, BodyContact) else None
        if features is not None:
            borders = features.borders(acting.feature, 0.0, 0.0, 0.0)
            guards += [ContactGuard(k, "pass", number) for number in range(len(borders))]
        slot = contact.box_slot if isinstance(contact, BodyContact) else None
        if slot is not None:
            guards += [ContactGuard(k, "pass", number) for number in range(1 + slot.leads)]
        if acting.kind == "open":
            if contact.pressed_by is None and not (slot is not None and slot.absent(acting.feature)):
                guards.append(ContactGuard(k, "close"))
            continue
        if contact.presses:
            guards.append(ContactGuard(k, "lift"))
        if (contact.friction or contact.bound) and np.isfinite(contact.friction) and k not in on_stops:  # else it stays
            guards.append(ContactGuard(k, "still" if acting.kind == "slip" else "break"))
        if acting.along is not None and contact.friction:  # a joint that rubs has none, and its line never turns
            guards.append(ContactGuard(k, "turn"))
        parallel = features is not None and features.needs_angle(acting.feature)
        if parallel or (isinstance(contact, BodyContact) and contact.may_lie):
            guards.append(ContactGuard(k, "flat"))
    if any(acting.kind == "slip" and contact.friction for contact, acting in zip(contacts, mode, strict=True)):
        guards.append(ContactGuard(-1, "tear"))
        if sum(acting.kind != "open" for acting in mode) > 1:
            guards.append(ContactGuard(-1, "share"))
    # one alone may share its load with joints that exclude a direction of its slip
    if any(acting.kind == "stick" for acting in mode):
        guards.append(ContactGuard(-1, "grip"))
    return guards


def guard_value(
    guard: ContactGuard, mode: ContactMode, contacts: Sequence[Touchable], solved: SolvedContacts, normals: Array
) -> float:
    """Value of a guard.

    Args:
        guard: the guard.
        mode: as it began.
        contacts: all of them.
        solved: motion and forces.
        normals: as by :func:`pressing`.
    """
    if guard.contact < 0:
        return _of_all(guard, contacts, solved)
    acting, touch = solved.mode[guard.contact], solved.touching[guard.contact]
    if guard.kind in {"close", "flat", "pass"}:
        left = touch.borders[guard.border].left_by if guard.kind == "pass" else 0.0
        return {"close": -float(touch.gap), "flat": FLAT - touch.tilt, "pass": float(left)}[guard.kind]
    if guard.kind == "turn":
        began = mode[guard.contact].along
        assert began is not None  # a contact without a line
        assert acting.along is not None  # has no such guard
        return TURNED - float(np.dot(began, acting.along))
    if guard.kind == "still":
        return _stopping(acting, touch)
    if gripped(solved, guard.contact):
        return NOT_SHARED  # together with all that share its load
    return (
        -float(normals[guard.contact]) if guard.kind == "lift" else _beyond_its_bound(guard.contact, contacts, solved)
    )


def _of_all(guard: ContactGuard, contacts: Sequence[Touchable], solved: SolvedContacts) -> float:
    """Value of a guard that concerns all contacts."""
    if guard.kind == "grip":
        grip = best_grip(contacts, solved.touching, solved)
        return NOT_SHARED if grip is None else -grip.margin
    return LEAST_RESPONSE - solved.response if guard.kind == "tear" else _undecided(contacts, solved)


def gripped(solved: SolvedContacts, k: int) -> bool:
    """True for a contact that shares its load while a contact sticks, so that its force alone decides nothing."""
    return any(acting.kind == "stick" for acting in solved.mode) and bool(
        np.abs(solved.shifts[k]).max(initial=0.0) > RANK
    )


class SharedForces(Protocol):
    """Forces in a mode, and how they may be distributed; see :class:`SolvedContacts`."""

    @property
    def mode(self) -> ContactMode:
        """The mode."""

    @property
    def force(self) -> Array:
        """Forces on body a of each contact, (contacts, 3)."""

    @property
    def shifts(self) -> Array:
        """Changes of all forces that cause no motion, (contacts, 3, ways)."""


def borne_forces(contacts: Sequence[Touchable], touching: Sequence[Touching], solved: SharedForces) -> Array:
    """Forces, (contacts, 3), of a shared load in a distribution that contacts can bear; as they are without one."""
    cones = _cones(contacts, touching, solved)
    if not solved.shifts.shape[2] or cones.hold(np.zeros(solved.shifts.shape[2]), _BORNE):
        return solved.force
    best = best_distribution(cones)
    return solved.force if best is None else np.asarray(solved.force + solved.shifts @ best.weights)


def best_grip(contacts: Sequence[Touchable], touching: Sequence[Touching], solved: SharedForces) -> Distribution | None:
    """Distribution of a shared load that closed contacts bear best; None: they share none, or nothing sticks."""
    if not solved.shifts.shape[2] or all(acting.kind != "stick" for acting in solved.mode):
        return None
    return best_distribution(_cones(contacts, touching, solved))


def _cones(contacts: Sequence[Touchable], touching: Sequence[Touching], solved: SharedForces) -> ContactCones:
    """Inequalities of closed contacts in a mode."""
    return cones_of(
        kinds=[acting.kind for acting in solved.mode],
        normals=np.array([touch.normal for touch in touching]).reshape(-1, 3),
        friction=np.array([contact.static for contact in contacts]),
        bounds=np.array([contact.bound for contact in contacts]),
        pressed_by=[contact.pressed_by for contact in contacts],
        force=solved.force,
        shifts=solved.shifts,
    )


def features_beyond(
    mode: ContactMode,
    k: int,
    border: int,
    touching: Callable[[Array, Features], Sequence[Touching]],
    state: Array,
    size: float,
) -> Features:
    """Nearest features of all contacts after those of the contact ``k`` are left by a border.

    Args:
        mode: before.
        k: number of the contact.
        border: number of its border.
        touching: contacts at a state with given features.
        state: at the border.
        size: of the mechanism.
    """
    new_features = list(features_of(mode))
    borders = touching(state, tuple(new_features))[k].borders
    for _ in range(_MOST_BORDERS):
        new_features[k] = borders[border].beyond
        borders = touching(state, tuple(new_features))[k].borders
        border = int(np.argmax([edge.left_by for edge in borders]))
        if borders[border].left_by <= size * _ON_BORDER:
            break
    return tuple(new_features)


def _beyond_its_bound(k: int, contacts: Sequence[Touchable], solved: SolvedContacts) -> float:
    """Guard of a sticking contact: its friction beyond its bound."""
    force, contact, touch = solved.force[k], contacts[k], solved.touching[k]
    by = contact.pressed_by
    normal = float(touch.normal @ force) if by is None else float(solved.touching[by].normal @ solved.force[by])
    if by is not None:
        return float(np.linalg.norm(force)) - contact.static * normal
    return float(np.linalg.norm(force - normal * touch.normal)) - (contact.bound or contact.static * normal)


class LostGrip(NamedTuple):
    """Contacts that a shared load moves, where the last distribution that they can bear is reached.

    Attributes:
        force: in that distribution, (contacts, 3).
        lifting: contacts that bear nothing in it.
        slipping: others whose friction is at its bound.
    """

    force: Array
    lifting: list[int]
    slipping: list[int]

    def one_way(self, touching: Sequence[Touching]) -> bool:
        """True if all that slip do so in one direction; then no split of the normal forces matters."""
        ways = [self.force[k] - touching[k].normal * (touching[k].normal @ self.force[k]) for k in self.slipping]
        units = [way / (float(np.linalg.norm(way)) or 1.0) for way in ways]
        return all(float(np.linalg.norm(way - units[0])) <= _MOVES for way in units)


def lost_grip(contacts: Sequence[Touchable], solved: SolvedContacts) -> LostGrip:
    """Motion by a shared load where no distribution of it that contacts can bear is left: dual of the largest margin.

    Sticking contacts whose speed in that motion is zero are its pivots and hold on.
    """
    grip = best_grip(contacts, solved.touching, solved)
    assert grip is not None  # it ended the stretch
    force = np.asarray(solved.force + solved.shifts @ grip.weights)
    moving = np.flatnonzero(grip.speeds > _MOVES).tolist()
    least = _MOVES * float(np.abs(force).max())
    lifting = [k for k in moving if float(np.abs(force[k]).max()) <= least]
    return LostGrip(force, lifting, [k for k in moving if k not in lifting and solved.mode[k].kind == "stick"])


def _undecided(contacts: Sequence[Touchable], solved: SolvedContacts) -> float:
    """Guard of a motion that hangs on how contacts share a load.

    Each split of it has its own friction where slips are not parallel. The slower these are, the less time it has to
    act: the spread of the accelerations counts by their speed. It is that of a split of the whole load, which is small
    on a light body.
    """
    load = float(np.abs(solved.force[sharing(solved.splits)]).max(initial=0.0))
    rubbing = zip(solved.mode, contacts, solved.touching, strict=True)
    speeds = (slip_velocity(touch) for acting, contact, touch in rubbing if acting.kind == "slip" and contact.friction)
    return load * solved.spread * max(float(np.linalg.norm(speed)) for speed in speeds) - REST


def leaves(contact: Touchable, k: int, solved: SolvedContacts) -> bool:
    """True if a contact that friction no longer holds leaves: without a load along it, round-off makes it slip."""
    pressed = float(solved.touching[k].normal @ solved.force[k])
    return contact.presses and not solved.splits.shape[1] and pressed <= _UNLOADED


def sharing(splits: Array) -> list[int]:
    """Indices of the contacts that share a load."""
    return np.flatnonzero(np.linalg.norm(splits, axis=1) > RANK).tolist()


def pressing(mode: ContactMode, touching: Sequence[Touching], force: Array, splits: Array) -> Array:
    """Normal force of each contact; where contacts share a load and none sticks, the least in its most even split.

    By duality that is the least mean load of groups of contacts, weighted so that no split changes it: of a box on its
    four corners, half the load of an edge.
    """
    normals = np.array([touch.normal @ push for touch, push in zip(touching, force, strict=True)])
    shares = sharing(splits)
    if any(acting.kind == "stick" for acting in mode):
        return normals  # friction that holds may be split, too, within its own bounds
    loads, sums = [np.inf], np.column_stack([splits, np.ones(len(splits))]).T
    if len(shares) > _FEW:
        normals[shares] = _most_even(normals[shares], splits[shares])
        return normals
    aim = np.eye(len(sums))[-1]
    for size in range(1, len(sums) + 1):
        for group in map(list, itertools.combinations(shares, size)):
            weights = np.linalg.lstsq(sums[:, group], aim, rcond=RANK)[0]
            if weights.min() >= -RANK and np.abs(sums[:, group] @ weights - aim).max() <= RANK:
                loads.append(float(weights @ normals[group]))
    normals[shares] = min(loads)
    return normals


def unloaded(solved: SolvedContacts) -> list[int]:
    """Indices of the contacts of a shared load that bear none of it in any split, where some bear all of it.

    Empty: the load can be split in more ways, or in none.
    """
    from scipy.optimize import linprog

    normals = np.array([touch.normal @ force for touch, force in zip(solved.touching, solved.force, strict=True)])
    shares = sharing(solved.splits)
    sizes, rows, free = float(np.abs(normals).max()) or 1.0, solved.splits[shares], (None, None)
    bounds, none = [free] * rows.shape[1], []
    for k, row in zip(shares, rows, strict=True):
        optimum = linprog(-row, -rows, normals[shares] / sizes + _NO_LOAD, bounds=bounds, method="highs")
        if optimum.status:
            return []
        if normals[k] / sizes - optimum.fun <= 2 * len(shares) * _NO_LOAD:
            none.append(k)
    return none if len(none) < len(shares) else []


def _most_even(normals: Array, splits: Array) -> float:
    """Least normal force in the split whose least one is largest, by linear programming; inf: it has no bound.

    The groups of contacts are too many to be tried; the program finds the one that limits the load.
    """
    from scipy.optimize import linprog

    count, ways = splits.shape
    sizes = float(np.abs(normals).max()) or 1.0
    rows, free = np.column_stack([-splits, np.ones(count)]), (None, None)
    optimum = linprog([*np.zeros(ways), -1.0], rows, normals / sizes, bounds=[free] * (ways + 1), method="highs")
    if optimum.status:
        return float(np.inf)
    group = np.flatnonzero(-optimum.ineqlin.marginals > RANK)
    sums = np.column_stack([splits, np.ones(count)]).T
    weights = np.linalg.lstsq(sums[:, group], np.eye(ways + 1)[-1], rcond=RANK)[0]  # exact, for the group
    return float(weights @ normals[group])


def _stopping(acting: Acting, touch: Touching) -> float:
    """Guard of the end of a slip [m/s]: minus the speed along a known way; in the plane, FAINT minus the speed."""
    if acting.along is None and not acting.leads:
        return FAINT - float(np.linalg.norm(slip_velocity(touch)))
    return -float(heading_of(acting, touch) @ touch.slide)


def striking(
    contacts: Sequence[Touchable], mode: ContactMode, touching: Sequence[Touching], hit: int, time: float, size: float
) -> list[int]:
    """Contacts that close at the same time [s] as the contact ``hit``, and ``hit``.

    Within the accuracy of times, or with gaps that are round-off in a mechanism of this size.
    """

    def closes(touch: Touching) -> bool:
        closing = -float(touch.normal @ touch.slide)
        return not touch.absent and closing > 0 and touch.gap <= max(closing * time_accuracy(time), size * _TOGETHER)

    return [
        k
        for k, (contact, acting, touch) in enumerate(zip(contacts, mode, touching, strict=True))
        if k == hit or (contact.presses and acting.kind == "open" and closes(touch))
    ]


def lies_against(acting: Acting, touch: Touching, size: float) -> bool:
    """True if a contact is closed and at rest along its normal, though nothing may press it; ``size`` as above."""
    if touch.absent:
        return False
    parting = float(touch.normal @ touch.slide)
    return acting.kind != "open" or (abs(touch.gap) <= size * _TOGETHER and abs(parting) <= REST)


def noise_of(guards: Sequence[ContactGuard], size: float) -> FloatArray:
    """Round-off of the guards: a gap that just opened, a slip that just began, a border just passed are still zero."""
    return np.array([_DIGITS * size if guard.kind in {"close", "still", "pass"} else 0.0 for guard in guards])


def faint_time(touch: Touching, slide_rate: Array) -> float:
    """Time until a slip stops at its present rate [s]."""
    u = slip_velocity(touch)
    return max(0.0, -float(u @ slide_rate) / float(slide_rate @ slide_rate))
