"""Loads of closed contacts at a state of a run: known ones, and those by each unknown force."""

from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.contact.start import touches
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.contact.tree_contacts import slide_row, turning_row
from proofroll.elements.mechanism.dynamics.kinematics import BodyMotion
from proofroll.elements.mechanism.run.contacts.observables import SLIDES
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import cross, frame_of_axis
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

_CLOSED = 1e-3  # largest gap of a closed contact, relative to the mechanism's size
_STILL = 1e-6  # turning that counts as none, relative to the bodies'


class ContactLimits(NamedTuple):
    """Limits between the states of a contact.

    Attributes:
        gap: largest gap of a closed contact [m].
        slip: largest slip speed of one that sticks [m/s].
    """

    gap: float
    slip: float

    @classmethod
    def of(cls, length: float, speed: float) -> "ContactLimits":
        """Limits for a mechanism of a size [m] and a speed [m/s]."""
        return cls(_CLOSED * length, SLIDES * speed)

    def kind(self, contact: BodyContact, gap: float, slip: float) -> str:
        """State of a contact by its gap [m] and slip speed [m/s]: ``open``, ``slip`` or ``stick``."""
        if gap > self.gap:
            return "open"
        slides = not contact.friction or (np.isfinite(contact.friction) and slip > self.slip)
        return "slip" if slides else "stick"


class Resisting(NamedTuple):
    """Law of rolling resistance with which an engine may move a mechanism.

    Attributes:
        factor: on its arm.
        along_spin: True if the moment is against the whole angular velocity, spin about the normal included.
        by_weight: True if it is the arm times the weight of the bodies that touch, not times the normal force.
        turning: True if it is against turning, also where the scene's is against the motion of a ball.
    """

    factor: float = 1.0
    along_spin: bool = False
    by_weight: bool = False
    turning: bool = False


SCENES_LAW = Resisting()


class Pressing(NamedTuple):
    """Loads of contacts along the velocities of a mechanism's tree.

    Attributes:
        unknown: by a unit of each force or moment that the state leaves open, (forces, nv).
        known: sum of all others, (nv).
        determinate: False if a closed contact has no one place or normal, or a cone that turning shares.
    """

    unknown: FloatArray
    known: FloatArray
    determinate: bool


def pressing(mechanism: Mechanism, motion: BodyMotion, limits: ContactLimits, law: Resisting) -> Pressing:
    """Loads of the closed contacts of a mechanism at a motion.

    A contact that sticks has any force; one that slips has friction against its slip, a coefficient times its unknown
    normal force. Friction against turning is an arm times that force, or any moment where nothing turns.
    """
    nv, determinate = motion.J.shape[2], True
    unknown, known = [np.zeros((0, nv))], np.zeros(nv)
    index, g = mechanism.body_index, float(np.linalg.norm(mechanism.gravity))
    masses = np.array([*(body.mass for body in mechanism.bodies), 0.0])
    for contact, touching in zip(mechanism.contacts, touches(mechanism, motion), strict=True):
        n = touching.normal
        across = touching.slide - n * (n @ touching.slide)
        slip = float(np.linalg.norm(across))
        kind = limits.kind(contact, touching.gap, slip)
        if kind == "open" or touching.absent:
            continue
        determinate &= not touching.flat and contact.cone == "separate"
        bodies = index[contact.body_a], index[contact.body_b]
        J, surface = slide_row(motion, bodies, touching)[0], frame_of_axis(n)[:, :2].T
        push = n if kind == "stick" or not slip else n - contact.friction * across / slip
        if kind == "stick":
            unknown.append(surface @ J)
        turning, of_turning, _ = turning_row(motion, bodies)
        moments, loose = _against_turning(contact, touching, turning, law)
        unknown.append(loose @ of_turning)
        weight = g * float(masses[list(bodies)].sum())
        known += weight * moments[0] @ of_turning if law.by_weight else 0.0
        by_normal = moments[1] if law.by_weight else moments.sum(axis=0)
        unknown.append((push @ J + by_normal @ of_turning)[None])
    return Pressing(np.concatenate(unknown), known, determinate)


def _against_turning(
    contact: BodyContact, touching: Touching, turning: FloatArray, law: Resisting
) -> tuple[FloatArray, FloatArray]:
    """Moments on body a by a unit normal force, of rolling and of spinning (2, 3); axes of unknown ones (axes, 3)."""
    n = touching.normal
    spin = n * (n @ turning)
    moments, loose = np.zeros((2, 3)), [np.zeros((0, 3))]
    least = _STILL * float(np.linalg.norm(turning))
    rolling = turning - spin + (0.0 if law.turning else contact.bend) * cross(n, touching.slide)
    laws = (
        (law.factor * contact.rolling_resistance, turning if law.along_spin else rolling),
        (contact.spinning_friction, spin),
    )
    for k, (arm, part) in enumerate(laws):
        size = float(np.linalg.norm(part))
        if arm and size > least:
            moments[k] = -arm * part / size
        elif arm:
            loose.append(n[None] if k else frame_of_axis(n)[:, :2].T)
    return moments, np.concatenate(loose)
