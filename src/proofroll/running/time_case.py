"""Speed of an engine from clean runs: they only advance, take one last sample, and end where the judged run ends."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from proofroll.core.arrays import largest_difference
from proofroll.core.errors import Diverged, Refused
from proofroll.core.multi_element import AnySample, build, sample_of
from proofroll.core.number_format import number
from proofroll.core.scene import Scene
from proofroll.running.case import Case

if TYPE_CHECKING:
    from proofroll.running.recording import Recording

# A clean run shorter than this is repeated, up to three times, so that its median means something.
_TIMED_SECONDS = 0.2
_TIMED_RUNS = 3
_ENOUGH_SECONDS = 0.3
# A measurement builds a short case again and again until it has run long enough to mean something, but all of it, the
# builds included, may last no more than this many times as long.
_MOST_BUILDING = 5.0
# The same stops give the same run, to the last bit or nearly so; relative to the size of an element.
_SAME = 1e-6
# A sample that costs so many usual ones, and as much as this part of the run before it, does work that was put off; in
# less than so many seconds nothing can be told.
_PUT_OFF, _PART, _LEAST_SECONDS = 10.0, 0.5, 0.05


def time_once(case: dict[str, Any], seconds: float) -> dict[str, Any]:
    """One measurement of a case's speed: clean runs for about this many wall seconds, one after another.

    Of the truth they are whole runs of both routes together.
    """
    from proofroll.core.time_grid import time_grid
    from proofroll.core.truth import truth
    from proofroll.running.loading import loaded, scene_of

    wanted, clock = Case.from_dict(case), time.perf_counter
    scene = scene_of(wanted)
    times = time_grid(wanted.until, wanted.every)
    kind, settings = (None, None) if wanted.engine.name == "truth" else loaded(wanted)
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
    """Runs that only advance.

    Attributes:
        rates: of each, wall seconds per simulated second; none where they are not the run that is judged.
        wall, processor: of all [s].
        remarks: warnings about the times, one clause each.
    """

    rates: list[float] = field(default_factory=list)
    wall: float = 0.0
    processor: float = 0.0
    remarks: list[str] = field(default_factory=list)


def clean_runs(kind: Any, scene: Scene, settings: Any, recording: Recording) -> CleanRuns:
    """Runs that stop where the one that was recorded did, each on an engine built for it.

    An engine that is not looked at must do the same as one that is: they end at one place.
    """
    last = float(recording.columns["time"].values[-1])
    stops, timed, runs = [t for t in recording.passed if t <= last], CleanRuns(), list[_CleanRun]()
    while len(runs) < _TIMED_RUNS and timed.wall < _TIMED_SECONDS:
        engine, before = build(kind, scene, settings), time.process_time()
        run = _clean_run(engine, stops, _ENOUGH_SECONDS)
        runs.append(run)
        timed.processor += time.process_time() - before
        timed.wall += run.wall
        apart = _apart(scene, run.sample, recording.passed[run.t])
        if apart > _SAME:
            timed.remarks.append(
                f"no speed is given: the timed run ends at {run.t:g} s elsewhere than the one that is judged "
                f"({number(apart)} of its size)"
            )
            return timed
    timed.rates = [run.wall / run.t for run in runs]
    usual = recording.sampling[0] / len(recording.passed)
    put_off = min(runs, key=lambda run: run.sampling)
    if is_put_off(put_off.wall - put_off.sampling, put_off.sampling, usual):
        timed.remarks.append(
            f"{put_off.sampling / put_off.wall:.0%} of a run's time pass in its last sample(), and count: advance() "
            "returns before the state is there"
        )
    return timed


def is_put_off(advancing: float, sampling: float, usual: float) -> bool:
    """True if the last sample does work that ``advance`` put off, by the seconds of both and of a usual sample."""
    return sampling > max(_LEAST_SECONDS, _PART * advancing, _PUT_OFF * usual)


def _apart(scene: Scene, one: AnySample, other: AnySample) -> float:
    """Largest distance of the bodies in two samples, relative to the size of their element."""
    pairs = [
        (element.length, sample_of(scene, element, one), sample_of(scene, element, other)) for element in scene.elements
    ]
    return max(largest_difference(first.p_WB, second.p_WB) / length for length, first, second in pairs)


@dataclass(frozen=True)
class _CleanRun:
    """One run to time ``t`` [s]: wall seconds of all and of its last sample [s], and that sample."""

    t: float
    wall: float
    sampling: float
    sample: AnySample


def _clean_run(engine: Any, stops: Iterable[float], enough: float) -> _CleanRun:
    """A run that only advances, up to a last sample, before which some engines are not done.

    It stops where the sampled run stopped, for an adaptive step that may run past a sample is another, cheaper one;
    and it ends when ``enough`` wall seconds are over, which measure a rate as well as ten times as many do.
    """
    clock = time.perf_counter
    start, t = clock(), 0.0
    for t in stops:
        engine.advance(t)
        if clock() - start > enough:
            break
    advanced = clock()
    sample = engine.sample()
    end = clock()
    return _CleanRun(t, end - start, end - advanced, sample)
