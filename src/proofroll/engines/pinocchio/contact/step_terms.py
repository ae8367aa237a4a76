"""Terms of a step's equations with contacts, and the impulses that solve them."""

from typing import NamedTuple

from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.run.contacts.step_events import States
from proofroll.elements.mechanism.scene.rotations import Array


class Impulses(NamedTuple):
    """Impulses of a step.

    Attributes:
        v: velocity after it, shape (nv,).
        impulse: on body a of each contact, world axes [N s], shape (contacts, 3).
        states: of the contacts: open, sticking or with their impulse on the cone.
        moment: of friction against turning on body a of each contact, world axes [N m s], shape (contacts, 3).
        along: impulses of joint rows [N s, N m s], shape (rows,).
        driving: impulses that impose motions [N s, N m s], shape (motions,).
    """

    v: Array
    impulse: Array
    states: States
    moment: Array
    along: Array
    driving: Array


class StepTerms(NamedTuple):
    """Terms of a step's equations.

    Attributes:
        J: contact rows, (contacts, 3, nv): slip velocities along the normal's :func:`frame_of_axis`, the normal last.
        free: velocity after the step without impulses, (nv,).
        inverse: of the mass matrix, (nv, nv).
        touching: geometry of the contacts.
        frames: of their normals.
    """

    J: Array
    free: Array
    inverse: Array
    touching: list[Touching]
    frames: list[Array]
