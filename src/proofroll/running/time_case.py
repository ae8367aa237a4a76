"""How fast an engine is: runs that only advance it."""

from __future__ import annotations

import time
from typing import Any

from proofroll.core.errors import Diverged, Refused
from proofroll.core.several import build
from proofroll.running.case import Case

# A clean run shorter than this is repeated, up to three times, so that its median means something.
_TIMED_SECONDS = 0.2
_TIMED_RUNS = 3
_ENOUGH_SECONDS = 0.3
# A measurement builds a short case again and again until it has run long enough to mean something, but all of it, the
# builds included, may last no more than this many times as long.
_MOST_BUILDING = 5.0


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
                wall, t = _clean_run(build(kind, scene, settings), times, seconds - elapsed)
        except (Refused, Diverged) as error:
            return {"seconds_per_second": None, "message": str(error)}
        elapsed, simulated = elapsed + wall, simulated + t
    return {"seconds_per_second": elapsed / simulated, "message": f"{simulated:g} s simulated"}


def clean_runs(kind: Any, scene: Any, settings: Any, times: Any) -> tuple[list[float], tuple[float, float]]:
    """Wall seconds per simulated second of runs that only advance, each on an engine built for it.

    Besides, wall and processor seconds of all.
    """
    rates: list[float] = []
    spent = processor = 0.0
    while len(rates) < _TIMED_RUNS and spent < _TIMED_SECONDS:
        engine, before = build(kind, scene, settings), time.process_time()
        wall, t = _clean_run(engine, times, _ENOUGH_SECONDS)
        processor += time.process_time() - before
        rates.append(wall / t)
        spent += wall
    return rates, (spent, processor)


def _clean_run(engine: Any, times: Any, enough: float) -> tuple[float, float]:
    """Wall seconds and simulated seconds of a run that only advances.

    It stops where the sampled run stopped, for an adaptive step that may run past a sample is another, cheaper one;
    and it ends when ``enough`` wall seconds are over, which measure a rate as well as ten times as many do.
    """
    clock = time.perf_counter
    start = clock()
    for t in times[1:].tolist():
        engine.advance(t)
        if clock() - start > enough:
            break
    return clock() - start, t
