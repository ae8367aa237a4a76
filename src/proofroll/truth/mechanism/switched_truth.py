"""Truth of a mechanism with friction, stops or effort limits, by two routes that share the root finder of guards."""

from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import EventKind
from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.commands import has_held
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.record import Record, record_of
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.signal import breaks
from proofroll.elements.mechanism.switches import STOPPED, Mode
from proofroll.truth.hybrid import HybridPath, Stretch, states_of
from proofroll.truth.mechanism.body_switching import SwitchedBodies
from proofroll.truth.mechanism.contact_truth import contact_truth
from proofroll.truth.mechanism.error_bars import TwoRouteMotion, check_start, on_same_turns
from proofroll.truth.mechanism.followed_paths import (
    TOLERANCES,
    Routed,
    counterparts,
    cut_early,
    followed,
    refuse_uncovered,
    times_known,
    two_route_motion,
)
from proofroll.truth.mechanism.held_route import HeldPath, HeldRoute
from proofroll.truth.mechanism.joint_switching import SwitchedTree
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates
from proofroll.truth.mechanism.natural_units import Units, natural_units
from proofroll.truth.mechanism.signal_poles import NEAR, first_pole
from proofroll.truth.mechanism.smooth_truth import find_truth

# rad, natural lengths, or part of a limit: distance from a stop or a limit beyond which it surely does not act; more
# than the error of the scouting run
_APART = 1e-8
_SCOUT = 1e-9  # tolerance of a scouting run, which finds out if any stop is reached


