"""Hypotheses of a right motion that is reported wrongly, for any element with poses and twists.

They test the variables ``p_WB``, ``v_WB``, ``w_WB`` and, if present, ``q_WB``; a kind of element tests its others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray, in_single_precision, known_difference
from proofroll.core.certificate import ROUNDED
from proofroll.core.diagnosis import CLOSES, Cause, Difference, Evidence, Hypothesis, above_round_off, hypothesis
from proofroll.core.diagnosis.fitting import change_by, differing, single_precision
from proofroll.core.diagnosis.vectors import (
    ReportedVector,
    best_clock_factor,
    best_delay,
    delay_text,
    in_steps,
    mistaken_rate,
)
from proofroll.core.multi_element import REQUIRED

if TYPE_CHECKING:
    import xarray as xr

# Velocities come before accelerations: a wrong state makes accelerations wrong, but not the other way round.
_STATE = (("velocity", "the velocity", "m/s"), ("spin", "the angular velocity", "rad/s"))
_RATES = (
    ("acceleration", "the acceleration", "m/s^2"),
    ("angular acceleration", "the angular acceleration", "rad/s^2"),
)
# Fewest samples that determine a frame or a time.
_FEWEST = 3
# Parts of a state that differ by less than this part of the largest difference are not given more weight.
_PART = 1e-2
# Quaternions at time 0 that differ by less than this are equal.
_START = 1e-6


def run_and_truth(evidence: Evidence) -> tuple[xr.Dataset, xr.Dataset] | None:
    """Run and truth; None unless both have enough samples, at the same times."""
    run, truth = evidence.run, evidence.truth
    if run is None or truth is None or run.sizes["time"] != truth.sizes["time"] or run.sizes["time"] < _FEWEST:
        return None
    return run, truth


@hypothesis("float32", "every number of the run, or each built one that differs, is exactly a float32")
def single_precision_run(evidence: Evidence) -> Iterator[Cause]:
    """Hypothesis: samples hold numbers of single precision (24 bits); of random doubles one in 5e8 looks so."""
    yield from single_precision(evidence.lines)
    run, truth = evidence.run, evidence.truth
    said_so = any(str(line["because"]).endswith(ROUNDED) for line in evidence.lines)  # what is declared is no finding
    if run is None or truth is None or said_so:
        return
    required = [run[name].to_numpy() for name in REQUIRED]
    if all(in_single_precision(reported) for reported in required):
        true, says = truth[REQUIRED[0]].to_numpy(), "every number of the run is a single-precision one (float32)"
        difference = known_difference(required[0], true) if required[0].shape == true.shape else np.inf
        remedy = "compute and report in double precision"
        yield Difference(REQUIRED[0], "m", difference).cause("float32", says, 0.0, remedy)


def another_clock(state: Callable[[Any, xr.Dataset], FloatArray], covers: tuple[str, ...]) -> Hypothesis:
    """Hypothesis: all samples are reported with a time offset, or with stretched times.

    Args:
        state: reported motion of an element and a run [m], shape (time, …).
        covers: quantities that it explains.
    """

    @hypothesis(
        "late", "the whole state is the true one, at times that are shifted by one time or stretched by one factor"
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        pair = run_and_truth(evidence)
        if pair is None:
            return
        reported, true = (state(evidence.element, data) for data in pair)
        if reported.shape != true.shape or not above_round_off(
            known_difference(reported, true), float(np.max(np.abs(true)))
        ):
            return
        time, weights = pair[1]["time"].to_numpy(), _alike(reported, true)
        reported, true = reported * weights, true * weights
        if (moved := best_delay(time, reported, true)) is not None:
            delay, difference, remainder = moved
            says = f"every sample is {delay_text(delay, evidence.step)}: the motion is right at another time"
            remedy = "advance(t) has to end at t, neither a step before nor after it"
            state_off = Difference("state", "m", difference, covers, closes=_CLOCK)
            yield state_off.cause("late", says, remainder, remedy, 1, change=in_steps(delay, evidence.step))
        if (paced := best_clock_factor(time, reported, true)) is not None:
            rate, difference, remainder = paced
            says = f"the engine's time runs {rate:.6g} times as fast as it says: the motion is right at other times"
            remedy = "the step that the engine takes is not the one that is counted"
            fitted, change = (0, np.inf) if mistaken_rate(rate) else (1, change_by(rate))
            state_off = Difference("state", "m", difference, covers, closes=_CLOCK)
            yield state_off.cause("clock", says, remainder, remedy, fitted, change=change)

    return test


# Part of a difference that a wrong clock may leave. It is strict, as the clock is a fitted number: a pendulum whose
# push of 20 ms was left out equals the true one at other times up to a fiftieth.
_CLOCK = 2e-3
# Variable -> variables that differ, too, if the motion itself is wrong rather than the report of this variable.
_WITH = {"p_WB": ("v_WB",), "v_WB": ("p_WB", "q_WB"), "w_WB": ("p_WB", "q_WB"), "q_WB": ("w_WB",)}
# Part of its natural size below which a variable stands still.
_STILL = 1e-3
# Causes that may affect positions and velocities at once (of centres of mass) while the rotation is right.
_OF_BOTH = ("frame.", "axes.", "centre of mass.")


def _alike(reported: FloatArray, true: FloatArray) -> FloatArray:
    """Weights that scale all parts of a state to the same largest error: speeds must not hide wrong positions."""
    off = np.abs(reported - true).reshape(-1, reported.shape[-1]).max(axis=0)
    largest = float(np.max(off))
    return np.where(off > _PART * largest, largest / np.maximum(off, _PART * largest), 1.0)


def reported_vectors(
    units: Mapping[str, tuple[str, str]],
    frames: Callable[[Evidence], Mapping[str, FloatArray]],
    clock: Hypothesis,
    least: Callable[[Any, str], float] = lambda *_: 0.0,
    besides: Callable[[ReportedVector, Evidence], Iterable[Cause]] = lambda *_: (),
) -> Hypothesis:
    """Hypothesis: positions, velocities or angular velocities are each reported wrongly.

    Args:
        units: variable -> its description and unit.
        frames: frames in which they may be reported by mistake, at each time of the true run.
        clock: hypothesis of a wrong clock; if proven, it explains all of them.
        least: size below which a variable of an element stands still.
        besides: further causes of a wrong report of one variable.
    """

    @hypothesis(
        "said",
        "the engine's vectors equal the true ones with another sign, unit, order of axes, frame, limit or time, at "
        "every sample; no equation is needed",
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        pair = run_and_truth(evidence)
        if pair is None or any(cause.proven for cause in clock.test(evidence)):
            return
        run, truth = pair
        time, frame_data = truth["time"].to_numpy(), frames(evidence)
        for name, (what, unit) in units.items():
            reported, true, size = run[name].to_numpy(), truth[name].to_numpy(), least(evidence.element, name)
            vector = ReportedVector(
                name=name, what=what, unit=unit, reported=reported, true=true, time=time, frames=frame_data, least=size
            ).after_start()
            moves, turns = moves_otherwise(evidence, name), moves_otherwise(evidence, name, "q_WB", "w_WB")
            for cause in (*vector.causes(evidence.step), *besides(vector, evidence)):
                if not (turns if name != "w_WB" and cause.id.startswith(_OF_BOTH) else moves):
                    yield cause

    return test


def moves_otherwise(evidence: Evidence, name: str, *others: str) -> bool:
    """True if other variables of the state are wrong, too: the motion itself differs, not only one report."""
    least = CLOSES * departure(evidence, name)
    return any(departure(evidence, name_of_rival) > least for name_of_rival in others or _WITH[name])


def forced_otherwise(evidence: Evidence, vector: ReportedVector) -> bool:
    """True if velocities are as wrong as a force: the force belongs to a different motion."""
    least = CLOSES * vector.before / (vector.size or 1.0)
    return any(departure(evidence, name) > least for name in ("v_WB", "w_WB"))


def departure(evidence: Evidence, name: str) -> float:
    """Largest error of a variable, relative to its change in the truth since the start; 0 if a run lacks it."""
    run, truth, element = evidence.run, evidence.truth, evidence.element
    if run is None or truth is None or name not in run or name not in truth or run[name].shape != truth[name].shape:
        return 0.0
    reported, true = run[name].to_numpy(), truth[name].to_numpy()
    off = _largest_turn(reported, true) if name == "q_WB" else known_difference(reported, true)
    length, time = element.length, element.natural_time
    natural = {"p_WB": length, "v_WB": length / time, "w_WB": 1 / time, "q_WB": 1.0}[name]
    return off / max(known_difference(true, np.broadcast_to(true[:1], true.shape)), float(_STILL * natural))


def reported_quaternions(true_ones: Callable[[Evidence], FloatArray]) -> Hypothesis:
    """Hypothesis: quaternions are reported with their scalar last, or inverted.

    ``true_ones`` gives the true quaternions, scalar first, shape (time, …, 4).
    """

    @hypothesis(
        "quaternion", "the engine's quaternions equal the true ones in another order or inverted, up to their sign"
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        pair = run_and_truth(evidence)
        if pair is None or any("q_WB" not in run for run in pair):
            return
        reported, true = pair[0]["q_WB"].to_numpy(), true_ones(evidence)
        if reported.shape != true.shape or moves_otherwise(evidence, "q_WB"):
            return
        if len(reported) > 1 and known_difference(np.abs(reported[0]), np.abs(true[0])) < _START:
            reported, true = reported[1:], true[1:]  # an engine may give at time 0 what it was given
        difference = _largest_turn(reported, true)
        if not above_round_off(difference, 1.0):
            return
        for says, remainder in (
            ("q_WB has its scalar last", _largest_turn(reported, true[..., [1, 2, 3, 0]])),
            (
                "q_WB is that of the inverse rotation, of the world in the body",
                _largest_turn(reported, true * [1, -1, -1, -1]),
            ),
        ):
            remedy = "give a unit quaternion of the body, scalar first"
            yield Difference("q_WB", "1", difference).cause("quaternion", says, remainder, remedy)

    return test


def _largest_turn(reported: FloatArray, rival: FloatArray) -> float:
    """Largest difference of quaternions, up to their signs."""
    signs = np.where(np.sum(reported * rival, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return known_difference(reported * signs, rival)


def at_start(frames_of: Callable[[Any], Mapping[str, FloatArray]], follows: frozenset[str]) -> Hypothesis:
    """Hypothesis: velocities and accelerations at time 0 are reported with wrong signs, units or axes.

    Args:
        frames_of: element -> frames at time 0 in which a vector may be given by mistake, each of shape (vectors, 3, 3).
        follows: quantities that follow from the velocities.
    """
    state, accelerations = ({name for name, _, _ in vectors} for vectors in (_STATE, _RATES))

    @hypothesis(
        "said at time 0", "the scene's own vectors with another sign, unit or axes are those of the certificate"
    )
    def test(evidence: Evidence) -> Iterator[Cause]:
        wrong = {str(line["quantity"]): line for line in differing(evidence.lines)}
        for vectors, others in ((_STATE, state | accelerations | follows), (_RATES, set())):
            for name, what, unit in vectors:
                if name not in wrong or not set(wrong) <= others | {name}:
                    continue
                reported, true = (np.reshape(wrong[name][key], (-1, 3)) for key in ("found", "expected"))
                if reported.shape != true.shape:
                    continue
                frames = {key: frame[None] for key, frame in frames_of(evidence.element).items()}
                yield from ReportedVector(
                    name=name,
                    what=what,
                    unit=unit,
                    reported=reported[None],
                    true=true[None],
                    time=np.zeros(1),
                    frames=frames,
                ).causes(evidence.step)

    return test
