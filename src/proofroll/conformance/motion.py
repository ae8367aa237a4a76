"""Checks of an engine's motion: runs may be cut anywhere, copies move alone, and the step has its declared order."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from functools import cache, partial
from itertools import pairwise
from time import perf_counter
from unittest import SkipTest

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.conformance.subject import Subject, bits, checked_on, require, scenes, truth_scenes
from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import ROUNDINGS
from proofroll.core.engine import Sample, precision_of
from proofroll.core.engine_abilities import declared_order
from proofroll.core.errors import Diverged, InputError
from proofroll.core.scene import Scene

# Precision -> relative difference of two states below which it is little more than accumulated round-off.
_ROUND_OFF = {"double": 1e-9, "single": 1e-4}
# Largest difference of the orders observed with h and h/2. The next term of the error's expansion shifts them by about
# (h/τ)/ln 2 and half of that, with τ a time of the motion: they are as near to the true order as to each other.
_SETTLED = 0.1
_ORDER_TOLERANCE = 0.2
_ORDER_SPAN = 0.1
# Multiples of the preset's step: the first of the search, for which the preset's step is the finest one used, and the
# bounds of the search. Most orders show at the first, at a quarter of the cost of finer steps.
_FIRST = 4.0
_FINEST, _COARSEST = 2.0**-5, 2.0**5
# Length of a run [s] that a method of high order does not make in a single step at a loose tolerance.
_TOLERANCE_SPAN = 0.5
# A short advance [s] (or one step), and the numbers of them in a long one, which grow until it costs clearly more than
# the short one and a sample. The least of _ROUNDS counts, as other processes may lengthen a round many times.
_SHORT, _LONG, _ROUNDS = 1e-3, (100, 1000, 10000), 3
_DEARER = 10.0


def advance_is_repeatable(subject: Subject) -> None:
    """Check: the same scene built twice moves the same, to the last bit."""
    t = subject.span(1)
    sample, repeated = subject.at(t).sample(), subject.at(t).sample()
    require(bits(sample) == bits(repeated), f"two runs of one scene differ by {subject.distance(sample, repeated):.2g}")


def advance_in_two_parts(subject: Subject) -> None:
    """Check: advancing to t/2 and then to t is the same as to t at once; to the present time it does nothing."""
    t = subject.span(2)
    engine = subject.at(t / 2)
    engine.advance(t / 2)
    engine.advance(t)
    difference = subject.distance(engine.sample(), subject.at(t).sample())
    require(
        difference <= subject.closeness,
        f"advance({t / 2:g}) and advance({t:g}) end {difference:.2g} away from advance({t:g}) alone (relative, allowed "
        f"{subject.closeness:.2g})",
    )


def sampling_changes_nothing(subject: Subject) -> None:
    """Check: a run that is sampled on the way ends as one that is not, to the last bit."""
    t = subject.span(4)
    watched, alone = subject.build(), subject.build()
    for part in range(1, 5):
        watched.advance(t * part / 4)
        once, twice = watched.sample(), watched.sample()
        require(bits(once) == bits(twice), f"two samples at {t * part / 4:g} s differ")
        alone.advance(t * part / 4)
    difference = subject.distance(watched.sample(), alone.sample())
    require(bits(watched.sample()) == bits(alone.sample()), f"sampling moved the end of the run by {difference:.2g}")


def samples_cost_the_same(subject: Subject) -> None:
    """Check: a sample costs no more after a long ``advance`` than after a short one: the work is done before."""
    short = subject.span(1, at_least=_SHORT)
    for steps in _LONG:
        long = short + subject.span(steps, at_least=steps * _SHORT)
        try:
            rounds = [_seconds(subject, short, long) for _ in range(_ROUNDS)]
        except Diverged as error:
            raise SkipTest(f"it does not come to {long:g} s: {error}") from None
        handed_over, after_short, advancing, after_long = (min(seconds) for seconds in zip(*rounds, strict=True))
        require(
            after_long <= _DEARER * after_short or after_long <= advancing,
            f"sample() takes {after_long:.2g} s after an advance by {long - short:.2g} s, which returned within "
            f"{advancing:.2g} s, and {after_short:.2g} s after one by {short:.2g} s: advance must return when the "
            "state is there, or the timing misses a part of its cost",
        )
        if advancing > _DEARER * (handed_over + after_short):
            return  # the steps are made there


def _seconds(subject: Subject, short: float, long: float) -> tuple[float, ...]:
    """Times [s] of a short advance, a sample after it, a long advance, and a sample after that."""
    engine = subject.build()
    engine.sample()
    times = [perf_counter()]
    for work in (partial(engine.advance, short), engine.sample, partial(engine.advance, long), engine.sample):
        work()
        times.append(perf_counter())
    return tuple(end - start for start, end in pairwise(times))


def engines_do_not_disturb_each_other(subject: Subject) -> None:
    """Check: two engines alive at once, if possible with different scenes, move as they do alone."""
    t = subject.span(2)
    neighbour = _other(subject)
    alone = [bits(item.at(t).sample()) for item in (subject, neighbour)]
    together = [subject.build(), neighbour.build()]
    for engine in together:
        engine.advance(t)
    for name, engine, expected in zip(("first", "second"), together, alone, strict=True):
        require(bits(engine.sample()) == expected, f"the {name} of two engines moves otherwise than it does alone")


def _other(subject: Subject) -> Subject:
    """The engine on another scene that it represents; if there is none, the same subject."""
    for scene in [*truth_scenes().values(), *scenes().values()]:
        neighbour = replace(subject, scene=scene)
        if scene.digest != subject.scene.digest and checked_on(subject.engine, subject.settings.formulation, scene):
            with suppress(SkipTest):
                neighbour.build()
                return neighbour
    return subject


def velocities_are_the_rates(subject: Subject) -> None:
    """Check: v_WB is the rate of p_WB, and w_WB, in the world, that of q_WB."""
    start = subject.span(1)
    h = subject.span(1, at_least=1e-4)
    engine = subject.at(start)
    early = engine.sample()
    engine.advance(start + h)
    late = engine.sample()
    # differences of two rounded positions and orientations over a short time
    roundings = ROUNDINGS * subject.epsilon / h
    rounding = {"v_WB": roundings * max(1.0, float(np.max(np.abs(late.p_WB)))), "w_WB": roundings}
    for name, rate, start_value, end_value in (
        ("v_WB", (late.p_WB - early.p_WB) / h, early.v_WB, late.v_WB),
        ("w_WB", _spin(early.q_WB, late.q_WB, h), early.w_WB, late.w_WB),
    ):
        if rate is None:
            continue
        mean = (start_value + end_value) / 2
        # A semi-implicit step moves with the velocity at one of its ends, the trapezoidal rule has an error of
        # (ω h)²/12, and a soft contact may vibrate with its step.
        allowed = (
            float(np.linalg.norm(end_value - start_value)) / 2 + 1e-2 * float(np.linalg.norm(mean)) + rounding[name]
        )
        difference = float(np.linalg.norm(rate - mean))
        require(difference <= allowed, f"{name} is {mean}, but the state changes at the rate {rate}")


def _spin(start_q: object, end_q: object, h: float) -> np.ndarray | None:
    """Mean angular velocity in the world [rad/s] between orientations ``h`` [s] apart, or None without any."""
    if start_q is None or end_q is None:
        return None
    start_turn, end_turn = (Rotation.from_quat(np.asarray(q), scalar_first=True) for q in (start_q, end_q))
    return np.asarray((end_turn * start_turn.inv()).as_rotvec() / h)


def order_is_as_declared(subject: Subject) -> None:
    """Check: halving the step divides the error by 2 to the declared order."""
    if not subject.fixed_step:
        raise SkipTest("there is no fixed step")
    declared = declared_order(subject.engine, subject.settings, subject.scene)
    if declared is None:
        raise SkipTest("no order is declared")
    end, factor, seen, exact = cache(partial(_end, subject)), _FIRST, dict[float, str](), True
    # A step may be so short that only round-off is left, or so long that no order shows yet. The search decides that
    # without using the declared order.
    while _FINEST <= factor <= _COARSEST and factor not in seen:
        coarse_order, fine_order = _orders(subject, end, factor)
        dt = subject.settings.dt * factor
        round_off = math.isnan(fine_order)
        seen[factor] = (
            f"{'no more than round-off' if round_off else f'{coarse_order:.2f}, {fine_order:.2f}'} at dt = {dt:g}"
        )
        exact &= round_off
        if round_off:
            factor *= 2
        elif abs(coarse_order - fine_order) > _SETTLED:
            factor /= 2
        else:
            require(
                abs(fine_order - declared) <= _ORDER_TOLERANCE,
                f"the declared order is {declared}, the observed one {fine_order:.2f} at dt = {dt:g}",
            )
            return
    if exact:
        raise SkipTest("every step is exact here, to round-off")
    raise AssertionError(f"the declared order is {declared}, but none is observed: {'; '.join(seen.values())}")


def _orders(subject: Subject, end: Callable[[float, float], FloatArray | None], factor: float) -> tuple[float, float]:
    """Orders from steps 2h, h, h/2 and h, h/2, h/4, with h of ``factor`` preset's steps; NaN within round-off."""
    coarsest = 2 * factor * subject.settings.dt
    t = math.ceil(_ORDER_SPAN / coarsest) * coarsest
    states = []
    for part in (2.0, 1.0, 0.5, 0.25):
        state = end(part * factor, t)
        if state is None:
            return math.inf, 0.0  # too coarse
        states.append(state)
    changes = [float(np.max(np.abs(coarse - fine))) for coarse, fine in pairwise(states)]
    if changes[-1] < _ROUND_OFF[precision_of(subject.settings)]:
        return math.nan, math.nan
    return math.log2(changes[0] / changes[1]), math.log2(changes[1] / changes[2])


