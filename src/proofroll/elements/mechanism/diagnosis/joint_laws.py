"""Hypotheses of wrong gains, gears and limits of actuators, wrong couplings, and misplaced stops."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import CLOSES_EXACTLY, Cause, Difference, Evidence, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import CauseRow, Residuals, change_by, least_squares_parameter
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.dop853 import integrate
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import EventKind, events_of
from proofroll.elements.mechanism.diagnosis.equations import Change, is_motion, is_one_motion, of_start, placed_of
from proofroll.elements.mechanism.diagnosis.residuals import MOTION, by_rows
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.signal import value_at

Effort = Callable[[Actuator, float, float, float], float]
_COVERS = (*MOTION, "effort")
_UNLIMITED = "has no limit on the efforts of actuators"
_STILL = 1e-9
_AT_STOP = 1e-3  # largest distance from a stop of rebounds found by parabolas, relative to the joint's range
# Softness at which the fit of a soft coupling starts: that of a row of impedance 0.9.
_SOFT = 0.1
# Least change of velocity between two samples, relative to the changes before and after, that counts as a jump.
_JUMPS = 5.0
# Samples of a flight between stops at least, accuracy of its continuation, and how many times the rate that forces give
# in one interval a joint has to have that was thrown back.
_FLIGHT, _OF_FLIGHT, _GAINED = 5, 1e-10, 4.0
_REACHES = 2.0  # steps of way beyond a stop in which a method may turn back


def _effort(kp: float = 1.0, kd: float = 1.0, gear: float = 1.0, limit: float = 1.0, clamps: str = "sum") -> Effort:
    """Effort of actuators with factors on their numbers, clamped in sum, in kp's part, at the motor, or not at all."""

    def effort(a: Actuator, t: float, q: float, v: float) -> float:
        n, target, bound = gear * a.gear, float(value_at(a.target, t)), limit * a.bound
        gain = {"torque": 1.0, "velocity": kd * a.kd, "position": kp * a.kp}[a.kind]
        proportional = n * gain * (target - {"torque": 0.0, "velocity": n * v, "position": n * q}[a.kind])
        damping = n * n * kd * a.kd * v if a.kind == "position" else 0.0
        if clamps == "part":
            return float(np.clip(proportional, -bound, bound)) - damping
        bound *= {"sum": 1.0, "motor": abs(n), "nothing": np.inf}[clamps]
        return float(np.clip(proportional - damping, -bound, bound))

    return effort


def _swapped(a: Actuator, t: float, q: float, v: float) -> float:
    """Effort of an actuator with kp and kd exchanged."""
    if a.kind != "position" or not a.kd:
        return a.effort(t, q, v)
    return _effort(kp=a.kd / a.kp, kd=a.kp / a.kd)(a, t, q, v)


@by_rows(
    "actuators", "the equations of motion balance at every state of the run with that law, and not with the scene's"
)
def of_actuators(evidence: Evidence, residuals: Residuals[Change]) -> Iterator[CauseRow[Change]]:
    """Rows: gains, gears and limits of all actuators."""
    mechanism = evidence.element.mechanism
    actuators = mechanism.actuators
    limited = any(item.limit is not None for item in actuators)
    proportional, damped = (any(getattr(item, gain) for item in actuators) for gain in ("kp", "kd"))
    both = any(item.kp and item.kd for item in actuators)
    geared = any(item.gear != 1 for item in actuators)
    torques = any(item.kind == "torque" for item in actuators)
    remedy = "look at gains, gear and limit of the actuators: the limit clamps the whole effort, at the joint"
    laws: list[tuple[bool, str, str, Effort]] = [
        (both, "gains", "has kp and kd swapped", _swapped),
        (limited, "limit", _UNLIMITED, _effort(clamps="nothing")),
        (limited, "limit", "clamps the part of kp alone, not the whole effort", _effort(clamps="part")),
        (limited and geared, "limit", "clamps efforts before the gear", _effort(clamps="motor")),
        (geared, "gear", "leaves out the gears of actuators", lambda a, *x: _effort(gear=1 / a.gear)(a, *x)),
        (geared, "gear", "has gears the other way round", lambda a, *x: _effort(gear=a.gear**-2)(a, *x)),
    ]
    numbers: list[tuple[bool, str, Callable[[float], Effort]]] = [
        (proportional, "kp", lambda x: _effort(kp=x)),
        (damped, "kd", lambda x: _effort(kd=x)),
        (both, "kp and kd", lambda x: _effort(kp=x, kd=x)),
        (torques, "the torques", lambda x: lambda a, *s: x * a.effort(*s)),
        (limited, "the limits", lambda x: _effort(limit=x)),
        (bool(actuators), "the gears", lambda x: _effort(gear=x)),
    ]
    unlimited = False
    for asked, name, says, effort in laws:
        if asked:
            row = CauseRow(f"actuators: {name}", f"the engine {says}", Change(mechanism, effort=effort), remedy)
            unlimited |= says == _UNLIMITED and residuals.cause(row).proven
            yield row
    for asked, what, law in numbers:
        if asked and not (unlimited and what == "the limits"):  # any limit that is large enough
            says, of_limits = f"the engine moves it with {what} of the actuators", what == "the limits"

            def model(x: float, law: Callable[[float], Effort] = law) -> Change:
                return Change(mechanism, effort=law(x))

            name, linear = f"actuators: {what}", what not in {"the limits", "the gears"}
            yield from residuals.scaled(name, says, model, remedy, signed=not of_limits, linear=linear)


