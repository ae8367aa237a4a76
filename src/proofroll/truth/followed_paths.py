"""Truth of a mechanism that switches, from the paths of two routes: horizon, events, error bars."""

from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.dataset import end_of_truth
from proofroll.core.errors import Refused
from proofroll.core.events import Event, EventKind
from proofroll.core.pace import PACE
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.error_bars import (
    JUDGED,
    ROUND_OFF,
    Routed,
    TwoRouteMotion,
    bar_of,
    differences_of,
    fields_with_bars,
    largest,
    round_off,
)
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, HybridRoute, ModeT, Stretch, first_close, follow

# Tolerances of each step of the two routes, in natural units. With equal tolerances their steps, and so their errors,
# are nearly equal, and the difference hides them: three free bodies of twelve were 1.7 times their bars off.
TOLERANCES = 1e-14, 3e-14
# Relative margin of a decision below which uncertainties of the parameters may change it.
CLOSE = 1e-9

# Fields whose error at a single sample is of that sample alone, as that of friction just before a slip stops: its
# direction is known to the error of the slip by its speed.
_FORCES = {"wrench", "links", "pressed", "turning", "sums"}

# Accuracies of a time by which the second route is followed beyond an early end of the first, to see its reason, too.
_BEHIND = 10

FollowedPath = HybridPath[Stretch[Any]]


def refuse_uncovered(mechanism: Mechanism) -> None:
    """Refuses mechanisms that no route follows from the start.

    Raises:
        Refused: the mechanism has parts that no route models, or starts in a singular pose.
    """
    if mechanism.unmodelled:
        raise Refused(f"no route of the truth has {', '.join(mechanism.unmodelled)}")
    if mechanism.shares_cone:
        raise Refused(f"no route of the truth has {MechanismCapability.SHARED_CONE}")
    if analyse(mechanism).singular_start:
        raise Refused("the start is a singular pose, where the motion may branch")


def followed(
    tree_route: HybridRoute[ModeT],
    body_route: HybridRoute[ModeT],
    until: float,
    kinks: Sequence[float],
    *,
    smooth: bool = False,
) -> tuple[HybridPath[Stretch[ModeT]], HybridPath[Stretch[ModeT]]]:
    """Paths of two routes to ``until``, in natural units; ``kinks``: times at which the rates are not smooth.

    ``smooth``: nothing switches.

    Where the first ends early the second is not followed beyond that end, for the truth ends there, too.
    """
    try:
        PACE.follow("first", until, smooth=smooth)
        path = follow(tree_route, until, kinks, CLOSE)
        end = until if path.known else path.stretches[-1].end
        last = min(until, end + _BEHIND * time_accuracy(end))
        PACE.follow("second", until, smooth=smooth)
        return path, follow(body_route, last, kinks, CLOSE, first_close([path], CLOSE))
    finally:
        PACE.leave()


def cut_early(
    route: HybridRoute[ModeT], path: HybridPath[Stretch[ModeT]], until: float, kinks: Sequence[float]
) -> HybridPath[Stretch[ModeT]] | None:
    """Path of a ``route`` that cuts infinitely many rebounds early; None: the path has none.

    The error of a cut is quadratic in its speed, so that of the path itself is at most a third of their difference.
    """
    if not any(item.kind == EventKind.SETTLE for item in path.happenings):
        return None
    try:
        PACE.follow("early", until)
        return follow(route, until, kinks, CLOSE)
    finally:
        PACE.leave()


def in_one_mode(path: FollowedPath, early: FollowedPath, times: Array, kinds: Callable[..., Any]) -> NDArray[np.bool_]:
    """True at times at which a path that cuts rebounds early is known, in the mode of the path."""
    modes = zip(
        *([kinds(item.stretches[k].mode) for k in item.stretch_at(times)] for item in (path, early)), strict=True
    )
    alike = np.array([mode_of_path == early_mode for mode_of_path, early_mode in modes])
    return np.asarray(alike & (early.known | (times < early.stretches[-1].end)))


def end_of(paths: tuple[FollowedPath, FollowedPath]) -> tuple[float, str]:
    """Time in natural units at which the first of two paths ends early, and the error that ended it.

    Infinite: both reach the last time. The text is of either that ends there; it is empty where a decision is too close
    to be known.
    """
    early = [path for path in paths if not path.known]
    if not early:
        return np.inf, ""
    shortest = min(early, key=lambda path: path.stretches[-1].end)
    end = max(shortest.stretches[-1].end, 0.0)  # a guard at zero at the start rises before it by round-off
    together = (path.ended for path in early if path.stretches[-1].end <= end + time_accuracy(end))
    return end, shortest.ended or next(filter(None, together), "")