def _end(subject: Subject, factor: float, t: float) -> FloatArray | None:
    """Scaled state at time ``t`` [s]; None if it is not finite, or the engine refuses so long a step."""
    try:
        state = subject.scaled(subject.finer(factor).at(t).sample())
    except Diverged:
        return None
    except (InputError, SkipTest):  # the step does not suit the settings or the engine
        if factor <= 1:
            raise
        return None
    return state if np.all(np.isfinite(state)) else None


def tolerance_has_an_effect(subject: Subject) -> None:
    """Check: a tolerance 1e4 times looser changes the answer, and one 1e8 times looser changes it more."""
    if subject.settings.resolution is None:
        raise SkipTest("a closed form has no tolerance")
    if subject.fixed_step:
        raise SkipTest("the step is fixed")
    t = subject.span(1, _TOLERANCE_SPAN)
    tight, *looser = (subject.finer(factor).at(t).sample() for factor in (1.0, 1e4, 1e8))
    near, far = (subject.distance(tight, sample) for sample in looser)
    require(near < far, f"a tolerance 1e8 times looser changes the answer by {far:.2g}, 1e4 times by {near:.2g}")


def copies_move_as_runs(subject: Subject, scenes: Sequence[Scene]) -> None:
    """Check: each copy of a batch ends as a run of its scene alone, and copies of one scene end alike."""
    first_twins, last_twins = [0, 1], [1, 0]
    copies = _moved_as_runs(subject, scenes, first_twins + last_twins)
    for copy, twin in zip(copies[:2], reversed(copies[2:]), strict=True):
        apart = subject.distance(copy, twin)
        require(apart <= ROUNDINGS * subject.epsilon, f"two copies of one scene end {apart:.2g} apart (relative)")


