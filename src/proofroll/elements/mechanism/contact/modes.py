"""Mode of a contact between two events: open, slip or stick."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from proofroll.core.events import EventKind
from proofroll.elements.mechanism.contact.one_contact import ModeKind
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis

Direction = tuple[float, float, float]
# The one rule for slips, spins, rolling and parting, of speeds in natural units (in m/s or rad/s outside the truth):
# ROUND_OFF of a velocity, a hundred times that of a number near 1; a speed up to REST counts as none, for an event that
# ends it leaves the error of its time times a rate; below FAINT round-off turns the direction of a slip by more than
# 1e-6, and the rest of the slip is followed by its logarithm.
ROUND_OFF = 1e-14
REST, FAINT = 1e3 * ROUND_OFF, 1e6 * ROUND_OFF
_LINE = 1e-9  # response across over response along, below which a contact can slide along a line only
EXACT = 1e-16  # violation of what holds, in natural units, that is only round-off
_TURNED = 0.5  # least length of the first direction of a slip after projection on a surface that has turned since


class Acting(NamedTuple):
    """Mode of one contact.

    Attributes:
        kind: ``open``, ``slip`` or ``stick``.
        along: direction of the only line along which it can slide, if there is one, where the mode began; in a slip,
            its sense too.
        heading: initial direction of a slip that begins from rest.
        leads: True if friction acts against ``heading`` whatever the slip is, which has just begun.
        stops: True for a slip in the plane below FAINT that is about to stop.
        feature: number of the features that are nearest; 0 of shapes that have one only.
    """

    kind: ModeKind
    along: Direction | None = None
    heading: Direction | None = None
    leads: bool = False
    stops: bool = False
    feature: int = 0


ContactMode = tuple[Acting, ...]
Features = tuple[int, ...]
OPEN = Acting("open")


def kinds(mode: ContactMode) -> tuple[tuple[str, int], ...]:
    """Kind and nearest features of each contact's mode, without directions."""
    return tuple((acting.kind, acting.feature) for acting in mode)


def features_of(mode: ContactMode) -> Features:
    """Number of the nearest features of each contact."""
    return tuple(acting.feature for acting in mode)


def closed_in(mode: ContactMode) -> list[bool]:
    """True for each contact that is not open."""
    return [acting.kind != "open" for acting in mode]


def with_features(mode: ContactMode, features: Features) -> ContactMode:
    """The mode with other nearest features."""
    return tuple(acting._replace(feature=feature) for acting, feature in zip(mode, features, strict=True))


def slip_velocity(touch: Touching) -> Array:
    """Slip velocity of a contact, tangential to its surfaces [m/s], shape (3,)."""
    return np.asarray(touch.slide - touch.normal * (touch.normal @ touch.slide))


def forbidding_rows(mode: ContactMode, touching: Sequence[Touching], J: Array, presses: Sequence[bool]) -> Array:
    """Rows by which closed contacts forbid velocities, (rows, velocities), from the derivatives of the slides by these.

    One that sticks forbids all three components of its slide; one that ``presses`` and slips, that along its normal.
    """
    rows = [np.zeros((0, J.shape[-1]))]
    for acting, touch, of_slide, pressing in zip(mode, touching, J, presses, strict=True):
        if acting.kind == "stick" or (acting.kind == "slip" and pressing):
            rows.append(of_slide if acting.kind == "stick" else touch.normal[None] @ of_slide)
    return np.concatenate(rows)


def heading_of(acting: Acting, touch: Touching) -> Array:
    """Unit direction of a slip, shape (3,); friction acts against it.

    Of a slip in the plane that round-off would turn it is the first one, unless the surface has turned since.
    """
    slip = slip_velocity(touch)
    speed = float(np.linalg.norm(slip))
    if acting.along is None and not acting.leads and speed > 5 * REST:
        return np.asarray(slip / speed)
    heading = np.array(acting.heading if acting.along is None else acting.along)
    heading = heading - touch.normal * (touch.normal @ heading)
    length = float(np.linalg.norm(heading))
    if acting.along is None and length < _TURNED and speed:
        return np.asarray(slip / speed)
    return np.asarray(heading / (length or 1.0))


def turned(acting: Acting, touch: Touching, G: Array) -> Acting:
    """Mode of a contact with its line as it lies now; ``G``: rates of its slide by unit forces, (3, 3).

    A tip on a turning arm, and a ball in a pipe that rolls in a plane, carry their lines with them.
    """
    if acting.along is None:
        return acting
    across = np.eye(3) - np.outer(touch.normal, touch.normal)
    values, vectors = np.linalg.eigh(across @ G @ across)
    if values[-1] <= _LINE * np.trace(G):  # it slides along no line at all
        return acting
    line = direction_of(vectors[:, -1] if vectors[:, -1] @ acting.along >= 0 else -vectors[:, -1])
    return acting._replace(along=line, heading=acting.heading and line)