def times_known(paths: tuple[FollowedPath, FollowedPath], times: Array, reason: str) -> Array:
    """Times, in natural units, at which both paths are known, of rising ones; the start always is.

    ``reason``: cause why a motion is not unique from its end on.

    Raises:
        Refused: none of them is.
    """
    end, ended = end_of(paths)
    in_time = times < end - time_accuracy(end) if np.isfinite(end) else np.ones(len(times), dtype=bool)
    in_time[0] |= times[0] == 0.0
    if not in_time.any():
        raise before_first(end, ended or reason)
    return np.asarray(times[in_time])


def before_first(end: float, reason: str) -> Refused:
    """Error that a truth ends before all times that were asked for; ``end``: in natural units."""
    return Refused(f"{end_of_truth(end)}, before the first time that was asked for: {reason}")


def two_route_motion(
    mechanism: Mechanism,
    paths: tuple[FollowedPath, FollowedPath],
    routed: tuple[Routed, Routed],
    routes: tuple[str, ...],
    reason: str,
    units: Units,
    *,
    unresolved: float | Array = 0.0,
    kinds: Callable[[Any], Any] = lambda mode: mode,
    until: float = np.inf,
    cut: tuple[Routed, NDArray[np.bool_]] | None = None,
    left: Mapping[str, Array] | None = None,
    chaotic_from: float = np.inf,
) -> TwoRouteMotion:
    """Motion with error bars, from the paths and records of two routes.

    Args:
        mechanism: bodies and joints, in SI units.
        paths: of both routes, in natural units.
        routed: motion of the first route, taken as the truth, and of the second, matched to the first.
        routes: their names.
        reason: cause why the question is ill-posed from the horizon on.
        units: natural units of the paths.
        unresolved: part of the work of drives that is not known better [J], of all times or of each.
        kinds: part of a mode in which both routes must agree.
        until: last time asked for [s].
        cut: motion of the first route with rebounds cut early, and at which times it counts.
        left: errors that a difference of the routes leaves out, in each field at each time; None: those of ``cut``, and
            of the tolerance of a step.
        chaotic_from: time from which the motion is known to be chaotic [s].
    """
    parted = min(_parted(*paths, kinds) * units.time, chaotic_from)
    determinate = analyse(mechanism).determinate
    masked = _masked(routed[0], determinate)
    fields, others = _fields(mechanism, routed[0], determinate), _fields(mechanism, routed[1], np.array(True))
    placed = masked.placed(mechanism)
    least, step = round_off(fields, placed), dict.fromkeys(fields, 0.0)
    alone = _FORCES if left is None else set()
    if left is None:
        left, step = _left_by_a_cut(mechanism, fields, cut, determinate), _of_a_step(mechanism, masked, units)
    apart = {field: differences_of(values, others[field]) for field, values in fields.items()}
    bars = {field: bar_of(apart[field], left[field] + least[field], alone=field in alone) for field in fields}
    bars = {field: bar + step[field] for field, bar in bars.items()}
    differences = {field: float(apart[field][masked.time < parted].max(initial=0.0)) for field in fields}
    bars["work"] = bars["work"] + unresolved
    reach = np.maximum(units.length, np.maximum(largest(placed.p_WB), largest(placed.points)))
    bars["drift"] = np.maximum.accumulate(placed.drift() + ROUND_OFF * reach)
    horizon = min(parted, first_close(paths, CLOSE) * units.time)
    # A change at the horizon is what the question hangs on, and may lie before it by the root of the accuracy, as where
    # bodies graze each other; of one at the end the last digits would say whether it is in.
    end, ended = end_of(paths)
    last = min(units.time * end, until)
    certain = last - units.time * time_accuracy(last / units.time)
    if np.isfinite(horizon):
        certain = min(certain, horizon - np.sqrt(CLOSE) * max(units.time, horizon))
    happened = tuple(event for event in _events(*paths, units.time) if event.time < certain)
    if np.isfinite(end):
        ended = units.text_in_seconds(ended) or f"from t = {units.time * end:.6g} s on {reason}"
    return TwoRouteMotion(
        record=masked,
        bars=bars,
        differences=differences,
        horizon=horizon,
        branches=[],
        determinate=determinate,
        routes=routes,
        checked_by=None,
        events=happened,
        borders=[stretch.start * units.time for stretch in paths[0].stretches[1:]],
        reason=reason,
        pressed=routed[0].pressed,
        sums=routed[0].sums,
        works=routed[0].works,
        end=end * units.time,
        ended=ended,
    )


