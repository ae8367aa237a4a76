"""Times and lengths at which a formula has no finite value: no motion goes on there, whatever integrates it."""

from collections.abc import Iterator
from typing import NamedTuple, Protocol

import numpy as np

from proofroll.elements.mechanism import Mechanism, Spring
from proofroll.elements.mechanism.dynamics.link_forces import length_and_rate
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import Formula, Signal
from proofroll.elements.mechanism.scene.spring_law import SpringLaw

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
