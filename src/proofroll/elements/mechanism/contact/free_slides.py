"""Slides of contacts without forces of contacts; contacts that loops or motions alone move, or nothing presses."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.contact.modes import ContactMode, direction_of
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.analysis import NO_RESPONSE, RANK
from proofroll.elements.mechanism.scene.rotations import Array

_RESTS = 1e-10  # rate of a slide, relative to the parts that it is the sum of, that counts as none
_APART = 1e-13  # the same of a rate along the normal: what it is the sum of cancels


class FreeSlides(NamedTuple):
    """Slides of contacts along their surfaces without forces of contacts.

    Attributes:
        rates: of the slides, (contacts, 3).
        least: size of each that is round-off, (contacts,).
        moved: True where no force changes the rate, for loops and motions alone move the contact, (contacts,).
        parts: True where the rate along the normal is not round-off, (contacts,).
        coupled: True where a force at a contact changes that rate of another one, (contacts, contacts).
        plane: True where forces change the rate in two directions along the surface, (contacts,).
    """

    rates: Array
    least: Array
    moved: NDArray[np.bool_]
    parts: NDArray[np.bool_]
    coupled: NDArray[np.bool_]
    plane: NDArray[np.bool_]


def free_slides(
    touching: Sequence[Touching], J: Array, bias: Array, acceleration: Array, W: Array, loose: Array, joint_force: Array
) -> FreeSlides:
    """See :class:`FreeSlides`.

    Args:
        touching: the contacts.
        J: derivative of each slide by the velocities, (contacts, 3, velocities).
        bias: rate of each slide without accelerations, (contacts, 3).
        acceleration: without forces of contacts, (velocities,).
        W: accelerations by unit forces along the velocities, (velocities, velocities).
        loose: the same without loops, couplings and motions.
        joint_force: forces of these along the velocities, (velocities,).
    """
    normals = np.array([touch.normal for touch in touching]).reshape(-1, 3)
    turning = np.array([touch.normal_rate @ touch.slide for touch in touching])
    # in the norm of kinetic energy, which has one unit for all velocities
    strength = np.sqrt(acceleration @ np.linalg.solve(loose, acceleration)) + np.sqrt(joint_force @ loose @ joint_force)

    def sizes(J: Array, bias: Array) -> tuple[Array, Array]:
        """Largest responses of slides, and sizes of the parts of their rates."""
        most = np.einsum("kin,nm,kim->k", J, loose, J)
        return most, np.sqrt(most) * strength + np.linalg.norm(bias, axis=1)

    away = np.einsum("ki,kin->kn", normals, J)
    of_normals, parts = sizes(away[:, None], (np.einsum("ki,ki->k", normals, bias) + turning)[:, None])
    rates = away @ acceleration + np.einsum("ki,ki->k", normals, bias) + turning
    coupled = np.abs(np.einsum("kn,nm,jim->kji", away, W, J)).max(axis=2, initial=0.0)
    across = np.array([np.eye(3) - np.outer(normal, normal) for normal in normals]).reshape(-1, 3, 3)
    J, bias = across @ J, np.einsum("kij,kj->ki", across, bias)
    responses, (most, along) = np.linalg.eigvalsh(np.einsum("kin,nm,kjm->kij", J, W, J)), sizes(J, bias)
    return FreeSlides(
        rates=J @ acceleration + bias,
        least=_RESTS * along,
        moved=responses.sum(axis=1) <= NO_RESPONSE * most,
        parts=np.abs(rates) > _APART * parts,
        coupled=coupled > RANK * of_normals[:, None],
        plane=responses[:, 1] > RANK * responses[:, 2],
    )


class _Contact(Protocol):
    @property
    def friction(self) -> float: ...

    @property
    def presses(self) -> bool: ...

    @property
    def pressed_by(self) -> int | None: ...


def unpressed(contacts: Sequence[_Contact], closed_mask: Sequence[bool], slides: FreeSlides) -> list[int]:
    """Indices of closed contacts that nothing presses or parts: closed or open, they move alike.

    They may touch others of this kind; a contact that presses friction against turning, or whose friction would hold it
    whatever presses it, is none.
    """
    turning = {contact.pressed_by for contact in contacts}
    free = np.array(
        [
            shut and contact.presses and k not in turning and np.isfinite(contact.friction)
            for k, (contact, shut) in enumerate(zip(contacts, closed_mask, strict=True))
        ],
        dtype=bool,
    )
    free &= ~slides.parts & (slides.plane | (np.array([contact.friction for contact in contacts]) == 0))
    shut = np.array(closed_mask, dtype=bool)
    while (pressed := free & slides.coupled[:, shut & ~free].any(axis=1)).any():
        free &= ~pressed
    return np.flatnonzero(free).tolist()


def acting_ones(contacts: Sequence[_Contact], rough: ContactMode, slides: FreeSlides) -> list[bool]:
    """True for closed contacts but for friction against turning that rests as joints hold it, which bears nothing."""
    return [
        acting.kind == "slip" or (acting.kind == "stick" and not (contact.pressed_by is not None and moved))
        for contact, acting, moved in zip(contacts, rough, slides.moved.tolist(), strict=True)
    ]


def passing(rough: ContactMode, slides: FreeSlides) -> ContactMode:
    """Rough modes with a slip in place of each rest that loops or motions end at once, whatever friction does.

    A slider passes its dead centre so: its rate vanishes for an instant, and friction reverses.
    """
    sizes = np.linalg.norm(slides.rates, axis=1)
    goes = slides.moved & (sizes > slides.least)
    return tuple(
        acting._replace(kind="slip", heading=direction_of(rate / size)) if on and acting.kind == "stick" else acting
        for acting, on, rate, size in zip(rough, goes, slides.rates, sizes, strict=True)
    )
