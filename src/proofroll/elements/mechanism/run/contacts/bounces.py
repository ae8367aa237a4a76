"""Bounces of bodies with contacts: which body bounces, energy and heights along a motion."""

from collections.abc import Sequence

import numpy as np

from proofroll.core.bounces import Bounce, Course, bounces_along
from proofroll.core.columns import Columns
from proofroll.core.events import IMPACTS, events_of
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.scene.model import Mechanism


def bouncing_bodies(mechanism: Mechanism) -> dict[str, int]:
    """Name of a contact -> index of the body that bounces: that of the first geometry, unless it is the world's.

    Empty without gravity, which says what height is.
    """
    if not np.any(mechanism.gravity):
        return {}
    index = mechanism.body_index
    pairs = {contact.name: (index[contact.body_a], index[contact.body_b]) for contact in mechanism.contacts}
    return {name: a if a >= 0 else b for name, (a, b) in pairs.items()}


def course_of(placed: Placed) -> Course:
    """Energy along a motion, and heights of the centres of mass against gravity."""
    mechanism = placed.mechanism
    gravity = np.array(mechanism.gravity)
    up = -gravity / (np.linalg.norm(gravity) or 1.0)
    places = [placed.point(body.name, body.com) @ up for body in mechanism.bodies]
    rates = [placed.velocity(body.name, body.com) @ up for body in mechanism.bodies]
    return Course(placed.time, placed.energy(), np.stack(places, axis=1), np.stack(rates, axis=1))


def sampled_bounces(mechanism: Mechanism, columns: Columns) -> Sequence[Bounce]:
    """Energy and height of each impact in the samples of a run; empty where it does not give orientations."""
    events = events_of(columns)
    if "q_WB" not in columns or not any(event.kind in IMPACTS for event in events):
        return ()
    placed = Placed(mechanism, *(columns[name].values for name in ("time", "p_WB", "v_WB", "w_WB", "q_WB")))
    return bounces_along(course_of(placed), events, bouncing_bodies(mechanism))
