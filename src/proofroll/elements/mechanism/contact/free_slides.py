"""Slides of contacts without forces of contacts, and contacts that loops or motions alone move."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism.contact.modes import ContactMode, direction_of
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.analysis import NO_RESPONSE
from proofroll.elements.mechanism.scene.rotations import Array

_RESTS = 1e-10  # rate of a slide, relative to the parts that it is the sum of, that counts as none


class FreeSlides(NamedTuple):
    """Slides of contacts along their surfaces without forces of contacts.

    Attributes:
        rates: of the slides, (contacts, 3).
        least: size of each that is round-off, (contacts,).
        moved: True where no force changes the rate, for loops and motions alone move the contact, (contacts,).
    """

    rates: Array
    least: Array
    moved: NDArray[np.bool_]


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
    across = np.array([np.eye(3) - np.outer(touch.normal, touch.normal) for touch in touching]).reshape(-1, 3, 3)
    J, bias = across @ J, np.einsum("kij,kj->ki", across, bias)
    response, most = (np.einsum("kin,nm,kim->k", J, metric, J) for metric in (W, loose))
    # in the norm of kinetic energy, which has one unit for all velocities
    strength = np.sqrt(acceleration @ np.linalg.solve(loose, acceleration)) + np.sqrt(joint_force @ loose @ joint_force)
    sizes = np.sqrt(most) * strength + np.linalg.norm(bias, axis=1)
    return FreeSlides(J @ acceleration + bias, _RESTS * sizes, response <= NO_RESPONSE * most)


class _Contact(Protocol):
    @property
    def pressed_by(self) -> int | None: ...


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