def _masked(motion: Routed, determinate: NDArray[np.bool_]) -> Record:
    """Record of a motion without components of wrenches that are not determinate."""
    return replace(motion.record, wrench=np.where(determinate, motion.record.wrench, np.nan))


def _fields(mechanism: Mechanism, motion: Routed, determinate: NDArray[np.bool_]) -> dict[str, Array]:
    """Fields with an error bar of a motion."""
    fields = fields_with_bars(mechanism, _masked(motion, determinate)) | {"work": motion.works}
    if motion.pressed is None or motion.sums is None:
        return fields
    forces, turning = motion.pressed[..., [0, 1, 2, 6]], motion.pressed[..., 3:6]
    return fields | {"pressed": forces, "turning": turning, "sums": motion.sums}


def _left_by_a_cut(
    mechanism: Mechanism,
    fields: Mapping[str, Array],
    cut: tuple[Routed, NDArray[np.bool_]] | None,
    determinate: NDArray[np.bool_],
) -> dict[str, Array]:
    """Difference in each field from the motion with rebounds cut early, at each time; zero where it does not count."""
    left = {name: np.zeros(len(values)) for name, values in fields.items()}
    if cut is None:
        return left
    routed, counts = cut
    others = _fields(mechanism, routed, determinate)
    for name, values in fields.items():
        left[name] = np.where(counts, differences_of(values, others[name]), 0.0)
    return left


def _of_a_step(mechanism: Mechanism, record: Record, units: Units) -> dict[str, float]:
    """Error in each field that the tolerance of one step allows: closer agreement of the routes is chance.

    A force has a part that is quadratic in velocities, and so twice their error times their size in natural units.
    """
    ones = {name: np.ones_like(getattr(record, name)[:1]) for name in JUDGED}
    natural = units.record(mechanism, replace(record, time=record.time[:1], residual=record.residual[:1], **ones))
    sizes = {name: float(largest(getattr(natural, name))[0]) for name in ones}
    sizes |= dict.fromkeys(("energy", "work"), units.force * units.length) | {"points": units.length}
    spin, speed = (float(np.abs(velocities).max(initial=0.0)) for velocities in (record.w_WB, record.v_WB))
    quadratic = 2 * max(1.0, units.time * spin, units.time * speed / units.length)
    sizes |= {
        "wrench": quadratic * sizes["wrench"],
        "pressed": quadratic * units.force,
        "turning": quadratic * units.force * units.length,
        "sums": quadratic * units.force * max(1.0, units.length),  # forces and moments
        "links": quadratic * sizes["wrench"]
        + max((link.stiffest for link in mechanism.links), default=0.0) * units.length,
    }
    return {name: TOLERANCES[0] * size for name, size in sizes.items()}


def stretches_at(paths: tuple[FollowedPath, FollowedPath], times: Array) -> list[int]:
    """Numbers of the first route's stretches at times in natural units; within the bracket of an event, the later one.

    There the routes find the event before or after the sample, and both have to give the value on the same side.
    """
    reached = np.array(times, dtype=float)
    for event in _events(*paths, 1.0):
        reached[(event.time_low <= times) & (times < event.time)] = event.time
    return paths[0].stretch_at(reached)


def counterparts(
    paths: tuple[HybridPath[Stretch[ModeT]], HybridPath[Stretch[ModeT]]],
    stretches: Sequence[int],
    kinds: Callable[[Any], Any] = lambda mode: mode,
) -> list[int]:
    """Numbers of the second route's stretches in which it is while the first is in these stretches."""
    pairs, last = _alike(*paths, kinds)[0], len(paths[1].stretches) - 1
    numbers = []
    for stretch in stretches:
        last_pair = pairs[max(bisect_right(pairs, (stretch, last)) - 1, 0)] if pairs else (0, 0)
        numbers.append(min(max(last_pair[1] + stretch - last_pair[0], 0), last))
    return numbers


def at_times(
    path: FollowedPath, stretches: Sequence[int], times: Array, kinds: Callable[[Any], Any] = lambda mode: mode
) -> list[int]:
    """Numbers of a path's stretches at times in natural units, near the given ones and of the same kinds of mode.

    A route may divide what the other follows in one stretch at another time, as the beginning of a slip. No time is
    taken across a jump of the state, as at an impact, or across a turn of a slip, where both routes give the value on
    the same side.
    """

    def passes(number: int) -> bool:
        """True if nothing but the time divides a stretch from the next one."""
        return path.stretches[number].end not in turns and _goes_on(path.stretches[number:], kinds)

    states, turns = [], {item.time for item in path.happenings if item.kind == EventKind.TURN}
    for number, time in zip(stretches, times, strict=True):
        near = number
        while near > 0 and time <= path.stretches[near].start and passes(near - 1):
            near -= 1
        while time >= path.stretches[near].end and passes(near):
            near += 1
        states.append(near)
    return states


