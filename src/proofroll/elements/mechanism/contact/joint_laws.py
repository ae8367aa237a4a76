"""Stops and dry friction of joints, expressed as contacts along a coordinate, for mechanisms whose bodies touch.

A stop presses along its coordinate as a smooth surface does along its normal. Dry friction has no normal force: it
holds along a line, or acts there with a constant force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.modes import Acting, ContactMode, direction_of
from proofroll.elements.mechanism.contact.rolling_and_spin import TurningFriction
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.dynamics.switches import STOPPED, Mode, SwitchedJoint
from proofroll.elements.mechanism.scene.rotations import Array

_X, _Y, _NONE = np.eye(3)[0], np.eye(3)[1], np.zeros(3)


@dataclass(frozen=True)
class JointContact:
    """One law of a joint as a contact: a stop has the normal x, dry friction acts along y, in units of the coordinate.

    Attributes:
        joint: joint that has the law.
        side: 1: the stop below, -1: the stop above, 0: dry friction.
        friction: coefficient of the contact; 0, for dry friction has its ``bound`` instead.
    """

    joint: SwitchedJoint
    side: int
    friction: float = 0.0
    tangential_restitution: ClassVar[float] = 0.0
    pressed_by: ClassVar[None] = None

    @property
    def static(self) -> float:
        """Coefficient while it sticks, as of its slip."""
        return self.friction

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.joint.name

    @property
    def pair(self) -> str:
        """Text that no other contact has."""
        return f"{self.joint.name} {self.side}"

    @property
    def bound(self) -> float:
        """Largest force of dry friction [N, N m]; 0: a stop."""
        return 0.0 if self.side else self.joint.friction

    @property
    def presses(self) -> bool:
        """True for a stop."""
        return bool(self.side)

    @property
    def restitution(self) -> float:
        """Restitution of an impact on the stop."""
        return self.joint.restitution

    @property
    def stop(self) -> float:
        """Coordinate of the stop [rad, m]."""
        return self.joint.low if self.side > 0 else self.joint.high

    @property
    def direction(self) -> Array:
        """Direction of the slide for a positive rate of the coordinate, unit vector."""
        return np.asarray(self.side * _X if self.side else _Y)

    def touching(self, q: float, v: float) -> Touching:
        """Gap, normal and slide of the contact at a coordinate and its rate."""
        gap = self.side * (q - self.stop) if self.side else 0.0
        return Touching(gap=gap, normal=_X, normal_rate=_NONE, place=_NONE, place_rate=_NONE, slide=v * self.direction)


def joint_contacts(joints: Sequence[SwitchedJoint]) -> tuple[JointContact, ...]:
    """Laws of switched joints as contacts: of each joint its stops, then its dry friction."""
    laws = []
    for joint in joints:
        laws += [JointContact(joint, side) for side, stop in ((1, joint.low), (-1, joint.high)) if np.isfinite(stop)]
        if joint.friction:
            laws.append(JointContact(joint, 0))
    return tuple(laws)


def line_response(contact: object, G: Array, touching: Sequence[Touching]) -> Array:
    """Response (3, 3) by whose singularity the line of a contact is found, from that of its slide by unit forces.

    A joint has one coordinate, and a spin one axis, and so one line, also where loops or motions leave no response.
    """
    if isinstance(contact, JointContact):
        return np.outer(contact.direction, contact.direction)
    if isinstance(contact, TurningFriction) and contact.spins:
        axis = touching[contact.pressed_by].normal
        return np.outer(axis, axis)
    return G


def on_stops(closed_contacts: Sequence[object], q: Array) -> Array:
    """Coordinates with those of joints that rest on a stop, of the contacts that are closed, exactly at it."""
    q = q.copy()
    for contact in closed_contacts:
        if isinstance(contact, JointContact):
            q[contact.joint.coordinate] = contact.stop
    return q


def off_stops(contacts: Sequence[object], closed_mask: Sequence[bool]) -> dict[int, Array]:
    """Direction off the stop of the dry friction of each joint that rests on one, by the number of that friction.

    Stop and friction hold the joint together, by at least minus the bound of friction. So friction counts there as that
    of a slip off the stop, and the force of the stop as what is left of both.
    """
    sides = {
        contact.joint.number: contact.side
        for contact, shut in zip(contacts, closed_mask, strict=True)
        if shut and isinstance(contact, JointContact) and contact.side
    }
    return {
        k: sides[contact.joint.number] * _Y
        for k, contact in enumerate(contacts)
        if isinstance(contact, JointContact) and not contact.side and contact.joint.number in sides
    }


def rebounding(contacts: Sequence[object], mode: ContactMode, hit: int) -> ContactMode:
    """Mode after a rebound on a contact; if that is a stop, the dry friction of its joint acts against the way off."""
    ways = off_stops(contacts, [k == hit for k in range(len(mode))])
    return tuple(
        Acting("slip", direction_of(ways[k]), direction_of(ways[k])) if k in ways else acting
        for k, acting in enumerate(mode)
    )


def refuse_rubbing_stops(contacts: Sequence[object], closed_mask: Sequence[bool], time: float) -> None:
    """Refuses a joint with dry friction that a stop holds from a time on [s].

    Raises:
        Refused: the shares of its friction and its stop are not determinate, and neither is when it leaves the stop.
    """
    for contact, shut in zip(contacts, closed_mask, strict=True):
        if shut and isinstance(contact, JointContact) and contact.side and contact.joint.friction:
            raise Refused(
                f"joint {contact.name} rests on a stop from t = {time:.6g} s on and has dry friction, beside contacts "
                "of bodies: their shares of its force are not determinate; end before, or leave out its limits or its "
                "friction"
            )


def mode_of_joints(joints: Sequence[SwitchedJoint], contacts: Sequence[object], mode: ContactMode) -> Mode:
    """Modes of the switched joints that a mode of contacts implies."""
    joint_modes = {joint.name: "free" for joint in joints}
    for contact, acting in zip(contacts, mode, strict=True):
        if not isinstance(contact, JointContact) or acting.kind == "open":
            continue
        if contact.side:
            joint_modes[contact.name] = "low" if contact.side > 0 else "high"
        elif joint_modes[contact.name] in STOPPED:
            continue
        elif acting.kind == "stick":
            joint_modes[contact.name] = "stick"
        else:
            assert acting.along is not None  # one coordinate is one line
            joint_modes[contact.name] = contact.joint.moving(acting.along[1])
    return tuple(joint_modes.values())
