"""Speed of an engine from clean runs, which only advance, take one last sample, and end where the judged run ends."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from proofroll.core.arrays import largest_difference
from proofroll.core.errors import Diverged, Refused
from proofroll.core.multi_element import AnySample, asking, build, sample_of
from proofroll.core.number_format import number
from proofroll.core.scene import Scene
from proofroll.running.case import Case

if TYPE_CHECKING:
    from proofroll.running.recording import Recording

# Clean runs are repeated up to _TIMED_RUNS times until they took _TIMED_SECONDS together; one run is cut off after
# _ENOUGH_SECONDS [s].
_TIMED_SECONDS = 0.2
_TIMED_RUNS = 3
_ENOUGH_SECONDS = 0.3
# A measurement repeats a short case, each time newly built; with all builds it takes at most this many times the time
# that is to be measured.
_MOST_BUILDING = 5.0
# Largest difference of two runs with the same stops, relative to the size of an element.
_SAME = 1e-6
# The last sample does work that ``advance`` put off if it costs as much as _PUT_OFF usual samples, _PART of the run
# before it, and at least _LEAST_SECONDS [s].
_PUT_OFF, _PART, _LEAST_SECONDS = 10.0, 0.5, 0.05
# The judged run took long if its processor time is this many times that of the clean runs, and at least this much [s].
_TIMES_AS_LONG, _LONG_SECONDS = 10.0, 1.0


def time_once(case: dict[str, Any], seconds: float) -> dict[str, Any]:
    """Measures a case's speed once: clean runs, one after another, for about this much wall time [s].

    For the truth the runs are whole ones, of both routes together.
    """
    from proofroll.core.time_grid import time_grid
    from proofroll.core.truth import truth
    from proofroll.running.loading import engine_and_settings, scene_of

    asked, clock = Case.from_dict(case), time.perf_counter
    scene = scene_of(asked)
    times = time_grid(asked.until, asked.every)
    kind, settings = (None, None) if asked.engine.name == "truth" else engine_and_settings(asked)
    elapsed = simulated = 0.0
    start = clock()
    while elapsed < seconds and clock() - start < _MOST_BUILDING * seconds:
        try:
            if kind is None:
                began = clock()
                truth(scene, times)
                wall, t = clock() - began, float(times[-1])
            else:
                clean = _clean_run(build(kind, scene, settings), times[1:].tolist(), seconds - elapsed)
                wall, t = clean.wall, clean.t
        except (Refused, Diverged) as error:
            return {"seconds_per_second": None, "message": str(error)}
        elapsed, simulated = elapsed + wall, simulated + t
    return {"seconds_per_second": elapsed / simulated, "message": f"{simulated:g} s simulated"}


@dataclass
class CleanRuns:
    """Measurement of runs that only advance.

    Attributes:
        rates: wall time per simulated second of each; empty if they do not repeat the judged run.
        wall, processor: time of all runs [s].
        remarks: warnings about the times, one clause each.
    """

    rates: list[float] = field(default_factory=list)
    wall: float = 0.0
    processor: float = 0.0
    remarks: list[str] = field(default_factory=list)


def clean_runs(kind: Any, scene: Scene, settings: Any, recording: Recording) -> CleanRuns:
    """Clean runs with the stops of the recorded run, each on a newly built engine.

    They must end in the same place as the recorded run, which was sampled.
    """
    last = float(recording.columns["time"].values[-1])
    stops, timed, runs = [t for t in recording.passed if t <= last], CleanRuns(), list[_CleanRun]()
    while len(runs) < _TIMED_RUNS and timed.wall < _TIMED_SECONDS:
        engine, begin = build(kind, scene, settings), time.process_time()
        run = _clean_run(engine, stops, _ENOUGH_SECONDS)
        runs.append(run)
        timed.processor += time.process_time() - begin
        timed.wall += run.wall
        apart = _apart(scene, run.sample, recording.passed[run.t])
        if apart > _SAME:
            timed.remarks.append(
                f"no speed is given: the timed run ends at {run.t:g} s elsewhere than the one that is judged "
                f"({number(apart)} of its size)"
            )
            return timed
    timed.rates = [run.wall / run.t for run in runs]
    longer = recording.advancing[1] / last / max(timed.processor / sum(run.t for run in runs), 1e-12)
    if recording.advancing[1] > _LONG_SECONDS and longer > _TIMES_AS_LONG:
        timed.remarks.append(
            f"the judged run took {longer:.0f} times as long as the timed ones: the engine's preparations, and "
            "results that it keeps from an earlier run, are not in its speed"
        )
    usual = recording.sampling[0] / len(recording.passed)
    put_off = min(runs, key=lambda run: run.sampling)
    if is_put_off(put_off.wall - put_off.sampling, put_off.sampling, usual):
        timed.remarks.append(
            f"{put_off.sampling / put_off.wall:.0%} of a run's time pass in its last sample(), and count: advance() "
            "returns before the state is there"
        )
    return timed


def is_put_off(advancing: float, sampling: float, usual: float) -> bool:
    """True if the last sample does work that ``advance`` put off.

    Args:
        advancing: time of ``advance`` [s].
        sampling: time of the last sample [s].
        usual: time of a usual sample [s].
    """
    return sampling > max(_LEAST_SECONDS, _PART * advancing, _PUT_OFF * usual)


def _apart(scene: Scene, sample: AnySample, rival: AnySample) -> float:
    """Largest distance of the bodies in two samples, relative to the size of their element."""
    pairs = [
        (element.length, sample_of(scene, element, sample), sample_of(scene, element, rival))
        for element in scene.elements
    ]
    return max(largest_difference(state.p_WB, second.p_WB) / length for length, state, second in pairs)


@dataclass(frozen=True)
class _CleanRun:
    """One clean run to time ``t`` [s]: wall time of the whole run and of its last sample [s], and that sample."""

    t: float
    wall: float
    sampling: float
    sample: AnySample


def _clean_run(engine: Any, stops: Iterable[float], enough: float) -> _CleanRun:
    """Clean run: it only advances, and takes one last sample, as some engines finish their work only then.

    It stops where the sampled run stopped, as an adaptive step that passes over a sample would be a cheaper run. It
    ends after ``enough`` wall time [s], which measures a rate as well as ten times as much would.
    """
    clock = time.perf_counter
    start, t, asked = clock(), 0.0, asking(engine)[0]
    for t in stops:
        engine.advance(t)
        if clock() - start > enough:
            break
    advanced = clock()
    sample = engine.sample()
    end = clock()
    return _CleanRun(t, end - start - asking(engine)[0] + asked, end - advanced, sample)
