"""Trials of modes in route 2: all contacts held, all that are consistent, and the next of one that is violated."""

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from proofroll.elements.mechanism.contact.distributions import best_distribution, cones_of
from proofroll.elements.mechanism.contact.joint_laws import line_response
from proofroll.elements.mechanism.contact.modes import OPEN, REST, Acting, ContactMode, first_mode
from proofroll.elements.mechanism.contact.rolling_and_spin import led_by_slip
from proofroll.elements.mechanism.scene.rotations import Array, frame_of_axis
from proofroll.truth.bodies.contact_equations import BodiesState, ContactEquations
from proofroll.truth.switching.contact_guards import Touchable

SLACK = 1e-9  # violation of an inequality, relative to the forces involved, up to which it counts as kept


def provisional(equations: ContactEquations, bodies: BodiesState, closed_mask: Sequence[bool]) -> list[Acting]:
    """Provisional mode of each contact: open, or stick, with its line if it can slide along a line only."""
    modes, responses = list[Acting](), equations.responses(bodies)
    for contact, touch, G, shut in zip(equations.contacts, bodies.touching, responses, closed_mask, strict=True):
        frame = frame_of_axis(touch.normal)[:, [2, 0, 1]]
        response = frame.T @ line_response(contact, G, bodies.touching) @ frame
        modes.append(first_mode("stick", frame, np.zeros(2), response) if shut else OPEN)
    return modes


def next_trial(contact: Touchable, acting: Acting, options: Sequence[Acting], force: Array, normal: float) -> Acting:
    """Next trial of a contact whose present one violates an inequality.

    Args:
        contact: its laws.
        acting: its present trial.
        options: all its trials.
        force: on it in the present trial, (3,).
        normal: the normal force that bounds its friction.
    """
    if acting.kind == "open":
        return options[1]
    if (normal < 0 or np.isinf(contact.friction)) and options[0].kind == "open":
        return OPEN
    if acting.kind == "slip":
        return next((option for option in options if option.kind == "stick"), acting)
    slips = [option for option in options if option.kind == "slip"]
    return next((slip for slip in slips if slip.along and np.dot(slip.along, force) < 0), slips[-1])


def follow(contacts: Sequence[Touchable], mode: list[Acting], choices: Sequence[Sequence[Acting]]) -> None:
    """Opens friction against turning in a mode with the contact that presses, and closes it again with it."""
    for k, contact in enumerate(contacts):
        if contact.pressed_by is None:
            continue
        if mode[contact.pressed_by].kind == "open":
            mode[k] = OPEN
        elif led_by_slip(contact, mode):
            mode[k] = OPEN if mode[k].kind == "stick" else mode[k]
        elif mode[k].kind == "open":
            mode[k] = choices[k][0]


def consistent(contacts: Sequence[Touchable], choices: Sequence[Sequence[Acting]]) -> Iterator[ContactMode]:
    """All modes in which friction against turning is open with the contact that presses."""
    for options in itertools.product(*choices):
        mode = list(options)
        follow(contacts, mode, choices)
        # what is opened here counts once
        if all(acting == option or option == of[0] for acting, option, of in zip(mode, options, choices, strict=True)):
            yield tuple(mode)


def all_held(equations: ContactEquations, bodies: BodiesState, mode: ContactMode, free: float) -> bool:
    """True if nothing moves, or contacts share loads, and some distribution of forces lets all of them hold in a mode.

    ``free``: largest rate of a slide without forces of contacts.
    """
    solution = equations.accelerated(bodies, mode)
    if not solution.loose and np.abs(bodies.u).max() > REST:
        return False  # forces are determinate, and a trial among others
    for acting, slide, parting in zip(mode, solution.slide, solution.parting, strict=True):
        left = float(np.abs(slide).max()) if acting.kind == "stick" else abs(parting) if acting.kind == "slip" else 0.0
        if left > SLACK * max(free, REST):
            return False
    cones = cones_of(
        kinds=[acting.kind for acting in mode],
        normals=np.array([touch.normal for touch in bodies.touching]),
        friction=equations.static,
        bounds=equations.bounds,
        pressed_by=[contact.pressed_by for contact in equations.contacts],
        force=solution.force,
        shifts=solution.shifts,
    )
    best = best_distribution(cones)
    weights = np.zeros(solution.shifts.shape[2]) if best is None else best.weights
    return cones.hold(weights, SLACK)
