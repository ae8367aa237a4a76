"""Guards that end a stretch of contacts, for both routes: values that are negative while a mode lasts."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contacts.acting import FAINT, Acting, ContactMode, across, heading_of
from proofroll.elements.mechanism.contacts.geometry import BodyContact
from proofroll.elements.mechanism.contacts.joint_laws import JointContact
from proofroll.elements.mechanism.contacts.touching import Touching
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.mechanism.two_paths import moment

# In natural units (natural_units.py): speeds below which nothing moves, and accelerations below which nothing will.
# Both routes stop there, so that they integrate no round-off of a state at rest.
AT_REST, STANDS = 1e-13, 1e-9
STOPPED = 1e-11  # what is left of a slip that has come to rest
# Part of a normal force's answer without friction below which Painlevé's measure is taken to come to zero.
_LEAST_RESPONSE = 1e-3
_DIGITS = 1e-14  # of the size of the mechanism: round-off of a gap that has just opened


Touchable = BodyContact | JointContact


class ContactGuard(NamedTuple):
    """One way in which a stretch can end.

    Attributes:
        contact: its number; -1: of all.
        kind: ``close``: a gap closes; ``lift``: a normal force comes to zero; ``still``: a slip does; ``break``: the
            friction of a contact that sticks reaches its bound; ``tear``: Painlevé's measure comes to zero.
    """

    contact: int
    kind: Literal["close", "lift", "still", "break", "tear"]


def guards_of(contacts: Sequence[Touchable], mode: ContactMode) -> list[ContactGuard]:
    """The guards of a mode, in an order that both routes keep."""
    found: list[ContactGuard] = []
    for k, (contact, own) in enumerate(zip(contacts, mode, strict=True)):
        if own.kind == "open":
            found.append(ContactGuard(k, "close"))
            continue
        if not contact.bound:
            found.append(ContactGuard(k, "lift"))
        if contact.friction or contact.bound:
            found.append(ContactGuard(k, "still" if own.kind == "slip" else "break"))
    if any(own.kind == "slip" and contact.friction for contact, own in zip(contacts, mode, strict=True)):
        found.append(ContactGuard(-1, "tear"))
    return found


def guard_value(
    guard: ContactGuard,
    mode: ContactMode,
    contacts: Sequence[Touchable],
    touching: Sequence[Touching],
    force: Array,
    response: float,
) -> float:
    """The value of a guard; ``force`` on body a of each contact [N], ``response`` as in Painlevé's measure."""
    if guard.kind == "tear":
        return _LEAST_RESPONSE - response
    own, found = mode[guard.contact], touching[guard.contact]
    normal = float(found.normal @ force[guard.contact])
    if guard.kind == "close":
        return -float(found.gap)
    if guard.kind == "lift":
        return -normal
    if guard.kind == "still":
        return _stopping(own, found)
    held = float(np.linalg.norm(force[guard.contact] - normal * found.normal))
    contact = contacts[guard.contact]
    return held - (contact.bound or contact.friction * normal)


def _stopping(own: Acting, found: Touching) -> float:
    """Along a line the slip itself, less than nothing; in two dimensions how much it is above what is faint."""
    if own.along is None:
        return FAINT - float(np.linalg.norm(across(found)))
    return -float(heading_of(own, found) @ found.slide)


def striking(mode: ContactMode, touching: Sequence[Touching], hit: int, time: float) -> list[int]:
    """Contacts that close at the same time as one does, or nearer to it than times are known, with it."""

    def closes(found: Touching) -> bool:
        closing = -float(found.normal @ found.slide)
        return closing > 0 and found.gap <= closing * moment(time)

    return [
        k
        for k, (own, found) in enumerate(zip(mode, touching, strict=True))
        if k == hit or (own.kind == "open" and closes(found))
    ]


def noise_of(guards: Sequence[ContactGuard], size: float) -> FloatArray:
    """Round-off of the guards: a gap that has just opened is still at zero, a slip that has just begun too."""
    return np.array([_DIGITS * size if guard.kind in {"close", "still"} else 0.0 for guard in guards])


def faint_time(found: Touching, slide_rate: Array) -> float:
    """Time after which a slip is over, in a straight line."""
    u = across(found)
    return max(0.0, -float(u @ slide_rate) / float(slide_rate @ slide_rate))


def refuse_turning_onset(contact: Touchable, own: Acting) -> None:
    """Refuses a slip that begins from rest in two dimensions, at the bound of friction.

    Raises:
        Refused: its direction is not known at first, and equations that find it are as stiff as it is slow.
    """
    if own.along is None:
        raise Refused(
            f"{contact.name} begins to slip where it could go in any direction of its surface; which it takes at first "
            "hangs on less than the forces tell"
        )
