"""Truth of any mechanism: the smooth one where nothing switches, else that of contacts and laws of joints."""

from dataclasses import replace

import numpy as np

from proofroll.core.errors import Diverged, NotUnique, Refused
from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.held_signals import has_held
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.switches import with_stops_at_start
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import breaks
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.natural_units import natural_units
from proofroll.truth.signal_poles import NEAR, first_pole, spring_without_pull
from proofroll.truth.smooth.smooth_truth import find_truth
from proofroll.truth.switched_truth import switched_truth
from proofroll.truth.tree.contact_tree import ContactTree

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
    times, mechanism = np.asarray(times, dtype=float), with_stops_at_start(mechanism)
    if (pole := first_pole(mechanism, float(times[-1]))) is None:
        return _with_reason(mechanism, _truth_of(mechanism, times))
    known_times = times[times < (1 - NEAR) * pole.time]
    if not len(known_times):
        raise Refused(pole.clause)
    motion = _truth_of(mechanism, known_times)
    return motion if motion.ended else replace(motion, end=pole.time, ended=pole.clause)


def _with_reason(mechanism: Mechanism, motion: TwoRouteMotion) -> TwoRouteMotion:
    """The motion, whose end is that of a spring's formula where it is."""
    if not motion.ended or not any(isinstance(spring.force, SpringLaw) for spring in mechanism.springs):
        return motion
    try:
        nearer = _truth_of(mechanism, np.array([(1 - NEAR) * motion.end]))
    except (Refused, NotUnique):
        return motion
    clause = spring_without_pull(nearer.record.placed(mechanism), motion.end)
    return replace(motion, ended=clause) if clause else motion


def _truth_of(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at times at which all formulas have finite values; for errors see :func:`truth_of`."""
    try:
        return switched_truth(mechanism, times) if mechanism.contacts else _without_contacts(mechanism, times)
    except Diverged as stopped:
        raise Refused(f"no truth to the end: {stopped}; end before it") from None


def _without_contacts(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth of a mechanism without contacts, by the simplest method that covers its switching."""
    equations, kinks = JointCoordinates(mechanism), breaks(mechanism.signals)
    kinks = kinks or ([0.0] if has_held(mechanism) else [])
    bent = bool(kinks or mechanism.kinks)
    if not (equations.switches or bent) or mechanism.unmodelled:
        return find_truth(mechanism, times)
    rubs = any(joint.friction for joint in equations.switched)
    if not bent and not rubs and _reaches_none(mechanism, times):
        unlimited = _unlimited(mechanism)
        return _with_idle_stops(find_truth(unlimited, times), unlimited, mechanism)
    return switched_truth(mechanism, times)


def _reaches_none(mechanism: Mechanism, times: Array) -> bool:
    """True if no stop is passed and no limit of an effort reached, by a run of the first route alone."""
    units = natural_units(mechanism)
    scaled = units.mechanism(mechanism)
    if not all(joint.limits is None or _inside(joint) for joint in scaled.joints):
        return False
    scout = ContactTree(ContactDynamics(_narrower(scaled)), _SCOUT, 1.0)
    begun = scout.begin()
    assert begun.mode is not None  # every start has a mode
    if any(scaled.kind != "open" for scaled in begun.mode) or np.any(np.abs(scout.dynamics.drawn(begun.state)) > 1):
        return False
    with units.errors_in_seconds():
        return scout.walk(0.0, begun.state, begun.mode, float(times[-1]) / units.time).guard is None


def _inside(joint: Joint) -> bool:
    """True if a joint with stops starts apart from both."""
    low, high = joint.limits or (-np.inf, np.inf)
    return low + _APART < (joint.q0[0] if joint.q0 else 0.0) < high - _APART


def _unlimited(mechanism: Mechanism) -> Mechanism:
    """Mechanism without stops and effort limits."""
    joints = tuple(replace(joint, limits=None, restitution=0.0) for joint in mechanism.joints)
    actuators = tuple(replace(actuator, limit=None) for actuator in mechanism.actuators)
    return replace(mechanism, joints=joints, actuators=actuators)


def _with_idle_stops(motion: TwoRouteMotion, unlimited: Mechanism, mechanism: Mechanism) -> TwoRouteMotion:
    """The motion with the named forces of stops that nothing reaches, which are zero."""
    record, names = motion.record, [item.name for item in named_forces(unlimited)]
    columns = [
        record.named[:, names.index(item.name)] if item.name in names else np.zeros(len(record.time))
        for item in named_forces(mechanism)
    ]
    named = np.stack(columns, axis=1) if columns else record.named
    return replace(motion, record=replace(record, named=named))


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
