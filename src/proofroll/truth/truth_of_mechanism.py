"""Truth of any mechanism: the smooth one where nothing switches, else that of contacts and laws of joints.

It ends before poles of signals and springs.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from proofroll.core.errors import Diverged, NotUnique, Refused
from proofroll.elements.mechanism import Joint, Mechanism, Spring
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.held_signals import has_held
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.link_forces import length_and_rate
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.switches import with_stops_at_start
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import Formula, Signal, breaks
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.natural_units import natural_units
from proofroll.truth.smooth.smooth_truth import find_truth
from proofroll.truth.switched_truth import switched_truth
from proofroll.truth.tree.contact_tree import ContactTree

_APART = 1e-8
_SCOUT = 1e-9  # tolerance of a scouting run, which finds out if any stop is reached
_POINTS = 4097  # a pole raises its neighbours on such a grid, however narrow it is
_ZOOM, _ROUNDS = 33, 12  # points of each closer look at a peak, and number of looks: 16 times closer each
_GROWS = 1e9  # growth of a peak, of its size on the grid, that no smooth peak shows between two points
_MOST = 64  # largest number of peaks that are looked at closely
NEAR = 1e-6  # relative distance from a pole up to which routes integrate; nearer, steps would have to shrink too far
# Ways ahead at which a spring's pull is looked at, in those that its length goes on by from a time NEAR its end to it.
_AHEAD = np.linspace(0.0, 10.0, 201)


class _Function(Protocol):
    """A formula of one number."""

    def at(self, values: Array) -> Array:
        """Values of the formula; NaN or infinite where there is none."""


class Pole(NamedTuple):
    """A place without a finite value.

    Attributes:
        field: of the scene.
        formula: there.
        time: of the pole [s].
        last: time just before it [s].
        value: at that time.
    """

    field: str
    formula: str
    time: float
    last: float
    value: float

    @property
    def clause(self) -> str:
        """Clause for a person."""
        near = f"{self.value:.3g} at t = {self.last:.9g} s"
        return f"{self.field} {self.formula} has no finite value at t = {self.time:.6g} s ({near}): end before it"


class _Pull(NamedTuple):
    """Pull of a spring [N] as its length [m] changes at a rate [m/s]."""

    spring: Spring
    rate: float

    def at(self, lengths: Array) -> Array:
        """Pulls at lengths [m]."""
        return np.asarray(self.spring.pull(lengths, self.rate))


def spring_without_pull(motion: Placed, end: float) -> str:
    """Clause about the spring whose formula has no value from the end [s] of a motion on; empty if there is none.

    ``motion``: at one time, NEAR the end.
    """
    for spring in motion.mechanism.springs:
        if isinstance(spring.force, SpringLaw):
            length, rate = (float(values[0]) for values in length_and_rate(motion, spring))
            pull, lengths = _Pull(spring, rate), length + rate * NEAR * end * _AHEAD
            broken = np.flatnonzero(~np.isfinite(_sizes(pull, lengths)))
            if len(broken) and broken[0]:
                beyond, _, _ = _broken(pull, lengths[broken[0] - 1], lengths[broken[0]])
                return f"springs.{spring.name}.force = {spring.force.text} has no value beyond L = {beyond:.9g} m"
    return ""


def first_pole(mechanism: Mechanism, until: float) -> Pole | None:
    """First time up to ``until`` [s] at which a formula of the mechanism has no finite value; None: there is none."""
    poles = [
        Pole(field, str(signal), *place)
        for field, signal in _named(mechanism)
        if isinstance(signal, Formula) and (place := _pole_of(signal, until)) is not None
    ]
    return min(poles, key=lambda pole: pole.time, default=None)


def _named(mechanism: Mechanism) -> Iterator[tuple[str, Signal]]:
    """Signals of a mechanism with their fields."""
    for joint in mechanism.joints:
        yield f"joints.{joint.name}.torque", joint.torque
        if joint.motion is not None:
            yield f"joints.{joint.name}.motion", joint.motion
    for actuator in mechanism.actuators:
        yield f"actuators.{actuator.name}.target", actuator.target
    for force in mechanism.forces:
        for number, part in enumerate(force.value):
            yield f"forces.{force.name}.value.{number}", part


def _pole_of(signal: Formula, until: float) -> tuple[float, float, float] | None:
    """Time of the first pole [s], a time just before it [s], and the value there."""
    times = np.linspace(0.0, until, _POINTS)
    sizes = _sizes(signal, times)
    broken = np.flatnonzero(~np.isfinite(sizes))
    end = int(broken[0]) if len(broken) else len(times)
    finite = np.concatenate([[-np.inf], sizes[:end], [-np.inf]])
    peaks = np.flatnonzero((finite[1:-1] >= finite[:-2]) & (finite[1:-1] >= finite[2:]))
    for peak in np.sort(peaks[np.argsort(-sizes[peaks])][:_MOST]).tolist():
        beside = [max(peak - 1, 0), min(peak + 1, end - 1)]
        low, high = times[beside].tolist()
        if (pole := _closer(signal, low, high, max(sizes[beside]))) is not None:
            return pole
    return _broken(signal, times[end - 1], times[end]) if len(broken) and end else None


def _closer(signal: Formula, low: float, high: float, size: float) -> tuple[float, float, float] | None:
    """Pole between two times [s], at which the formula has at most this size; None: the peak is smooth."""
    for _ in range(_ROUNDS):
        times = np.linspace(low, high, _ZOOM)
        sizes = _sizes(signal, times)
        broken = np.flatnonzero(~np.isfinite(sizes))
        if len(broken):
            return _broken(signal, times[max(broken[0] - 1, 0)], times[broken[0]])
        top = int(np.argmax(sizes))
        low, high = times[max(top - 1, 0)], times[min(top + 1, _ZOOM - 1)]
        if sizes[top] > _GROWS * max(size, np.finfo(float).tiny):
            return float(times[top]), float(low), float(signal.at(low))
    return None


def _broken(signal: _Function, last: float, beyond: float) -> tuple[float, float, float]:
    """First number without a finite value between the last with one and the first without, the last, and its value."""
    while np.nextafter(last, beyond) != beyond:
        middle = (last + beyond) / 2
        if np.isfinite(_sizes(signal, np.array([middle]))[0]):
            last = middle
        else:
            beyond = middle
    return float(beyond), float(last), float(signal.at(np.asarray(last)))


def _sizes(signal: _Function, times: Array) -> Array:
    """Absolute values at times [s] or other numbers; NaN or infinite where there is none."""
    with np.errstate(all="ignore"):
        return np.asarray(np.broadcast_to(np.abs(signal.at(times)), times.shape), dtype=float)


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
