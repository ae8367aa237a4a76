"""Truth of a mechanism whose bodies touch, by two routes that share the root finder of guards and the shapes."""

from dataclasses import replace

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.analysis import RANK
from proofroll.elements.mechanism.commands import has_held
from proofroll.elements.mechanism.contacts.acting import ContactMode, kinds
from proofroll.elements.mechanism.contacts.dynamics import ContactDynamics
from proofroll.elements.mechanism.contacts.geometry import pair_sums
from proofroll.elements.mechanism.record import record_of
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.signal import breaks
from proofroll.truth.hybrid import HybridPath, Stretch, first_close, states_of
from proofroll.truth.mechanism.contact_bodies import ContactBodies
from proofroll.truth.mechanism.contact_bounces import body_poses, contact_bounces, tree_poses
from proofroll.truth.mechanism.contact_equations import ContactEquations
from proofroll.truth.mechanism.contact_tree import ContactTree
from proofroll.truth.mechanism.error_bars import TwoRouteMotion, check_start, on_same_turns
from proofroll.truth.mechanism.followed_paths import (
    CLOSE,
    TOLERANCES,
    Routed,
    at_times,
    counterparts,
    cut_early,
    followed,
    refuse_uncovered,
    times_known,
    two_route_motion,
)
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates
from proofroll.truth.mechanism.natural_units import Units, natural_units


def contact_truth(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at rising times [s].

    Raises:
        NotUnique: the laws of contact leave more than one motion, or none.
        Refused: fewer than two routes cover the mechanism; the text says why.
        Diverged: a route stopped.
    """
    refuse_uncovered(mechanism)
    if has_held(mechanism):
        raise Refused("no route of the truth follows contacts under held targets yet; it follows them in the air")
    units = natural_units(mechanism)
    with units.errors_in_seconds():
        return _in_units(mechanism, units, times / units.time)


def _in_units(mechanism: Mechanism, units: Units, times: Array) -> TwoRouteMotion:
    """Truth at times in natural units, by routes in these units."""
    own = units.mechanism(mechanism)
    dynamics, second = ContactDynamics(own), MaximalCoordinates(own)
    check_start(dynamics.equations, second, units.length)
    size = _size(dynamics)
    tree = ContactTree(dynamics, TOLERANCES[0], size)
    equations = ContactEquations(own, second.lean)
    bodies = ContactBodies(equations, TOLERANCES[1], size)
    until, kinks = float(times[-1]), breaks(own.signals)
    paths = followed(tree, bodies, until, kinks)
    times = times_known(paths, times)
    stretches = paths[0].stretch_at(times)
    others = at_times(paths[1], counterparts(paths, stretches, kinds), times, kinds)
    first = _by_the_tree(tree, paths[0], times)
    one, cut = first.record, cut_early(tree.early(), paths[0], until, kinks, times, kinds)
    states = states_of(bodies, paths[1], times, others)
    modes = [paths[1].stretches[number].mode for number in others]
    applied = [bodies.forces(state, mode) for state, mode in zip(states, modes, strict=True)]
    wrenches = [wrench for _, wrench in applied]
    switched = [equations.switched(state, mode) for state, mode in zip(states, modes, strict=True)]
    two = on_same_turns(own, one, second.recorded(times, states[:, :-1], switched, wrenches))
    routes = (
        f"joint coordinates, {tree.integrators}, contacts by Coulomb's law at all of them at once",
        f"bodies alone, {bodies.integrators}, contact modes by trial",
    )
    ended = first_close(paths, CLOSE)
    reason = _shared_load(dynamics, paths[0], ended) if ended == 0 or not paths[0].known else ""
    reason = reason or "a change of the parameters within their accuracy changes which contacts stick, slide or open"
    other = np.array([force for force, _ in applied])
    others_sums = np.einsum("pk,tki->tpi", pair_sums(own.contacts), other) * units.force
    first, two = _in_si(mechanism, units, first), units.record(mechanism, two)
    left = None
    if cut is not None:
        early = _by_the_tree(tree, cut[0], times)
        early = early._replace(record=on_same_turns(own, one, early.record))
        left = _in_si(mechanism, units, early), cut[1]
    assert first.pressed is not None  # of a mechanism with contacts
    assert first.sums is not None  # of a mechanism with contacts
    motion = two_route_motion(
        mechanism,
        paths,
        first.record,
        two,
        routes,
        reason,
        units,
        kinds=kinds,
        pressed=(first.pressed, other * units.force),
        sums=(first.sums, others_sums),
        until=until * units.time,
        cut=left,
    )
    by_routes = (tree, paths[0], tree_poses(tree)), (bodies, paths[1], body_poses(second))
    last = min(until, *(path.stretches[-1].end for path in paths))
    return replace(motion, bounces=contact_bounces(own, by_routes, motion.events, units, last))


def _by_the_tree(tree: ContactTree, path: HybridPath[Stretch[ContactMode]], times: Array) -> Routed:
    """Motion and forces of the first route along a path, in natural units."""
    stretches, dynamics = path.stretch_at(times), tree.dynamics
    records, forces, sums = zip(
        *(
            dynamics.sample(*dynamics.parts(state)[:2], path.stretches[number].mode, float(state[-1]))
            for state, number in zip(states_of(tree, path, times, stretches), stretches, strict=True)
        ),
        strict=True,
    )
    return Routed(record_of(times, records), np.array(forces), np.array(sums))


def _in_si(mechanism: Mechanism, units: Units, own: Routed) -> Routed:
    """Motion and forces in SI units."""
    assert own.pressed is not None  # of a mechanism with contacts
    assert own.sums is not None  # of a mechanism with contacts
    return Routed(units.record(mechanism, own.record), own.pressed * units.force, own.sums * units.force)


def _shared_load(dynamics: ContactDynamics, path: HybridPath[Stretch[ContactMode]], time: float) -> str:
    """Reason why a motion is not unique from a time on [s], naming contacts whose normal forces are not determinate.

    Empty: all are.
    """
    stretch = path.stretches[path.stretch_at(np.array([time]))[0]]
    q, v, begun = dynamics.parts(stretch.first)
    found = dynamics.solve(q, v, stretch.mode, begun)
    pairs = zip(dynamics.contacts, found.determinate, found.state.touching, strict=True)
    names = [contact.name for contact, known, each in pairs if not known[np.abs(each.normal) > RANK].all()]
    if not names:
        return ""
    return (
        f"{', '.join(names)} carry the load together in more ways than one, so that friction at each is not "
        "determinate (a body on three points, or one that slides without turning, has a truth)"
    )


def _size(dynamics: ContactDynamics) -> float:
    """Largest distance of a contact from the origin at the start, at least the natural length, which is 1."""
    touching = dynamics.at(*dynamics.mechanism.start()).touching
    return max([1.0, *(float(np.abs(each.place).max()) for each in touching)])
