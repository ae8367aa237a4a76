"""The truth of a mechanism that switches (friction, stops, limits), by two routes that share the finder of guards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.elements.mechanism.analysis import analysed
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.record import gathered
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.signal import breaks, varies
from proofroll.truth.hybrid import HybridPath, Stretch, follow, least_margin, states_of
from proofroll.truth.mechanism.body_switching import SwitchedBodies
from proofroll.truth.mechanism.contact_truth import contact_truth
from proofroll.truth.mechanism.joint_switching import SwitchedTree
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates
from proofroll.truth.mechanism.two_routes import (
    FACTOR,
    ROUND_OFF,
    TwoRouteMotion,
    check_start,
    find_truth,
    judged,
    largest,
    matched,
)

_TOLERANCE = 1e-14  # of each step
_GRAZED = 1e-8  # rad, m or part by which a stop or a limit must be passed to act; more than the look ahead is wrong by
_SCOUT = 1e-9  # of a look ahead: whether any stop is reached
# Of the forces in play: nearer to another outcome, a decision hangs on less than parameters are known to.
CLOSE = 1e-9

_Path = HybridPath[Stretch[Any]]


def truth_of(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """The truth at growing times [s], whatever switches on the way.

    Raises:
        Refused: fewer than two routes cover the mechanism; the text says why.
    """
    times = np.asarray(times, dtype=float)
    if mechanism.contacts:
        if any(map(varies, mechanism.signals)) or any(actuator.limit for actuator in mechanism.actuators):
            raise Refused("no route follows contacts together with limits of efforts or with what changes in time")
        return contact_truth(mechanism, times)
    equations = JointCoordinates(mechanism)
    kinks = breaks(mechanism.signals)
    if not (equations.switches or kinks) or mechanism.unmodelled:
        return find_truth(mechanism, times)
    smooth = not kinks and not any(joint.friction for joint in equations.switched)
    try:
        if smooth:
            look = follow(SwitchedTree(JointCoordinates(_wider(mechanism)), _SCOUT), float(times[-1]))
            if not look.happenings and not any(own in {"least", "greatest"} for own in look.legs[0].mode):
                return find_truth(_unlimited(mechanism), times)  # no stop is passed, no limit reached
        return _switched(mechanism, equations, times)
    except Diverged as stopped:
        raise Refused(f"no truth to the end: {stopped}; end before it") from None


def _unlimited(mechanism: Mechanism) -> Mechanism:
    """The mechanism without limits of efforts."""
    return replace(mechanism, actuators=tuple(replace(actuator, limit=None) for actuator in mechanism.actuators))


def _wider(mechanism: Mechanism) -> Mechanism:
    """The mechanism with its stops and limits a little further off: what just comes to one does not pass it."""
    joints = (
        replace(joint, limits=(joint.limits[0] - _GRAZED, joint.limits[1] + _GRAZED)) if joint.limits else joint
        for joint in mechanism.joints
    )
    actuators = (
        actuator if actuator.limit is None else replace(actuator, limit=actuator.limit * (1 + _GRAZED))
        for actuator in mechanism.actuators
    )
    return replace(mechanism, joints=tuple(joints), actuators=tuple(actuators))


def _switched(mechanism: Mechanism, equations: JointCoordinates, times: Array) -> TwoRouteMotion:
    found = analysed(mechanism)
    if found.singular_start:
        raise Refused("the start is a singular pose, where the motion may branch")
    second = MaximalCoordinates(mechanism)
    check_start(equations, second)
    tree, bodies = SwitchedTree(equations, _TOLERANCE), SwitchedBodies(second.lean, equations.switched, _TOLERANCE)
    until, kinks = float(times[-1]), breaks(mechanism.signals)
    paths: tuple[_Path, _Path] = (
        follow(tree, until, kinks),
        follow(bodies, until, kinks),
    )
    parted = _parted(*paths)
    legs = [min(number, len(paths[1].legs) - 1) for number in paths[0].leg_at(times)]
    q_and_v = states_of(tree, paths[0], times, paths[0].leg_at(times))
    nq = mechanism.nq
    one = gathered(
        times,
        [
            equations.sample(state[:nq], state[nq:-1], paths[0].legs[number].mode, float(state[-1]))
            for state, number in zip(q_and_v, paths[0].leg_at(times), strict=True)
        ],
    )
    modes = [bodies.switched(paths[1].legs[number].mode) for number in legs]
    two = matched(mechanism, one, second.recorded(times, states_of(bodies, paths[1], times, legs)[:, :-1], modes))
    masked = replace(one, wrench=np.where(found.determinate, one.wrench, np.nan))
    bars, differences = {}, {}
    other = judged(mechanism, two)
    for field, values in judged(mechanism, masked).items():
        difference = largest(np.where(np.isnan(values), np.nan, other[field]) - values)
        bar = FACTOR * difference + ROUND_OFF * np.maximum.accumulate(largest(values))
        bars[field] = np.maximum.accumulate(bar)
        differences[field] = float(difference[times < parted].max(initial=0.0))
    placed = masked.placed(mechanism)
    size = np.maximum(1.0, np.maximum(largest(placed.p_WB), largest(placed.points)))
    bars["drift"] = np.maximum.accumulate(placed.drift() + ROUND_OFF * size)
    time, close = least_margin(paths)
    horizon = min(parted, time if close < CLOSE else np.inf)
    events = _events(*paths) if np.isinf(parted) else ()
    routes = ("joint coordinates, DOP853, modes by complementarity", "maximal coordinates, DOP853, modes by trial")
    reason = "it hangs on less than the parameters are known to which joints hold"
    return TwoRouteMotion(masked, bars, differences, horizon, [], found.determinate, routes, None, events, reason)


def _parted(one: _Path, two: _Path) -> float:
    """Start of the first leg in which the two routes are in different modes [s]; inf: there is none."""
    for a, b in zip(one.legs, two.legs, strict=False):
        if a.mode != b.mode:
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