def _alike(
    path_a: FollowedPath, path_b: FollowedPath, kinds: Callable[[Any], Any]
) -> tuple[list[tuple[int, int]], list[Stretch[Any]]]:
    """Numbers of stretches of both routes that are in the same mode in turn, and the stretches from where they part.

    Changes at the same instant may come in either order; if that order matters, the margin of a decision is small. A
    route may divide what the other follows in one stretch; a jump, as at an impact, divides it in both.
    """
    pairs, left = list[tuple[int, int]](), [list(path.stretches) for path in (path_a, path_b)]
    last: Any = None
    while all(left):
        if kinds(left[0][0].mode) == kinds(left[1][0].mode):
            last, parts = kinds(left[0][0].mode), [_parts(ones, kinds) for ones in left]
            number_a, number_b = len(path_a.stretches) - len(left[0]), len(path_b.stretches) - len(left[1])
            pairs += [(number_a + k, number_b + min(k, parts[1] - 1)) for k in range(parts[0])]
            del left[0][: parts[0]], left[1][: parts[1]]
        elif passing := next(filter(lambda ones: _instant(ones[0]), left), None):
            del passing[0]
        elif divided := next((ones for ones in left if kinds(ones[0].mode) == last), None):
            if divided is left[0]:
                pairs.append((len(path_a.stretches) - len(left[0]), len(path_b.stretches) - len(left[1]) - 1))
            del divided[0]
        else:
            break
    apart = left[0] + left[1]
    if all(left):
        return pairs, apart
    apart = [stretch for stretch in apart if not _instant(stretch)]
    while pairs and apart and kinds(apart[0].mode) == kinds(path_a.stretches[pairs[-1][0]].mode):
        del apart[0]  # one route divides what the other follows in one stretch to the last time
    return pairs, apart


def _goes_on(stretches: Sequence[Stretch[Any]], kinds: Callable[[Any], Any]) -> bool:
    """True if the first of some stretches goes on in the next, in the same kinds of mode and without a jump."""
    if len(stretches) < 2 or kinds(stretches[0].mode) != kinds(stretches[1].mode):
        return False
    last, begin = stretches[0].last[:-1], stretches[1].first[:-1]  # each time has its own last digit
    return bool(np.all(np.abs(begin - last) <= CLOSE * np.maximum(1.0, np.abs(last))))


def _parts(stretches: Sequence[Stretch[Any]], kinds: Callable[[Any], Any]) -> int:
    """Number of the first stretches that a route with longer stretches follows in one."""
    return next(k for k in range(1, len(stretches) + 1) if not _goes_on(stretches[k - 1 : k + 1], kinds))


def _parted(path_a: FollowedPath, path_b: FollowedPath, kinds: Callable[[Any], Any]) -> float:
    """Start of the first stretch in which the two routes are in different modes [s]; inf: there is none."""
    return min((stretch.start for stretch in _alike(path_a, path_b, kinds)[1]), default=np.inf)


def _instant(stretch: Stretch[Any]) -> bool:
    """True if a stretch is shorter than the accuracy of times."""
    return bool(stretch.end - stretch.start <= time_accuracy(stretch.end))


def time_accuracy(time: float) -> float:
    """Accuracy of event times, in natural units: relative to the time, at least to the unit of time."""
    return CLOSE * max(1.0, time)


def _events(path_a: FollowedPath, path_b: FollowedPath, unit: float) -> Sequence[Event]:
    """Events of both routes, each with a bracket that contains both times, a step's error and blur; ``unit`` [s]."""
    events, least = [], ROUND_OFF + TOLERANCES[0]  # closer agreement of the routes is chance
    # One route may have more events after they part.
    for a, b in zip(path_a.happenings, path_b.happenings, strict=False):
        time, wide = (unit * float(a.time), unit * (SAFETY * abs(a.time - b.time) + least * max(1.0, a.time) + a.blur))
        events.append(
            Event(kind=a.kind, time=time, time_low=float(time - wide), time_high=float(time + wide), name=a.name)
        )
    return tuple(events)
