"""The truth of a mechanism whose bodies touch, by two routes that share the finder of guards and the shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.elements.mechanism.analysis import analysed
from proofroll.elements.mechanism.contacts.acting import kinds
from proofroll.elements.mechanism.contacts.dynamics import ContactDynamics
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.record import gathered
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth.hybrid import HybridPath, Stretch, follow, least_margin, states_of
from proofroll.truth.mechanism.contact_bodies import ContactBodies
from proofroll.truth.mechanism.contact_equations import ContactEquations
from proofroll.truth.mechanism.contact_tree import ContactTree
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates
from proofroll.truth.mechanism.two_routes import (
    FACTOR,
    ROUND_OFF,
    TwoRouteMotion,
    check_start,
    judged,
    largest,
    matched,
)

_TOLERANCE = 1e-14  # of each step
# Of the forces in play: nearer to another outcome, a decision hangs on less than parameters are known to.
_CLOSE = 1e-9

_Path = HybridPath[Stretch[Any]]


def contact_truth(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """The truth at growing times [s].

    Raises:
        Refused: fewer than two routes cover the mechanism, or its motion is not unique; the text says why.
    """
    if mechanism.unmodelled:
        raise Refused(f"no route of the truth has {', '.join(mechanism.unmodelled)}")
    found = analysed(mechanism)
    if found.singular_start:
        raise Refused("the start is a singular pose, where the motion may branch")
    dynamics, second = ContactDynamics(mechanism), MaximalCoordinates(mechanism)
    check_start(dynamics.equations, second)
    size = _size(dynamics)
    tree = ContactTree(dynamics, _TOLERANCE, size)
    bodies = ContactBodies(ContactEquations(mechanism, second.lean), _TOLERANCE, size)
    try:
        paths: tuple[_Path, _Path] = (
            follow(tree, float(times[-1])),
            follow(bodies, float(times[-1])),
        )
    except Diverged as stopped:
        raise Refused(f"no truth to the end: {stopped}; end before it") from None
    parted = _parted(*paths)
    legs = paths[0].leg_at(times)
    others = [min(number, len(paths[1].legs) - 1) for number in legs]
    samples = [
        dynamics.sample(state[: mechanism.nq], state[mechanism.nq :], paths[0].legs[number].mode)
        for state, number in zip(states_of(tree, paths[0], times, legs), legs, strict=True)
    ]
    one, pressed = gathered(times, [record for record, _ in samples]), np.array([force for _, force in samples])
    states = states_of(bodies, paths[1], times, others)
    applied = [bodies.forces(state, paths[1].legs[number].mode) for state, number in zip(states, others, strict=True)]
    two = matched(mechanism, one, second.recorded(times, states, applied=[wrench for _, wrench in applied]))
    masked = replace(one, wrench=np.where(found.determinate, one.wrench, np.nan))
    bars, differences = {}, {}
    compared = judged(mechanism, masked) | {"pressed": pressed}
    other = judged(mechanism, two) | {"pressed": np.array([force for force, _ in applied])}
    for field, values in compared.items():
        difference = largest(np.where(np.isnan(values), np.nan, other[field]) - values)
        bars[field] = np.maximum.accumulate(FACTOR * difference + ROUND_OFF * np.maximum.accumulate(largest(values)))
        differences[field] = float(difference[times < parted].max(initial=0.0))
    placed = masked.placed(mechanism)
    reach = np.maximum(size, np.maximum(largest(placed.p_WB), largest(placed.points)))
    bars["drift"] = np.maximum.accumulate(placed.drift() + ROUND_OFF * reach)
    time, close = least_margin(paths)
    horizon = min(parted, time if close < _CLOSE else np.inf)
    happened = _events(*paths) if np.isinf(parted) else ()
    routes = (
        "joint coordinates, DOP853, contacts by Coulomb's law at all of them at once",
        "bodies alone, DOP853, contacts by trial of what they can do",
    )
    reason = "it hangs on less than the parameters are known to which contacts hold, slide or open"
    return TwoRouteMotion(
        masked, bars, differences, horizon, [], found.determinate, routes, None, happened, reason, pressed
    )


def _size(dynamics: ContactDynamics) -> float:
    """Largest distance of a contact from the origin at the start, at least 1 m."""
    touching = dynamics.at(*dynamics.mechanism.start()).touching
    return max(1.0, *(float(np.abs(each.place).max()) for each in touching))


def _parted(one: _Path, two: _Path) -> float:
    """Start of the first leg in which the two routes are in different modes [s]; inf: there is none."""
    for a, b in zip(one.legs, two.legs, strict=False):
        if kinds(a.mode) != kinds(b.mode):
            return min(a.start, b.start)
    last = min(len(one.legs), len(two.legs))
    return np.inf if len(one.legs) == len(two.legs) else min(p.legs[last - 1].end for p in (one, two))


def _events(one: _Path, two: _Path) -> Sequence[Event]:
    """The changes of both routes, each with a bracket that holds both times and their round-off."""
    found = []
    for a, b in zip(one.happenings, two.happenings, strict=True):
        wide = FACTOR * abs(a.time - b.time) + ROUND_OFF * a.time
        found.append(Event(a.kind, float(a.time), float(a.time - wide), float(a.time + wide), a.name))
    return tuple(found)
