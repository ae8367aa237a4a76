"""Runs one built engine over a time grid: the only loop over samples, and the only check for NaN."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import Columns
from proofroll.core.controlled_engine import bare
from proofroll.core.dataset import add_events, columns_of, off_grid_apart
from proofroll.core.element import Element
from proofroll.core.element_abilities import RunWatch, WatchesRuns
from proofroll.core.engine import Sample
from proofroll.core.engine_abilities import TellsRemarks
from proofroll.core.errors import Diverged, lack_behind
from proofroll.core.events import Event, wrong_bracket
from proofroll.core.multi_element import AnySample, arrays, asking, copied, events_of_engine, sample_of, watch_events
from proofroll.core.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


# Largest error of the length of a quaternion: more than single precision and drift cause.
_UNIT = 1e-3


@dataclass(frozen=True)
class Recording:
    """Recording of a run up to its end.

    Attributes:
        columns: the trajectory up to the last finite sample.
        failure: one sentence if it failed early, else None.
        ended: one sentence if it ended without a failure because its model left the scene (a ball left the wall), else
            None.
        wall_seconds: wall time inside ``advance`` [s].
        advancing: wall and processor time inside ``advance`` [s].
        sampling: wall and processor time of all the rest, mainly ``sample`` [s].
        passed: time [s] -> sample, for all times at which the engine was stopped.
        remarks: of the engine on a successful run (:class:`proofroll.core.engine_abilities.TellsRemarks`).
    """

    columns: Columns
    failure: str | None
    wall_seconds: float
    advancing: tuple[float, float] = (0.0, 0.0)
    sampling: tuple[float, float] = (0.0, 0.0)
    remarks: tuple[str, ...] = ()
    ended: str | None = None
    passed: Mapping[float, AnySample] = field(default_factory=dict)

    @property
    def dataset(self) -> xr.Dataset:
        """The trajectory as an xarray dataset."""
        return self.columns.dataset()

    def message(self, until: float) -> str:
        """One sentence: why the run ended early, or that it reached ``until`` [s], with the engine's remarks."""
        return self.failure or self.ended or "; ".join([f"reached {until:g} s", *self.remarks])


def record(
    engine: Any,
    scene: Scene,
    asked: FloatArray,
    probes: Iterable[float] = (),
    counting: Iterable[float] = (),
    *,
    wants_events: bool = True,
) -> Recording:
    """Advances a freshly built engine and samples it.

    Args:
        engine: at time 0.
        scene: source of the engine's model.
        asked: times of the samples [s].
        probes: a few times off that grid [s], from :func:`proofroll.core.time_grid.off_grid`.
        counting: further times at which turns are counted [s], from
            :func:`proofroll.core.whole_turns.samples_between`; their samples are left out of the result.
        wants_events: False if none are wanted, so that the engine need not look for them in its steps.
    """
    began, processor = time.perf_counter(), -time.process_time()
    inside = 0.0
    if wants_events:
        watch_events(engine)
    samples = [_finite(engine.sample(), 0.0, scene)]
    failure: str | None = None
    wall = 0.0
    passed: dict[float, AnySample] = {}
    between: dict[float, AnySample] = {}
    off = set(map(float, probes)) - set(asked.tolist())
    times = np.array(sorted({*asked.tolist(), *(set(map(float, counting)) - off)}))
    watches = [(element, element.watch(scene.asks)) for element in scene.elements if isinstance(element, WatchesRuns)]
    for t in sorted({*times[1:].tolist(), *off}):
        begin, start, asking_before = time.process_time(), time.perf_counter(), asking(engine)
        try:
            engine.advance(t)
            more = asking(engine)
            wall += time.perf_counter() - start - more[0] + asking_before[0]
            inside += time.process_time() - begin - more[1] + asking_before[1]
            sample = _finite(engine.sample(), t, scene)
            _require_state(scene, samples[0], sample, t)
        except Diverged as error:
            if lack_behind(error):
                raise
            failure = str(error)
            break
        passed[t] = sample
        if t in off:
            between[t] = sample
            continue
        samples.append(sample)
        if any(watch.over(sample_of(scene, element, sample)) for element, watch in watches):
            break  # the run has left the scene's model
    processor += time.process_time()
    sampling = time.perf_counter() - began - wall, processor - inside
    events, ended = _conclusions(scene, engine, watches, times, samples)
    lacking = (
        element.lacks([sample_of(scene, element, sample) for sample in samples], scene.asks)
        for element in scene.elements
    )
    wrong = (wrong_bracket(own_events) for _, own_events in events)
    failure = (None if ended else failure) or next(filter(None, (*lacking, *wrong)), None)
    reached = times[: len(samples)]
    last = reached[np.isin(reached, asked)][-1]
    taken = dict(zip(reached.tolist(), samples, strict=True)) | {
        between_time: state for between_time, state in between.items() if between_time < last
    }
    columns = columns_of(scene, np.array(sorted(taken)), [taken[between_time] for between_time in sorted(taken)])
    columns = off_grid_apart(scene, columns, asked, np.array(sorted(between)))
    for owner, own_events in events:
        columns = add_events(scene, owner, columns, own_events)
    model = bare(engine)
    remarks = tuple(model.remarks()) if isinstance(model, TellsRemarks) else ()
    return Recording(
        columns=columns,
        failure=failure,
        wall_seconds=wall,
        advancing=(wall, inside),
        sampling=sampling,
        remarks=remarks,
        ended=ended,
        passed=passed,
    )


