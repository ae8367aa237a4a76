"""Friction of a contact against turning: rolling resistance, and friction against spin about the normal.

Each is a contact beside its pair's own. Its slide is the part of the bodies' relative angular velocity that it resists,
its force is a moment, and its bound is a coefficient [m] times the normal force of the contact that it belongs to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.contact.modes import OPEN, ROUND_OFF, Acting, ContactMode
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array, cross, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

# Response to moments, in parts of that without contacts, that is round-off of what contacts hold.
_HELD = 1e-9
_UNIT = np.eye(3)
_INDEPENDENT = 1e-15  # least response of independent rows, relative to the largest


@dataclass(frozen=True)
class TurningFriction:
    """Friction of a contact against turning.

    Attributes:
        name: of the contact that presses.
        pressed_by: index of that contact; its normal force bounds the moment.
        spins: True: friction against spin about the normal; False: rolling resistance.
        friction: coefficient, the largest moment over the normal force [m].
        pair: text that no other contact has.
        bend: of rolling resistance against the motion of a ball's centre: 1 over the ball's radius, negative if the
            ball is body b [1/m]; 0: against turning.
    """

    bound: ClassVar[float] = 0.0
    presses: ClassVar[bool] = False
    restitution: ClassVar[float] = 0.0
    tangential_restitution: ClassVar[float] = 0.0
    name: str
    pressed_by: int
    spins: bool
    friction: float
    pair: str
    bend: float = 0.0

    @property
    def static(self) -> float:
        """Coefficient of what does not turn: the same."""
        return self.friction

    def touching(self, touch: Touching, turning: Array) -> Touching:
        """The friction as a contact, at an angular velocity of a relative to b [rad/s]; ``touch``: what presses.

        The normal of a spin is one across it, so that the spin is a slide along a line.
        """
        slide = self.opposed(touch.normal, turning, touch.slide)
        if not self.spins:
            return touch._replace(slide=slide, tilt=1.0, feature=0, borders=())
        across = frame_of_axis(touch.normal)[:, 0]
        touch = touch._replace(normal=across, normal_rate=np.zeros(3), tilt=1.0)
        return touch._replace(slide=slide, feature=0, borders=())

    def resisted(self, normal: Array, turning: Array) -> Array:
        """Resisted part of angular velocities, (3,) or (3, velocities); 0 where it is round-off of the whole."""
        projection = normal[:, None] * normal
        part = (projection if self.spins else _UNIT - projection) @ turning
        return part if part.dtype == object else _without_round_off(part, np.sqrt((turning * turning).sum(axis=0)))

    def opposed(self, normal: Array, turning: Array, slide: Array) -> Array:
        """Angular velocity that the moment opposes [rad/s], (3,), at those of a relative to b and a slide [m/s].

        Against motion: of a ball that rolls as fast as its centre moves as the wall's body sees it, n × v / a.
        """
        resisted = self.resisted(normal, turning)
        return resisted + self.bend * cross(normal, slide) if self.bend else resisted

    def resisted_rate(self, touch: Touching, turning: Array, rate: Array, fastest: float) -> Array:
        """Rate of the resisted part of an angular velocity with its ``rate``; 0 where it is round-off.

        ``fastest``: largest angular velocity of a body [rad/s], of whose products rates are the sums.
        """
        resisted = self.resisted(touch.normal, rate) + self._part_rate(touch) @ turning
        if resisted.dtype != object:
            size = np.linalg.norm(rate) + fastest * (fastest + np.linalg.norm(touch.normal_rate))
            resisted = _without_round_off(resisted, size)
        return resisted + self.bend * cross(touch.normal_rate, touch.slide) if self.bend else resisted

    def _part_rate(self, touch: Touching) -> Array:
        """Rate of that matrix as the normal turns [1/s]."""
        turning = np.outer(touch.normal_rate, touch.normal)
        turning = turning + turning.T
        return turning if self.spins else -turning


def _without_round_off(part: Array, size: Any) -> Array:
    """A part of vectors of a size, (3,) or (3, vectors), without vectors that are round-off."""
    return np.where(np.sqrt((part * part).sum(axis=0)) > ROUND_OFF * size, part, 0.0)


def largest_response(free: Array, into: Array, held: Array) -> float:
    """Largest response to a moment while contacts hold what they do [1/(kg m²)]; 0: it is round-off.

    Args:
        free: response of what the moment resists, without contacts, (3, 3).
        into: of what contacts hold, (rows, 3).
        held: response of that to forces along it, (rows, rows), of rows that may depend on each other.
    """
    response = free
    if len(held):
        sizes, directions = np.linalg.eigh(held)
        independent = sizes > _INDEPENDENT * sizes[-1]
        ways = directions[:, independent].T @ into
        response = free - ways.T @ (ways / sizes[independent, None])
    ease = float(np.linalg.eigvalsh(response)[-1])
    return ease if ease > _HELD * np.trace(free) else 0.0


def rolling_levers(frictions: Sequence[TurningFriction], count: int) -> Array:
    """Coefficient of rolling resistance [m] of each of ``count`` contacts, 0 without, shape (count,)."""
    levers = np.zeros(count)
    for friction in frictions:
        if not friction.spins:
            levers[friction.pressed_by] = friction.friction
    return levers


def turning_frictions(contacts: Sequence[BodyContact]) -> tuple[TurningFriction, ...]:
    """Friction against turning of each contact that has some, but for what shares the cone of sliding."""
    laws = []
    for k, contact in enumerate(contacts):
        if contact.cone == "shared":
            continue
        for spins, size in ((False, contact.rolling_resistance), (True, contact.spinning_friction)):
            if size:
                text = f"{contact.name} {'spin' if spins else 'roll'}"
                bend = 0.0 if spins else contact.bend
                laws.append(TurningFriction(contact.name, k, spins=spins, friction=size, pair=text, bend=bend))
    return tuple(laws)


def with_moments(forces: Array, frictions: Sequence[TurningFriction], moments: Array, normal_forces: Array) -> Array:
    """Forces of contacts, (contacts, 3), the sums of the moments of their frictions, and N, (contacts, 7) [N, N m]."""
    borne = np.concatenate([forces, np.zeros_like(forces), normal_forces[:, None]], axis=1)
    for friction, moment in zip(frictions, moments, strict=True):
        borne[friction.pressed_by, 3:6] += moment
    return borne


def opposed_rates(contacts: Sequence[Any], touching: Sequence[Touching], rates: Array) -> Array:
    """Rates of all slides, (contacts, 3), from these and the rates of turning that friction resists."""
    for k, contact in enumerate(contacts):
        if isinstance(contact, TurningFriction) and contact.bend:
            slide = contact.bend * cross(touching[contact.pressed_by].normal, rates[contact.pressed_by])
            rates = np.concatenate([rates[:k], (rates[k] + slide)[None], rates[k + 1 :]])
    return rates


def standing(contacts: Sequence[Any], mode: ContactMode) -> ContactMode:
    """Mode in which resistance against motion is open while its contact slips: it holds no turning then."""
    return tuple(
        OPEN._replace(feature=acting.feature) if acting.kind == "stick" and led_by_slip(contact, mode) else acting
        for contact, acting in zip(contacts, mode, strict=True)
    )


def led_by_slip(contact: Any, mode: Sequence[Acting]) -> bool:
    """True for resistance against motion whose contact slips in a mode: the moment has no influence on the motion."""
    return isinstance(contact, TurningFriction) and bool(contact.bend) and mode[contact.pressed_by].kind == "slip"


def require_moving(contacts: Sequence[Any], mode: ContactMode, time: float) -> None:
    """Raises Diverged if a ball that stands begins to slip in a mode, where its resistance has no direction yet."""
    for contact, acting in zip(contacts, mode, strict=True):
        if acting.kind == "stick" and led_by_slip(contact, mode):
            raise Diverged(
                f"{contact.name} begins to slip from rest at t = {time:.6g} s while its rolling resistance holds the "
                "ball: it is against the motion of a centre that does not move yet; take less of it, or more friction"
            )


def moments_by_pressing(
    turning: Sequence[tuple[int, int, Array]], owner: Sequence[tuple[int, Array]], normals: Sequence[Array]
) -> list[tuple[int, int, Array]]:
    """Moments by a unit of each unknown force: index of the friction, place of the unknown, moment.

    Args:
        turning: index of each friction that acts, index of the contact that presses, moment by a unit normal force.
        owner: contact and direction of each unknown force.
        normals: of all contacts.
    """
    return [
        (k, place, float(direction @ normals[by]) * moment)
        for k, by, moment in turning
        for place, (of, direction) in enumerate(owner)
        if of == by
    ]


class _Pressed(Protocol):
    @property
    def pressed_by(self) -> int | None: ...


def opened(contacts: Sequence[_Pressed], mode: ContactMode, k: int) -> ContactMode:
    """Mode in which a contact opens, and friction against turning with it."""
    pairs = zip(contacts, mode, strict=True)
    return tuple(
        OPEN._replace(feature=acting.feature) if k in {number, contact.pressed_by} else acting
        for number, (contact, acting) in enumerate(pairs)
    )


def shut_by_pressing(contacts: Sequence[_Pressed], closed_mask: Sequence[bool]) -> list[bool]:
    """True for closed contacts; friction against turning is closed with the contact that presses."""
    return [
        closed_mask[contact.pressed_by] if contact.pressed_by is not None else shut
        for contact, shut in zip(contacts, closed_mask, strict=True)
    ]


class Presser(NamedTuple):
    """Contact that presses, by its place among some contacts, and the friction's :attr:`TurningFriction.bend`."""

    place: int
    bend: float


def pressed_by(contacts: Sequence[Any], which: Sequence[int]) -> list[Presser | None]:
    """Contacts whose normal force bounds the friction of each of some contacts; None: its own does."""
    return [
        Presser(list(which).index(contacts[k].pressed_by), contacts[k].bend)
        if isinstance(contacts[k], TurningFriction)
        else None
        for k in which
    ]
