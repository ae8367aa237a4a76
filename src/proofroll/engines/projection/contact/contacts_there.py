"""Contacts at a state of a tree, and how they respond to forces."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.modes import REST, Acting, ContactMode, slip_velocity
from proofroll.elements.mechanism.contact.touching import Touching, lying
from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.engines.projection.smooth.dependent import SolvedState

# Gap, relative to the natural length, difference of times, in units of their last digit, and of closing speeds,
# relative to these, with which corners of a face land together.
_TOGETHER, _ULPS, _ALIKE = 1e-13, 8, 1e-9


class ContactsThere(NamedTuple):
    """Contacts at a state, without their forces.

    Attributes:
        touching: geometry and sliding velocity of each contact.
        J: derivative of each sliding velocity with respect to ν, (contacts, 3, nv).
        response: H⁻¹ Jᵀ with the mass matrix H, (nv, contacts, 3).
        rate: rate of each sliding velocity without contact forces, (contacts, 3).
        free: equations of motion solved without contact forces.
    """

    touching: tuple[Touching, ...]
    J: Array
    response: Array
    rate: Array
    free: SolvedState

    def slide_rate(self, force: Array) -> Array:
        """Rate of each sliding velocity with forces on body a of each contact, (contacts, 3)."""
        return np.asarray(self.rate + self.J @ np.einsum("nki,ki->n", self.response, force))

    def framed(self, which: Sequence[int]) -> tuple[list[Array], Array, Array]:
        """Normal and two tangents of some contacts; J along them, and response to forces along them."""
        frames = [frame_of_axis(self.touching[k].normal)[:, [2, 0, 1]] for k in which]
        J = np.concatenate([frame.T @ self.J[k] for frame, k in zip(frames, which, strict=True)])
        response = np.concatenate([self.response[:, k] @ frame for frame, k in zip(frames, which, strict=True)], 1)
        return frames, J, response


class ContactSystem(NamedTuple):
    """Equations of the unknown forces by which closed contacts are held, one in each row.

    Attributes:
        pushes: forces on body a of each contact by a unit of each unknown, (rows, contacts, 3); of friction against
            turning moments.
        changes: of ν̇ by a unit of each unknown, (rows, nv).
        matrix, targets: the equations, (rows, rows) and (rows,).
    """

    pushes: Array
    changes: Array
    matrix: Array
    targets: Array


def system_of(
    instant: ContactsThere,
    contacts: Sequence[Any],
    friction: Array,
    headings: Mapping[int, Array],
    rows: Sequence[tuple[int, Array]],
    rate: Array,
) -> ContactSystem:
    """Equations of the forces of closed contacts, in floats or symbols.

    Args:
        instant: contacts at a state.
        contacts: all of them.
        friction: their coefficients.
        headings: direction of each slip.
        rows: directions in which contacts are held, with their contact; of a slip its normal.
        rate: rate of each sliding velocity without these forces, (contacts, 3).
    """
    pushes, touching = np.zeros((len(rows), len(contacts), 3), dtype=rate.dtype), instant.touching
    targets = np.zeros(len(rows), dtype=rate.dtype)
    for i, (k, row) in enumerate(rows):
        pushes[i, k], targets[i] = row, -row @ rate[k]
        if k in headings:
            pushes[i, k] = row - friction[k] * headings[k]
            targets[i] -= touching[k].normal_rate @ touching[k].slide
        for turning, heading in headings.items():
            if contacts[turning].pressed_by == k:
                pushes[i, turning] = heading * (-friction[turning] * (pushes[i, k] @ touching[k].normal))
    K = np.reshape([row @ instant.J[k] for k, row in rows], (len(rows), instant.J.shape[2]))
    flat = pushes.reshape(len(rows), 3 * len(contacts))
    changes = flat @ instant.response.reshape(K.shape[1], 3 * len(contacts)).T
    return ContactSystem(pushes=pushes, changes=changes, matrix=K @ changes.T, targets=targets)


def landing_together(
    hit: int,
    contacts: Sequence[BodyContact],
    instant: ContactsThere,
    mode: ContactMode,
    overlap: Array,
    length: float,
    time: float,
) -> list[int]:
    """Contacts that an impact closes: the one that hits, and corners of its face that land with it.

    Args:
        hit: a contact of bodies, or of a joint, which closes alone.
        contacts: contacts of bodies; ``instant`` has these first.
        instant: contacts at the impact.
        mode: before the impact.
        overlap: of each contact when it opened [m], an error of the method.
        length: natural length [m].
        time: of the impact [s].
    """
    if hit >= len(contacts):
        return [hit]
    speeds = [-float(touch.normal @ touch.slide) for touch in instant.touching]
    near = _TOGETHER * length + speeds[hit] * _ULPS * float(np.spacing(time))
    corners = [
        k
        for k, contact in enumerate(contacts)
        if k != hit and mode[k].kind == "open" and contact.pair == contacts[hit].pair
        if instant.touching[k].gap + overlap[k] <= near and abs(speeds[k] - speeds[hit]) <= _ALIKE * speeds[hit]
    ]
    return [hit, *corners]


def leaving(mode: ContactMode, k: int, force: Array, normal: Array) -> ContactMode:
    """Mode in which a contact starts to slip, opposite to the friction that held it.

    Args:
        mode: before.
        k: the contact.
        force: on its body a while it sticks [N].
        normal: of the contact.
    """
    friction = force - normal * (normal @ force)
    x, y, z = (-friction / np.linalg.norm(friction)).tolist()
    line = None if mode[k].along is None else (x, y, z)
    return (*mode[:k], Acting("slip", line, (x, y, z)), *mode[k + 1 :])


def refuse_lying(
    contacts: Sequence[BodyContact], touching: Sequence[Touching], closed_mask: Sequence[bool], time: float
) -> None:
    """Raises Refused if a closed contact of bodies is along an edge or a line at a time [s], and slides.

    No one point of an edge holds it: the nearest would jump to and fro with the last digits of the tilt, in steps
    without end. At rest it does not.
    """
    for contact, point, closed in zip(contacts, touching, closed_mask, strict=False):
        if closed and point.flat and np.linalg.norm(slip_velocity(point)) > REST:
            raise Refused(str(lying(contact, time)))