def a_copy_that_overflows_stays_alone(subject: Subject, scenes: Sequence[Scene]) -> None:
    """Check: beside a copy whose numbers are not finite the others move as they do without it."""
    _, overflowing, _ = _moved_as_runs(subject, scenes, [0, len(scenes) - 1, 0])
    if np.all(np.isfinite(subject.scaled(overflowing))):
        raise SkipTest("the engine keeps velocities of any size finite")


def _moved_as_runs(subject: Subject, scenes: Sequence[Scene], pattern: Sequence[int]) -> list[Sample]:
    """Last samples of the copies of a batch; those that do not overflow must end as runs of their scenes alone."""
    t = subject.span(2)
    batch = subject.engine.build_batch([scene.for_an_engine for scene in scenes], pattern, subject.settings)
    require(isinstance(batch.device, str) and batch.device, "a batch names no device; give the place, as cpu")
    batch.advance(t / 2)
    batch.advance(t)
    sample = batch.sample()
    shape, count = np.shape(sample.p_WB), len(pattern)
    require(len(shape) == 3 and shape[0] == count, f"p_WB has the shape {shape} instead of ({count}, bodies, 3)")
    arrays = {item.name: getattr(sample, item.name) for item in fields(sample)}
    copies = []
    for number, index in enumerate(pattern):
        own_arrays = {name: None if values is None else values[number] for name, values in arrays.items()}
        copies.append(type(sample)(**own_arrays))
        if index == len(scenes) - 1:
            continue
        apart = subject.distance(copies[-1], replace(subject, scene=scenes[index]).at(t).sample())
        allowed = f"(relative, allowed {subject.closeness:.2g})"
        require(apart <= subject.closeness, f"copy {number} ends {apart:.2g} from a run of its scene alone {allowed}")
    return copies
