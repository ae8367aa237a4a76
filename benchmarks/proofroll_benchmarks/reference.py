"""The fast reference against the engines, in one run: how many times faster at how large an error.

The scene is Blajer's (2006, section 3): V0 = 4 m/s, f = 0.02 a, μ = 0.35, from the start to the first slip. Nothing
slips before, so the engines run with unbounded friction to that time. All timings are taken in turns.
"""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.heyoka_library import require_heyoka
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.truth.onset import first_slip as true_first_slip
from proofroll.running.engine_questions import lent_workers
from proofroll.running.runner import Runner
from proofroll.running.simulation import simulate
from proofroll.running.store import Store
from proofroll.running.timing import Interval, Timing, machine, ratio, time_in_rounds
from proofroll_benchmarks.compiled import Onsets, Timed, compiled, numeric
from proofroll_benchmarks.first_slip import first_slip
from proofroll_benchmarks.search import SAMPLES, Configuration, search

_SCENE = "sphere_in_cylinder"
_PARAMETERS = {"speed": 4.0, "rolling_resistance": 5e-4}
_MU = 0.35
# Bounds on the error [m]: on z for engines, on the position of the centre for the rest.
ENGINE_BOUND, REDUCED_BOUND, PROJECTION_BOUND = 1e-4, 1e-12, 1e-10
# Ratio -> how many times faster it is to be.
GOALS: Mapping[str, float] = {
    "reduced_over_engine": 40.0,
    "reduced_over_contact": 1000.0,
    "projection_euler": 300.0,
    "projection_rotating_frame": 300.0,
}
ONSETS_GOAL = 50_000.0
# Until when first slips in bulk are looked for [s].
_ONSETS_UNTIL = 4.0
# Configurations whose first ranking is so near that only timings in turns decide.
_FINALISTS = 3


def reference(rounds: int, progress: Callable[[str], None]) -> dict[str, Any]:
    """All measurements, ready for JSON; ``progress`` is called with the next step.

    Raises:
        Refused: heyoka is missing.
    """
    require_heyoka("bench reference")
    scene = load_scene(_SCENE, **_PARAMETERS, mu_static=_MU)
    free = load_scene(_SCENE, **_PARAMETERS)
    progress("the truth")
    slip = true_first_slip(rolling_ball(scene), _ONSETS_UNTIL)
    assert slip is not None  # the paper's case slips
    # Fixed steps reach whole hundredths of a second; what is left, 0.2 ms, is a ten-thousandth of the way.
    until = float(np.floor(slip * 100) / 100)
    grid = np.linspace(0.0, until, SAMPLES + 1)
    true_z = simulate(free, "truth", until=until, every=until / SAMPLES)["z"].to_numpy()
    times = np.append(grid[1:], slip)
    true_p = truth(free, np.append(0.0, times))["p_WB"].to_numpy()[1:]  # shares nothing with what is judged

    progress("compiling")
    models = _models(scene, free, times, true_p)
    onsets = Onsets(scene, _ONSETS_UNTIL)
    with tempfile.TemporaryDirectory() as folder:
        configurations = search(free, until, true_z, ENGINE_BOUND, Runner(Store(Path(folder))), _FINALISTS, progress)
    finalists = {item.name: item for item in configurations}
    with lent_workers(None) as workers:

        def timed(item: Configuration) -> Callable[[], float | None]:
            def task() -> float | None:
                rate = workers.speed(item.case)
                return None if rate is None else rate * slip

            return task

        tasks: dict[str, Callable[[], float | None]] = {name: model.measure for name, model in models.items()}
        tasks |= {name: timed(item) for name, item in finalists.items()}
        tasks["onsets"] = onsets.measure
        timings = time_in_rounds(tasks, rounds, lambda name: progress(f"timing {name}"))
    return _content(slip, models, finalists, timings, onsets, first_slip(scene, _ONSETS_UNTIL))


def _models(scene: Any, free: Any, times: FloatArray, true_p: FloatArray) -> dict[str, Timed]:
    models: dict[str, Timed | None] = {"reduced": compiled(scene, "reduced", times, true_p, REDUCED_BOUND)}
    formulations: tuple[Any, ...] = ("rotating_frame", "euler")
    for formulation in formulations:
        models[f"{formulation} compiled"] = compiled(scene, formulation, times, true_p, PROJECTION_BOUND)
        models[f"{formulation} numeric"] = numeric(free, formulation, times, true_p, PROJECTION_BOUND)
    return {name: model for name, model in models.items() if model is not None}


def _content(
    slip: float,
    models: Mapping[str, Timed],
    finalists: Mapping[str, Configuration],
    timings: Mapping[str, Timing],
    onsets: Onsets,
    own_slip: float | None,
) -> dict[str, Any]:
    engines = sorted((name for name in finalists if name in timings), key=lambda name: timings[name].interval.value)
    fastest = next(iter(engines), None)
    contact = next((name for name in engines if finalists[name].contact), None)
    pairs = {
        "reduced_over_engine": (fastest, "reduced"),
        "reduced_over_contact": (contact, "reduced"),
        "projection_euler": ("euler numeric", "euler compiled"),
        "projection_rotating_frame": ("rotating_frame numeric", "rotating_frame compiled"),
    }
    rate = timings["onsets"].values
    per_second = ratio(Timing((1.0,) * len(rate)), Timing(rate))
    return {
        "scene": _SCENE,
        "parameters": {**_PARAMETERS, "mu_static": _MU},
        "first_slip": {"seconds": slip, "error": None if own_slip is None else abs(own_slip - slip)},
        "models": [
            _row(model.name, model.error, timings[name], tolerance=model.tolerance, build_seconds=model.build_seconds)
            for name, model in models.items()
        ],
        "engines": [
            _row(
                name,
                finalists[name].error,
                timings[name],
                contact=finalists[name].contact,
                settings=finalists[name].case.engine.settings,
            )
            for name in engines
        ],
        "ratios": {name: _ratio(name, slow, fast, timings) for name, (slow, fast) in pairs.items()},
        "onsets_per_second": {
            **dataclasses.asdict(per_second),
            "goal": ONSETS_GOAL,
            "met": per_second.value >= ONSETS_GOAL,
            "error": onsets.error(),
            "build_seconds": onsets.first_seconds,
        },
        "machine": machine(),
    }


def _row(name: str, error: float, timing: Timing, **more: Any) -> dict[str, Any]:
    return {"name": name, "error": error, "seconds": dataclasses.asdict(timing.interval), **more}


def _ratio(name: str, slow: str | None, fast: str, timings: Mapping[str, Timing]) -> dict[str, Any]:
    """Speed-up, with interval; without numbers where one of the two does not hold its bound."""
    goal = {"goal": GOALS[name], "slow": slow, "fast": fast}
    if slow is None or slow not in timings or fast not in timings:
        return {"value": None, "low": None, "high": None, **goal, "met": False}
    speed_up: Interval = ratio(timings[slow], timings[fast])
    return {**dataclasses.asdict(speed_up), **goal, "met": speed_up.value >= GOALS[name]}
