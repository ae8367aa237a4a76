"""Contacts that hold still: forces of all contacts within their cones and bounds that let every one of them stick."""

import numpy as np

from proofroll.elements.mechanism.contact.acting import REST, ContactMode
from proofroll.elements.mechanism.contact.distributions import best_distribution, cones_of
from proofroll.truth.bodies.contact_equations import BodiesState, ContactEquations

SLACK = 1e-9  # violation of an inequality, relative to the forces involved, up to which it counts as kept


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
