"""Measurements of the reference bench in its own process: compiled models, and the numeric projection method."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.heyoka_library import TIGHTEST
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.running.simulation import build
from proofroll_benchmarks.first_slip import FirstSlip, Model, first_slip
from proofroll_benchmarks.first_slips import first_slips

# A measurement lasts about this long [s], so that the clock and one interruption do not matter.
_SECONDS = 0.05
_TOLERANCES = (1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14, 1e-15, TIGHTEST)
_NUMERIC_TOLERANCES = (1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13)
_BALLS = 20_000
_CHECKED = 100


@dataclasses.dataclass(frozen=True)
class Timed:
    """A model at the loosest tolerance with which it holds a bound.

    Attributes:
        name: for a person.
        error: largest error of the centre's position at the samples and at the end [m].
        tolerance: of a step [-].
        build_seconds: time of building, and of compiling if it was not compiled yet [s].
        measure: measures one run and gives its wall seconds.
    """

    name: str
    error: float
    tolerance: float
    build_seconds: float
    measure: Callable[[], float]


def compiled(scene: Scene, model: Model, times: FloatArray, true_p: FloatArray, bound: float) -> Timed | None:
    """A compiled model to its first slip, by one call that ends at the event.

    Args:
        scene: with bounded friction.
        model: name of the model.
        times: at which the error is looked at, the last at the first slip or just past it [s], shape (n,).
        true_p: position of the centre then [m], shape (n, 3).
        bound: on the error of the position [m].
    """
    for tolerance in _TOLERANCES:
        start = time.perf_counter()
        run = FirstSlip(rolling_ball(scene), model, tolerance)
        spent = time.perf_counter() - start
        error = 0.0
        for t, p in zip(times.tolist(), true_p, strict=True):
            run.run(t)
            error = max(error, float(np.max(np.abs(run.p_WB - p))))
        if error <= bound:
            until = 2 * float(times[-1])  # the event ends it
            return Timed(f"{model}, compiled", error, tolerance, spent, lambda run=run, until=until: _mean(run, until))  # type: ignore[misc]  # a default binds the loop's value
    return None


def _mean(run: FirstSlip, until: float) -> float:
    """Wall seconds of a run, from as many as fill a measurement."""
    clock, count = time.perf_counter, 0
    start = clock()
    while clock() - start < _SECONDS:
        for _ in range(20):
            run.run(until)
        count += 20
    return (clock() - start) / count


def numeric(scene: Scene, formulation: str, times: FloatArray, true_p: FloatArray, bound: float) -> Timed | None:
    """The projection method in Python by DOP853, in one run without a stop but at the samples.

    Args:
        scene: with unbounded friction.
        formulation: of the engine ``projection``.
        times: samples [s], shape (n,).
        true_p: position of the centre then [m], shape (n, 3).
        bound: on the error of the position [m].
    """
    best: Timed | None = None
    best_seconds = np.inf
    for elimination in (True, False):
        for rtol in _NUMERIC_TOLERANCES:
            options: dict[str, Any] = {"formulation": formulation, "rtol": rtol, "elimination": elimination}
            start = time.perf_counter()
            engine = build(scene, "projection", **options)
            spent = time.perf_counter() - start
            error = 0.0
            for t, p in zip(times.tolist(), true_p, strict=True):
                engine.advance(t)
                error = max(error, float(np.max(np.abs(engine.sample().p_WB - p))))
            if error > bound:
                continue

            def measure(options: dict[str, Any] = options) -> float:
                fresh = build(scene, "projection", **options)
                begin = time.perf_counter()
                for t in times.tolist():
                    fresh.advance(t)
                return time.perf_counter() - begin

            seconds = measure()
            if seconds < best_seconds:
                name = f"projection {formulation}, numpy"
                best, best_seconds = Timed(name, error, rtol, spent, measure), seconds
            break
    return best


class Onsets:
    """First slips in bulk: V0, μ and f around the paper's."""

    def __init__(self, scene: Scene, until: float) -> None:
        random = np.random.default_rng(2006)
        self._scene, self._until = scene, until
        self._balls = {
            "v2": random.uniform(2.5, 6.0, _BALLS),
            "mu": random.uniform(0.2, 0.5, _BALLS),
            "f": random.uniform(0.0, 0.03, _BALLS) * rolling_ball(scene).ball.radius,
        }
        start = time.perf_counter()
        self.found = first_slips(scene, until, **self._balls)
        self.first_seconds = time.perf_counter() - start

    def measure(self) -> float:
        """CPU seconds of this thread per first slip: what one core does, whatever else the machine is at."""
        start = time.thread_time()
        first_slips(self._scene, self._until, **self._balls)
        return (time.thread_time() - start) / _BALLS

    def error(self) -> float:
        """Largest difference from one at a time [s]; inf where one slips and the other does not."""
        worst = 0.0
        for index in range(_CHECKED):
            speed, mu, f = (float(self._balls[key][index]) for key in ("v2", "mu", "f"))
            ball = load_scene(self._scene.name, speed=speed, mu_static=mu, rolling_resistance=f)
            single, bulk = first_slip(ball, self._until), float(self.found[index])
            if (single is None) != bool(np.isnan(bulk)):
                return np.inf
            worst = max(worst, 0.0 if single is None else abs(single - bulk))
        return worst