@hypothesis(
    "couplings",
    "the rates of both joints have one ratio at every sample, which is not the scene's; at time 0, all accelerations "
    "are those of the mechanism with that ratio",
)
def of_couplings(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: a coupling has a wrong ratio.

    A ratio that closes the difference but for round-off is no error of a step, however near to the scene's.
    """
    mechanism, pair = evidence.element.mechanism, run_and_truth(evidence)
    if not mechanism.couplings:
        return
    moving: FloatArray | None = None
    if pair is not None and is_motion(pair[0]):
        moving = placed_of(mechanism, pair[0]).of_tree()[1]
    elif (start := of_start(evidence)) is not None:
        moving = start.v_rates[0][None]
    if moving is None:
        return
    for k, coupling in enumerate(mechanism.couplings):
        if coupling.joints:
            continue
        a, b = (moving[:, mechanism.place_of(joint)[1]] for joint in (coupling.joint_a, coupling.joint_b))
        ratio_true, alone = coupling.ratio, len(a) < 2
        square = float(a @ a)
        ratio = float(a @ b) / square if square else ratio_true
        difference, remainder = (float(np.max(np.abs(b - x * a))) for x in (ratio_true, ratio))
        if not above_round_off(difference, float(np.max(np.abs(b), initial=0.0))):
            continue
        if alone:
            difference, remainder = (_off_at_start(mechanism, k, x, moving[0]) for x in (ratio_true, ratio))
        says = f"the coupling {coupling.name} has the ratio {ratio:.6g}, not {ratio_true:.6g}"
        remedy = "the scene's ratio is that of joint_b's rate to joint_a's"
        name = "accelerations at time 0" if alone else f"rate of {coupling.joint_b} by its coupling"
        off = Difference(name, "1/s^2" if alone else "1/s", difference, _COVERS)
        change = np.inf if remainder <= CLOSES_EXACTLY * difference else change_by(ratio / ratio_true)
        count = len(moving[0]) if alone else None
        yield off.cause(f"ratio of {coupling.name}", says, remainder, remedy, 1, explains=count, change=change)


@hypothesis(
    "soft couplings",
    "at time 0, all accelerations are those of couplings that yield to their forces, each by the same part of an "
    "inverse inertia that the joints have without them",
)
def soft_couplings(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: the couplings' rows are soft in proportion to an inverse inertia.

    A regularised row gives way by softness times its force. Engines take the softness as a part of an estimate of the
    row's inverse inertia: of its own, or of the sum of those of its joints. A light joint between heavy ones has a
    large one, and its coupling hardly holds.
    """
    mechanism = evidence.element.mechanism
    start = of_start(evidence) if mechanism.couplings else None
    if start is None:
        return
    rows, rates = start.coupled, start.v_rates[0]
    q, v = mechanism.start()
    try:
        without = JointCoordinates(replace(mechanism, couplings=()))
        free = without.solve(q, v).acceleration
        response = np.array([without.solve(q, v, load=row).acceleration - free for row in rows]).T
        inverse = np.linalg.inv(without.inertial(without.tree.at(_at_zero(mechanism), np.zeros(mechanism.nv)))[1])
    except (Diverged, Refused, np.linalg.LinAlgError):  # joints without inertia of their own, which no soft row holds
        return
    of_rows = np.einsum("ij,jk,ik->i", rows, inverse, rows)
    pairs = np.array([len(item.terms) == 2 for item in mechanism.couplings])
    estimates = [("its own inverse inertia", of_rows)]
    if pairs.any():
        of_joints = np.where(pairs, (rows != 0) @ np.diag(inverse), of_rows)
        estimates.insert(0, ("the sum of its joints' inverse inertias", of_joints))

    def accelerations(softness: FloatArray) -> FloatArray:
        return np.asarray(free - response @ np.linalg.solve(rows @ response + np.diag(softness), rows @ free))

    difference = float(np.max(np.abs(accelerations(np.zeros(len(rows))) - rates)))
    if not above_round_off(difference, float(np.max(np.abs(rates)))):
        return
    for whose, estimate in estimates:
        part = least_squares_parameter(lambda x, of=estimate: accelerations(x * of) - rates, _SOFT, _SOFT)  # type: ignore[misc]  # bound now
        remainder = float(np.max(np.abs(accelerations(part * estimate) - rates)))
        if part <= 0 or remainder > CLOSES_EXACTLY * difference:
            continue
        says = f"each coupling is soft and yields to its force by {part:.4g} times {whose}"
        remedy = (
            f"make the couplings stiffer (their impedance is {1 / (1 + part):.4g}; 1 is rigid), give light joints an "
            "armature, or relate heavy joints by one coupling without the light ones"
        )
        off = Difference("accelerations at time 0", "1/s^2", difference, _COVERS)
        yield off.cause("soft couplings", says, remainder, remedy, 1, explains=len(rates), change=part)
        return


def _at_zero(mechanism: Mechanism) -> FloatArray:
    """Coordinates (nq) of the pose that the scene's joints describe: zero, or no rotation."""
    q = np.zeros(mechanism.nq)
    for joint, place in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.kind in WITH_QUATERNION:
            q[place.stop - 4] = 1.0
    return q


def _off_at_start(mechanism: Mechanism, number: int, ratio: float, rates: FloatArray) -> float:
    """Largest distance of accelerations (nv) from those of the mechanism with another ratio of a coupling."""
    couplings = list(mechanism.couplings)
    couplings[number] = replace(couplings[number], ratio=ratio)
    other_model = replace(mechanism, couplings=tuple(couplings))
    q, v = mechanism.start()
    return float(np.max(np.abs(JointCoordinates(other_model).solve(q, v).acceleration - rates)))


@hypothesis(
    "stops",
    "the engine's joint rests at one other place than at the true stop, or turns back at one each time, further off "
    "than a step reaches; if it turns back once, place and rate after that are those of the stop's restitution there",
)
def of_stops(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: a stop is misplaced.

    Its place is where the joint rests, or where it rebounds. The latter counts only if the true joint rebounds at its
    stop, for contacts of bodies and other stops turn joints back, too.
    """
    mechanism, pair = evidence.element.mechanism, run_and_truth(evidence)
    if pair is None or not is_motion(pair[0]) or not any(joint.limits for joint in mechanism.joints):
        return
    if not is_one_motion(*pair, evidence.element.length):
        return
    (seen, speeds), (true, rates) = (placed_of(mechanism, dataset).of_tree() for dataset in pair)
    times = np.asarray(pair[0]["time"], dtype=float)
    for joint in mechanism.joints:
        if not joint.limits:
            continue
        place, rated = mechanism.place_of(joint.name)
        turns, expected = (_rebounds(times, q[:, place], v[:, rated]) for q, v in ((seen, speeds), (true, rates)))
        for limit, side in zip(joint.limits, (1.0, -1.0), strict=True):
            size = max(abs(limit), float(np.ptp(true[:, place]))) or joint.limits[1] - joint.limits[0]
            rests = (np.abs(true[:, place] - limit) <= _STILL * size) & (np.abs(rates[:, rated]) <= _STILL * size)
            does, off, rebounds = "rests", seen[rests, place] - limit, list[_Rebound]()
            if len(off) < 2:
                rebounds = [rebound for rebound in turns if rebound.side == side]
                does, off = "turns back", np.array([rebound.place - limit for rebound in rebounds])
                theirs = [abs(rebound.place - limit) for rebound in expected if rebound.side == side]
                if not theirs or max(theirs) > _AT_STOP * size:
                    continue
            if not len(off) or not above_round_off(float(np.max(np.abs(off))), size):
                continue
            shift = float(np.median(off))
            difference, remainder, count = float(np.max(np.abs(off))), float(np.max(np.abs(off - shift))), len(off)
            fastest = max((rebound.speed for rebound in rebounds), default=float(np.max(np.abs(speeds[:, rated]))))
            # A method turns back, or comes to rest, where a step ends; one that chooses its steps ends them at samples.
            # Several rebounds tell no more: with e = 1, flights after a fall from rest last whole numbers of steps.
            if abs(shift) <= _REACHES * (evidence.step or float(np.max(np.diff(times)))) * fastest:
                continue
            if count == 1:
                difference, remainder = (rebounds[0].missed(x, joint.restitution) for x in (limit, limit + shift))
                count = 2  # place and rate
            says = f"the joint {joint.name} {does} at {limit + shift:.6g}, not at its stop at {limit:.6g}"
            remedy = "look at the place of the stop, at the joint's zero, and at how far the stop gives way"
            at_stop = Difference(f"{joint.name} at its stop", joint.unit, difference, _COVERS)
            name, change = f"stop of {joint.name}", abs(shift) / size
            yield at_stop.cause(name, says, remainder, remedy, 1, explains=count, change=change)


@hypothesis(
    "soft stops",
    "behind a stop without rebounds the run moves on by the scene's equations, at once from a rate that no force gives",
)
def soft_stops(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: a stop gives way, and throws its joint back where the scene's lets it rest.

    A flight of the run between the stops is continued from its first sample by the scene's equations without stops.
    """
    mechanism, pair = evidence.element.mechanism, run_and_truth(evidence)
    limited = [joint for joint in mechanism.joints if joint.limits and not joint.restitution]
    if pair is None or not is_motion(pair[0]) or not limited or mechanism.contacts or mechanism.loops:
        return
    if any(joint.kind in WITH_QUATERNION for joint in mechanism.joints):
        return
    (q, v), (true, _) = (placed_of(mechanism, dataset).of_tree() for dataset in pair)
    times = np.asarray(pair[0]["time"], dtype=float)
    hits = {event.name: event.time for event in reversed(events_of(pair[1])) if event.kind == EventKind.IMPACT}
    for joint in limited:
        if joint.name not in hits or not joint.limits:
            continue
        place, rated = mechanism.place_of(joint.name)
        low, high = joint.limits
        equations = JointCoordinates(
            replace(mechanism, joints=tuple(replace(j, limits=None) for j in mechanism.joints))
        )
        beyond = np.maximum(q[:, place] - high, low - q[:, place])
        for flight in _flights(mechanism, q):
            first = flight.start
            if first == 0 or times[first] <= hits[joint.name]:
                continue
            state = np.concatenate([q[first], v[first]])
            rates = _rates(equations, times[first])
            gained = abs(float(rates(0.0, state)[len(q[0]) + rated])) * (times[first] - times[first - 1])
            above = q[first - 1, place] > (low + high) / 2
            if abs(v[first, rated]) <= _GAINED * gained or (v[first, rated] > 0) == above:
                continue
            expected = np.array([*integrate(rates, state, times[flight] - times[first], _OF_FLIGHT)])[:, place]
            off = np.abs(q[: flight.stop, place] - true[: flight.stop, place])
            says = (
                f"the stop of {joint.name} at {high if above else low:.3g} gives way, by up to {beyond.max():.2g} "
                f"where its stops are {high - low:.2g} {joint.unit} apart, and throws it back at "
                f"{abs(v[first, rated]):.2g} {joint.unit}/s"
            )
            earlier = float(off[times[: flight.stop] < hits[joint.name]].max())
            remainder = float(np.abs(q[flight, place] - expected).max()) + earlier
            remedy = "make the stop stiffer, or slow the joint down: a stop of no width is none for a soft one"
            change = abs(v[first, rated]) / float(np.abs(v[:first, rated]).max())
            name, count = f"soft stop of {joint.name}", len(expected) - 1
            between = Difference(f"{joint.name} between its stops", joint.unit, float(off[flight].max()), _COVERS)
            yield between.cause(name, says, remainder, remedy, 2, explains=count, change=change)
            break


def _flights(mechanism: Mechanism, q: FloatArray) -> Iterator[slice]:
    """Samples between two contacts with stops, of at least :data:`_FLIGHT`; the longest first."""
    inside = np.ones(len(q), dtype=bool)
    for joint in mechanism.joints:
        if joint.limits:
            place, _ = mechanism.place_of(joint.name)
            inside &= (q[:, place] > joint.limits[0]) & (q[:, place] < joint.limits[1])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    flights = [slice(int(start), int(stop)) for start, stop in edges.reshape(-1, 2) if stop - start >= _FLIGHT]
    yield from sorted(flights, key=lambda flight: flight.start - flight.stop)


def _rates(equations: JointCoordinates, start: float) -> Callable[[float, FloatArray], FloatArray]:
    """Right-hand side of coordinates and velocities from a time [s] on."""

    def rates(t: float, y: FloatArray) -> FloatArray:
        q, v = np.split(y, 2)
        return np.concatenate([v, equations.solve(q, v, time=start + t).acceleration])

    return rates


@dataclass(frozen=True)
class _Rebound:
    """A rebound of a coordinate between two samples.

    Attributes:
        before, after: coefficients of the parabolas through the samples before and after it, from the first sample on.
        place: coordinate at which they meet.
        side: sign of the velocity after it.
        h: time between the samples [s].
    """

    before: FloatArray
    after: FloatArray
    place: float
    side: float
    h: float

    @property
    def speed(self) -> float:
        """Largest speed before it."""
        return float(abs(self.before[1]) + 2 * self.h * abs(self.before[2]))

    def missed(self, place: float, restitution: float) -> float:
        """Distance of the second sample, and of its rate times ``h``, from a rebound at another place; the larger."""
        c, b, a = self.before - (place, 0.0, 0.0)
        if (root := b * b - 4 * a * c) < 0:
            return abs(place - self.place)
        x = 2 * c / (-b + self.side * np.sqrt(root))  # where it moves against the side to which it rebounds
        rate = -restitution * (b + 2 * a * x)
        (q, v, half), left = self.after, self.h - x
        there = np.array([place + rate * left + half * left**2, self.h * (rate + 2 * half * left)])
        return float(np.max(np.abs(there - (q + v * self.h + half * self.h**2, self.h * (v + 2 * half * self.h)))))


def _rebounds(t: FloatArray, q: FloatArray, v: FloatArray) -> list[_Rebound]:
    """Rebounds of a coordinate, each where the parabolas through the samples before and after it meet."""
    from scipy.optimize import brentq

    rebounds = []
    steps, changes = np.diff(t), np.diff(v)
    for k in range(1, len(steps) - 1):
        if v[k] * v[k + 1] >= 0 or abs(changes[k]) < _JUMPS * max(abs(changes[k - 1]), abs(changes[k + 1])):
            continue
        h, slope_in, slope_out = steps[k], changes[k - 1] / steps[k - 1], changes[k + 1] / steps[k + 1]
        state = np.array([q[k], v[k], slope_in / 2])
        second = np.array([q[k + 1] - h * v[k + 1] + h * h * slope_out / 2, v[k + 1] - h * slope_out, slope_out / 2])

        def apart(x: float, difference: FloatArray = state - second) -> float:
            return float(difference @ (1.0, x, x * x))

        if apart(0.0) * apart(h) < 0:
            place = float(state @ (1.0, x := brentq(apart, 0.0, h), x * x))
            rebounds.append(_Rebound(before=state, after=second, place=place, side=float(np.sign(v[k + 1])), h=h))
    return rebounds