def held_directions(acting: Acting, touch: Touching, presses: bool) -> Array:
    """Directions in which a contact permits no motion, (directions, 3).

    A slip holds its normal, if it ``presses`` (dry friction of a joint and of turning do not). A sticking contact holds
    all directions, those of its surface if it does not press, or its normal and its line if it can slide along one line
    only.
    """
    if acting.kind == "open":
        return np.zeros((0, 3))
    normal = touch.normal[None] if presses else np.zeros((0, 3))
    if acting.kind == "slip":
        return normal
    if acting.along is None:
        return np.eye(3) if presses else frame_of_axis(touch.normal)[:, :2].T
    line = np.array(acting.along) - touch.normal * (touch.normal @ np.array(acting.along))
    return np.vstack([normal, line / np.linalg.norm(line)])


def first_mode(kind: ModeKind, frame: Array, heading: Array, G: Array) -> Acting:
    """Mode in which a contact begins.

    Args:
        kind: see :class:`Acting`.
        frame: its normal and two directions along the surface, as columns.
        heading: direction of its slip in the two surface directions, of any length.
        G: accelerations along the columns by unit forces along them, (3, 3); a singular tangential part means that the
            contact can slide along one line only.
    """
    if kind == "open":
        return OPEN
    values, vectors = np.linalg.eigh(G[1:, 1:])
    line = vectors[:, 1] if values[0] <= _LINE * values[1] and values[1] > 0 else None
    if line is not None and line @ heading < 0:
        line = -line
    line_in_space = None if line is None else direction_of(frame[:, 1:] @ line)
    if kind == "stick":
        return Acting("stick", line_in_space)
    size = float(np.linalg.norm(heading)) or 1.0
    return Acting("slip", line_in_space, direction_of(frame[:, 1:] @ (heading / size)))


def following(acting: Acting, way: Array, resting: bool, least: float) -> Acting:
    """Mode of a closed contact whose body moves it along its surface.

    Args:
        acting: mode at rest, with its line.
        way: slide, or its rate where the contact is ``resting``, along the surface.
        resting: True for a contact at rest.
        least: size of a rate that counts as none.
    """
    speed = float(np.linalg.norm(way))
    if resting and speed <= least:
        return acting
    if acting.along is not None:
        line = np.array(acting.along)
        heading = direction_of(line if way @ line >= 0 else -line)
        return Acting("slip", heading, heading)
    return Acting("slip", None, direction_of(way / (speed or 1.0)))


class _Contact(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def friction(self) -> float: ...

    @property
    def bound(self) -> float: ...

    @property
    def pressed_by(self) -> int | None: ...


def changes(
    contacts: Sequence[_Contact], old_mode: ContactMode, new_mode: ContactMode, stands: bool
) -> tuple[tuple[str, str], ...]:
    """Kind and contact of each event of a change of mode; ``stands``: nothing moves any more.

    Friction against turning changes without events.
    """
    events: list[tuple[str, str]] = []
    for contact, earlier, now in zip(contacts, old_mode, new_mode, strict=True):
        if contact.pressed_by is not None:
            continue
        if now.kind == "stick" and earlier.kind != "stick":
            events.append((EventKind.REST if stands and not contact.bound else EventKind.STICK, contact.name))
        elif earlier.kind == "stick" and now.kind == "slip":
            events.append((EventKind.SLIP, contact.name))
        elif earlier.kind != "open" and now.kind == "open":
            events.append((EventKind.LIFT_OFF, contact.name))
        elif earlier.kind == now.kind == "slip" and (contact.friction or contact.bound) and _opposite(earlier, now):
            events.append((EventKind.TURN, contact.name))
    return tuple(events)


def _opposite(earlier: Acting, now: Acting) -> bool:
    return earlier.along is not None and now.heading is not None and float(np.dot(earlier.along, now.heading)) < 0


def direction_of(vector: Array) -> Direction:
    """A vector as plain floats."""
    x, y, z = vector.tolist()
    return x, y, z


def headed(acting: Acting, touch: Touching) -> Acting:
    """Mode of a contact with the present direction of its slip in the plane, however slow."""
    slip = slip_velocity(touch)
    if acting.kind != "slip" or acting.along is not None or not slip.any():
        return acting
    x, y, z = (slip / np.linalg.norm(slip)).tolist()
    return acting._replace(heading=(x, y, z))


def modes_of(closed: Sequence[bool], resting: Sequence[bool], features: Features) -> ContactMode:
    """Modes of contacts: stick if closed and still, slip if only closed, else open."""
    return tuple(
        Acting("open" if not shut else "stick" if stands else "slip", feature=feature)
        for shut, stands, feature in zip(closed, resting, features, strict=True)
    )