def _conclusions(
    scene: Scene, engine: Any, watches: Sequence[tuple[Any, RunWatch]], times: FloatArray, samples: list[AnySample]
) -> tuple[list[tuple[Element, Sequence[Event]]], str | None]:
    """Events that watches found, by element, and why a watch ended the run; its samples after that are deleted."""
    events: list[tuple[Element, Sequence[Event]]] = []
    ended: str | None = None
    for element, watch in watches:
        states = [sample_of(scene, element, sample) for sample in samples]
        seen = watch.conclude(times, states, events_of_engine(engine, element))
        del samples[seen.samples :]
        if seen.events is not None:
            events.append((element, seen.events))
        ended = seen.ended or ended
    return events, ended


_NOT_FINITE = "is not finite (NaN or overflow)"


def is_nonfinite_message(message: str) -> bool:
    """True if a failure's sentence is that of a non-finite sample, which the harness noticed and not the engine."""
    return message.partition(" ")[2].startswith(_NOT_FINITE)


def _finite(sample: AnySample, t: float, scene: Scene) -> AnySample:
    for name, values in arrays(scene, sample, t):
        # Of few numbers; numpy's tests take ten times as long. The sum is finite if all are, unless it overflows.
        flat = values.ravel().tolist()
        if not math.isfinite(sum(flat)) and not np.all(np.isfinite(values)):
            raise Diverged(f"{name} {_NOT_FINITE} at {t:g} s")
        if name == "q_WB" and any(abs(math.hypot(*flat[i : i + 4]) - 1) > _UNIT for i in range(0, len(flat), 4)):
            require_unit(values, f"at {t:g} s")
    return copied(sample)


def _require_state(scene: Scene, start: AnySample, sample: AnySample, t: float) -> None:
    """Raises Diverged if a sample lacks a state variable that the first sample has."""
    for element in scene.elements:
        start_state, state = sample_of(scene, element, start), sample_of(scene, element, sample)
        for name in Sample.widths:
            if getattr(state, name) is None and getattr(start_state, name) is not None:
                raise Diverged(f"{name} is given at 0 s and not at {t:g} s")


def require_unit(q_WB: FloatArray, place: str) -> None:
    """Raises Diverged, naming the length and ``place``, unless quaternions, shape (…, 4), have unit length."""
    lengths = np.sqrt(np.sum(q_WB**2, axis=-1)).ravel()
    worst = float(lengths[np.argmax(np.abs(lengths - 1))])
    if abs(worst - 1) > _UNIT:
        raise Diverged(f"q_WB has length {worst:.4g} {place}; give unit quaternions, scalar first")