def truth_of(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at rising times [s] of any mechanism, switching or not.

    Raises:
        Refused: fewer than two routes cover the mechanism; the text says why.
        NotUnique: the laws of contact leave more than one motion, or none.
    """
    times, mechanism = np.asarray(times, dtype=float), _with_stops_at_start(mechanism)
    if (pole := first_pole(mechanism, float(times[-1]))) is None:
        return _truth_of(mechanism, times)
    known = times[times < (1 - NEAR) * pole.time]
    if not len(known):
        raise Refused(pole.clause)
    motion = _truth_of(mechanism, known)
    return motion if motion.ended else replace(motion, end=pole.time, ended=pole.clause)


def _truth_of(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at times at which all formulas have finite values; for errors see :func:`truth_of`."""
    try:
        return contact_truth(mechanism, times) if mechanism.contacts else _without_contacts(mechanism, times)
    except Diverged as stopped:
        raise Refused(f"no truth to the end: {stopped}; end before it") from None


def _without_contacts(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth of a mechanism without contacts, by the simplest method that covers its switching."""
    equations, kinks = JointCoordinates(mechanism), breaks(mechanism.signals)
    kinks = kinks or ([0.0] if has_held(mechanism) else [])
    if not (equations.switches or kinks) or mechanism.unmodelled:
        return find_truth(mechanism, times)
    units = natural_units(mechanism)
    own = units.mechanism(mechanism)
    apart = all(joint.limits is None or _inside(joint) for joint in own.joints)
    if apart and not kinks and not any(joint.friction for joint in equations.switched):
        scout = SwitchedTree(JointCoordinates(_narrower(own)), _SCOUT)
        begun = scout.begin()
        assert begun.mode is not None  # every start has a mode
        with units.errors_in_seconds():
            look = scout.walk(0.0, begun.state, begun.mode, float(times[-1]) / units.time)
        if look.guard is None and STOPPED.isdisjoint(look.mode) and not {"least", "greatest"} & {*look.mode}:
            return find_truth(_unlimited(mechanism), times)  # no stop is passed, no limit reached
    refuse_uncovered(mechanism)
    with units.errors_in_seconds():
        return _switched(mechanism, units, own, times / units.time)


def _with_stops_at_start(mechanism: Mechanism) -> Mechanism:
    """Mechanism whose stops lie where its joints start, if these start beyond them by rounding, at most ``AT_STOP``."""
    joints = (
        replace(joint, limits=(min(joint.limits[0], *joint.q0), max(joint.limits[1], *joint.q0)))
        if joint.limits and joint.q0
        else joint
        for joint in mechanism.joints
    )
    return replace(mechanism, joints=tuple(joints))


def _inside(joint: Joint) -> bool:
    """True if a joint with stops starts apart from both."""
    low, high = joint.limits or (-np.inf, np.inf)
    return low + _APART < (joint.q0[0] if joint.q0 else 0.0) < high - _APART


def _unlimited(mechanism: Mechanism) -> Mechanism:
    """Mechanism without effort limits."""
    return replace(mechanism, actuators=tuple(replace(actuator, limit=None) for actuator in mechanism.actuators))


def _narrower(mechanism: Mechanism) -> Mechanism:
    """Mechanism with its stops and limits a little narrower: a motion within them surely touches none."""
    joints = (
        replace(joint, limits=(joint.limits[0] + _APART, joint.limits[1] - _APART)) if joint.limits else joint
        for joint in mechanism.joints
    )
    actuators = (
        actuator if actuator.limit is None else replace(actuator, limit=actuator.limit * (1 - _APART))
        for actuator in mechanism.actuators
    )
    return replace(mechanism, joints=tuple(joints), actuators=tuple(actuators))


def _switched(mechanism: Mechanism, units: Units, own: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at times in natural units; ``own`` is the mechanism in these units."""
    held = tuple(HeldPath(mechanism, units, own) for _ in range(2)) if has_held(mechanism) else ()
    plain = [values.own for values in held] or [own, own]
    equations, second = JointCoordinates(plain[0]), MaximalCoordinates(plain[1])
    check_start(equations, second, units.length)
    tree, bodies = (
        SwitchedTree(equations, TOLERANCES[0]),
        SwitchedBodies(second.lean, equations.switched, TOLERANCES[1]),
    )
    until, kinks = float(times[-1]), breaks(own.signals)
    routes: tuple[Any, Any] = (tree, bodies)
    if held:
        kinks = sorted({*kinks, *held[0].breaks(until)})
        routes = (
            HeldRoute(tree, held[0], tree.start, tree.bodies),
            HeldRoute(bodies, held[1], bodies.start, bodies.bodies),
        )
    paths = followed(*routes, until, kinks)
    if held:
        paths = routes[0].completed(paths[0]), routes[1].completed(paths[1])
    if held and any(item.kind == EventKind.SETTLE for item in paths[0].happenings):
        raise Refused("no route of the truth follows rebounds to their end under held targets yet")
    times = asked = times_known(paths, times)
    for values in held:
        times = values.on_instants(times)
    stretches = paths[0].stretch_at(times)
    others = counterparts(paths, stretches)
    states = states_of(routes[0], paths[0], times, stretches), states_of(routes[1], paths[1], times, others)
    for values in held:
        values.finish()
    one = _by_the_tree(tree, paths[0], times, states[0])
    cut = None if held else cut_early(tree.early(), paths[0], until, kinks, times)
    modes = [bodies.switched(paths[1].stretches[number].mode) for number in others]
    two = on_same_turns(own, one, second.recorded(times, states[1][:, :-1], modes))
    names = ("joint coordinates, DOP853, modes by complementarity", "maximal coordinates, DOP853, modes by trial")
    reason = "a change of the parameters within their accuracy changes which joints hold or hit a stop"
    left = None
    if cut is not None:
        sampled = states_of(tree, cut[0], times, cut[0].stretch_at(times))
        early = on_same_turns(own, one, _by_the_tree(tree, cut[0], times, sampled))
        left = Routed(units.record(mechanism, early)), cut[1]
    # samples at instants are at the times that were asked for, to the last bit
    one, two = (units.record(mechanism, replace(record, time=asked)) for record in (one, two))
    return two_route_motion(mechanism, paths, one, two, names, reason, units, until=until * units.time, cut=left)


def _by_the_tree(tree: SwitchedTree, path: HybridPath[Stretch[Mode]], times: Array, states: Array) -> Record:
    """Motion of the first route along a path with these states, in natural units."""
    stretches, nq = path.stretch_at(times), tree.equations.mechanism.nq
    samples = [
        tree.equations.sample(state[:nq], state[nq:-1], path.stretches[number].mode, float(state[-1]))
        for state, number in zip(states, stretches, strict=True)
    ]
    return record_of(times, samples)
