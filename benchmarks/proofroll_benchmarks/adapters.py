"""Cost of an adapter: its ``advance`` against a bare loop, in turns in one process, over the same time grid."""

from __future__ import annotations

import dataclasses
import gc
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from proofroll.core.errors import ProofrollError, Refused
from proofroll.running.timing import Interval, Timing, ratio, time_in_rounds

SCENE = "sphere_in_cylinder"
# A tree of one joint, where an adapter's own cost shows most, and one with loops that depend on each other.
MECHANISMS = ("pendulum", "four_bar")
# Bodies that touch: a corner that lands, feet that slip, spheres that meet, a disc that rolls.
CONTACTS = ("falling_rod", "sled", "two_spheres", "rolling_coin")
# The study's usual sampling interval, and the longest run [s].
EVERY, UNTIL = 0.02, 2.0
# A measurement is repeated within a round until it has lasted this long [s], so that a ratio means something.
LEAST_SECONDS = 0.1
ROUNDS = 7
# The goal for a ratio.
GOAL = 1.15
# What is measured: the paper's motion without and with rolling resistance.
VARIANTS: Mapping[str, Mapping[str, float]] = {
    "f = 0": {},
    "f > 0": {"rolling_resistance": 5e-4},
}
_LIMIT = 300.0


@dataclasses.dataclass(frozen=True)
class AdapterRow:
    """One engine with one model.

    Attributes:
        engine, formulation, preset, variant: names of the run; the variant is a ball's, or the scene of a mechanism.
        ratio: adapter over bare loop, with its interval; None if there is none.
        message: why there is none, else how far apart the two ended, or the share of the part that the engine lacks.
        refused: True if the engine refuses the scene, so that there is nothing to measure.
        lacks: part of the adapter that the engine has not and the bare loop leaves out, as ``wall``; empty: none.
        adapter, bare: median seconds of the process per simulated second, if measured.
        distance: between the ball's centres, or the bodies' origins, at the end [m].
        tolerance, because: allowed difference [m], and the reason why it is not zero.
        until: simulated seconds of one run [s].
        within_goal: True if the ratio is at most :data:`GOAL`.
        failed: True if the row should have been measured, and was not.
    """

    engine: str
    formulation: str
    preset: str
    variant: str
    ratio: Interval | None
    message: str
    adapter: float | None = None
    bare: float | None = None
    distance: float | None = None
    tolerance: float | None = None
    because: str | None = None
    until: float | None = None
    refused: bool = False
    lacks: str = ""

    @property
    def within_goal(self) -> bool | None:
        """True if the ratio is at most the goal; None if there is none, or if it tells the share of a part."""
        return None if self.ratio is None or self.lacks else self.ratio.value <= GOAL

    @property
    def failed(self) -> bool:
        """True if there is no ratio, and the engine represents the scene."""
        return self.ratio is None and not self.refused


def measure_adapter(
    engine: str,
    options: Mapping[str, Any],
    parameters: Mapping[str, float],
    rounds: int,
    seconds: float,
    scene_name: str = SCENE,
) -> dict[str, Any]:
    """Runs in a worker: centres of both loops, and their timings per simulated second, in turns.

    Raises:
        Refused, Diverged: one of the two cannot be run.
    """
    from proofroll.core.plugins import load_engine, resolve_settings
    from proofroll.files.scene_file import load_scene
    from proofroll_benchmarks.bare import load_bare_loop

    prepare = load_bare_loop(engine)
    kind = load_engine(engine)
    settings, scene = resolve_settings(kind, options), load_scene(scene_name, **parameters)
    # Both loops compute without a pause in this process, so its own time is what they take, whoever else computes here.
    clock = time.process_time

    def adapter(times: np.ndarray[Any, Any]) -> tuple[float, Any]:
        built = kind.build(scene, settings)
        instants = times[1:].tolist()
        gc.collect()
        start = clock()
        for t in instants:
            built.advance(t)
        return clock() - start, built

    def bare(times: np.ndarray[Any, Any]) -> tuple[float, Any]:
        prepared = prepare(scene, settings)
        gc.collect()
        start = clock()
        centre = prepared.run(times)
        return clock() - start, (centre, prepared)

    try:
        kind.build(scene, settings)
    except Refused as error:
        return {"refused": str(error)}
    # As long as the two together take several times the least, but no longer than the usual study.
    first = _grid(10 * EVERY)
    probe = (adapter(first)[0] + bare(first)[0]) / first[-1]
    times = _grid(min(UNTIL, max(2 * seconds / probe, 10 * EVERY)))
    p_adapter = adapter(times)[1].sample().p_WB
    p_bare, prepared = bare(times)[1]

    def repeated(once: Callable[[Any], tuple[float, Any]]) -> float:
        spent, runs = 0.0, 0
        while spent < seconds:
            spent, runs = spent + once(times)[0], runs + 1
        return float(spent / runs / times[-1])

    distance = float(np.linalg.norm(np.asarray(p_adapter) - p_bare))
    answer = {
        "distance": distance,
        "tolerance": prepared.tolerance,
        "because": prepared.because,
        "until": float(times[-1]),
        "lacks": prepared.lacks,
    }
    if not (prepared.lacks or distance <= prepared.tolerance):
        return answer
    timings = time_in_rounds({"adapter": lambda: repeated(adapter), "bare": lambda: repeated(bare)}, rounds)
    return answer | {name: list(timing.values) for name, timing in timings.items()}


def _grid(until: float) -> np.ndarray[Any, Any]:
    return np.arange(round(until / EVERY) + 1) * EVERY


def bench_adapters(
    engines: Sequence[str],
    preset: str = "matched",
    rounds: int = ROUNDS,
    seconds: float = LEAST_SECONDS,
    progress: Callable[[str], None] | None = None,
) -> list[AdapterRow]:
    """All formulations of some engines, each with every variant, one worker process per engine."""
    from proofroll.files.scene_file import load_scene
    from proofroll.running.process import Worker, WorkerDied
    from proofroll_benchmarks.bare import bare_loop

    rows: list[AdapterRow] = []
    asked = {name: load_scene(name).requires for name in (SCENE, *MECHANISMS, *CONTACTS)}
    for engine in engines:
        worker = Worker()
        try:
            try:
                described = worker.request({"do": "describe", "engine": engine}, _LIMIT)
                formulations = [
                    (name, preset if preset in presets else next(iter(presets)), scene)
                    for scene, needed in asked.items()
                    for name, presets in described["presets"].items()
                    if needed <= set(described["provides"][name])
                ]
            except ProofrollError as error:
                rows.append(AdapterRow(engine, "", preset, "", None, str(error)))
                continue
            if preset not in {own_preset for _, own_preset, _ in formulations}:
                rows.append(AdapterRow(engine, "", preset, "", None, f"no formulation has the preset {preset}"))
                continue
            try:
                bare_loop(engine)
            except Refused as error:
                rows.append(AdapterRow(engine, "", preset, "", None, str(error)))  # once, not for every variant
                continue
            for formulation, own_preset, scene in formulations:
                for variant, parameters in (VARIANTS if scene == SCENE else {scene: {}}).items():
                    if progress:
                        progress(f"{engine} {formulation} {variant}")
                    arguments = {
                        "engine": engine,
                        "options": {"formulation": formulation, "preset": own_preset},
                        "parameters": dict(parameters),
                        "rounds": rounds,
                        "seconds": seconds,
                        "scene_name": scene,
                    }
                    request = {"do": "call", "function": f"{__name__}:measure_adapter", "arguments": arguments}
                    try:
                        row = _row(worker.request(request, _LIMIT))
                    except WorkerDied as error:
                        row = {"ratio": None, "message": str(error)}
                        worker.close()
                        worker = Worker()
                    except ProofrollError as error:
                        row = {"ratio": None, "message": str(error)}
                    rows.append(AdapterRow(engine, formulation, own_preset, variant, **row))
        finally:
            worker.close()
    return rows


def _row(answer: dict[str, Any]) -> dict[str, Any]:
    if "message" in answer:
        return {"ratio": None, "message": answer["message"]}
    if "refused" in answer:
        return {"ratio": None, "message": f"refused: {answer['refused']}", "refused": True}
    facts = {key: answer[key] for key in ("distance", "tolerance", "because", "until", "lacks")}
    if "adapter" not in answer:
        apart = (
            f"the two end {answer['distance']:.2g} m apart, more than {answer['tolerance']:.2g} m: not the same model"
        )
        return facts | {"ratio": None, "message": apart}
    adapter, bare = (Timing(tuple(answer[name])) for name in ("adapter", "bare"))
    cost = ratio(adapter, bare)
    share = f"about {1 - 1 / cost.value:.0%} of its steps' time is proofroll's own {answer['lacks']}"
    return facts | {
        "ratio": cost,
        "message": share if answer["lacks"] else f"same place to {answer['distance']:.1g} m",
        "adapter": adapter.interval.value,
        "bare": bare.interval.value,
    }


def content(rows: Sequence[AdapterRow]) -> dict[str, Any]:
    """The rows as plain data: per engine the worst ratio, and all of its rows."""
    from proofroll.running.timing import machine

    engines: dict[str, Any] = {}
    for name in dict.fromkeys(row.engine for row in rows):
        own = [row for row in rows if row.engine == name]
        measured = [row for row in own if row.within_goal is not None]
        worst = max(measured, key=lambda row: row.ratio.value if row.ratio else 0.0, default=None)
        engines[name] = {
            "ratio": dataclasses.asdict(worst.ratio) if worst and worst.ratio else None,
            "worst": f"{worst.formulation}, {worst.variant}" if worst else None,
            "within_goal": all(row.within_goal for row in measured) if measured else None,
            "message": None if measured else own[0].message,
            "rows": [dataclasses.asdict(row) | {"within_goal": row.within_goal, "failed": row.failed} for row in own],
        }
    return {
        "goal": GOAL,
        "scene": SCENE,
        "mechanisms": [*MECHANISMS, *CONTACTS],
        "every": EVERY,
        "machine": machine(),
        "engines": engines,
    }
