"""Runs one built engine over a time grid: the only loop over samples, and the place where NaN is noticed."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.engine import LocatesEvents, Sample, TellsRemarks
from proofroll.errors import Diverged, InputError
from proofroll.events import Event, between_samples, lift_off, with_events
from proofroll.mechanics import always_pressed, natural_acceleration, normal_force
from proofroll.scene import Capability, RollingBall, Scene
from proofroll.surfaces import FloatArray
from proofroll.trajectory import from_samples

if TYPE_CHECKING:
    import xarray as xr


def time_grid(until: float, every: float) -> FloatArray:
    """Sample times 0, every, 2 every, … and ``until`` [s].

    Raises:
        InputError: ``until`` is negative, or ``every`` is not positive.
    """
    if not np.isfinite(until) or until < 0:
        raise InputError("until", until, "give a finite time in s that is not negative")
    if not np.isfinite(every) or every <= 0:
        raise InputError("every", every, "give a positive, finite interval in s")
    if until / every > 1e7:
        raise InputError("every", every, f"that is more than ten million samples until {until:g} s; sample less often")
    count = int(np.floor(until / every * (1 + 1e-12) + 1e-9))
    times = np.arange(count + 1, dtype=np.float64) * every
    if until - times[-1] > 1e-9 * max(every, until):
        times = np.append(times, until)
    else:
        times[-1] = until
    return np.asarray(times, dtype=np.float64)


@dataclass(frozen=True)
class Recording:
    """What a run gave before it ended.

    Attributes:
        dataset: the trajectory up to the last finite sample.
        failure: one sentence if it failed early, else None.
        ended: one sentence if it ended where the ball leaves the wall, for the model holds the ball there, else None.
        wall_seconds: spent inside ``advance`` [s].
        advancing, sampling: spent inside ``advance``, and inside ``sample`` and around it: wall and processor seconds
            [s].
        remarks: what the engine says about a run that went well (:class:`proofroll.engine.TellsRemarks`).
    """

    dataset: xr.Dataset
    failure: str | None
    wall_seconds: float
    advancing: tuple[float, float] = (0.0, 0.0)
    sampling: tuple[float, float] = (0.0, 0.0)
    remarks: tuple[str, ...] = ()
    ended: str | None = None

    def message(self, until: float) -> str:
        """One sentence: why it ended early, or that it reached ``until`` [s] and what is to be said about that."""
        return self.failure or self.ended or "; ".join([f"reached {until:g} s", *self.remarks])


def record(engine: Any, scene: Scene, times: FloatArray) -> Recording:
    """Advances a freshly built engine over ``times`` and samples it at each."""
    began, processor = time.perf_counter(), -time.process_time()
    inside = 0.0
    samples = [_finite(engine.sample(), 0.0)]
    failure: str | None = None
    wall = 0.0
    body = scene.rolling
    leaves, faint = not always_pressed(body), _FAINT * body.ball.mass * natural_acceleration(body)
    for t in times[1:]:
        before, start = time.process_time(), time.perf_counter()
        try:
            engine.advance(float(t))
            wall += time.perf_counter() - start
            inside += time.process_time() - before
            samples.append(_finite(engine.sample(), float(t)))
        except Diverged as error:
            failure = str(error)
            break
        if leaves and _normal_force(body, samples[-1]) < -faint:
            break  # a wall that pulls: from here on the model is another one than the scene
    processor += time.process_time()
    sampling = time.perf_counter() - began - wall, processor - inside
    events = list(engine.events()) if isinstance(engine, LocatesEvents) else []
    left: Event | None = next((event for event in events if event.kind == "lift_off"), None)
    ended = None
    if leaves:
        pressed = [_normal_force(body, sample) for sample in samples]
        if left is None and (left := lift_off(times.tolist()[: len(samples)], pressed, faint)) is not None:
            events.append(left)
        if pressed[-1] < -faint and len(samples) > 1:
            del samples[-1]
        # Not where it fails later, in flight
        if left is not None and len(samples) < len(times) and left.time_high >= times[len(samples) - 1]:
            ended = f"the ball leaves the wall at t = {left.time:.6g} s, where this run ends: the model does not let go"
            failure = None
    if Capability.BOUNDED_FRICTION in scene.requires and any(sample.sticking is None for sample in samples):
        failure = failure or "the engine does not say whether the ball sticks or slips"
    if Capability.ORIENTATION in scene.requires and any(sample.q_WB is None for sample in samples):
        failure = failure or "the engine does not give the ball's orientation"
    dataset = from_samples(scene, times, samples)
    if "sticking" in dataset:
        sticking = [bool(sample.sticking) for sample in samples]
        found = events if isinstance(engine, LocatesEvents) else [*between_samples(times.tolist(), sticking), *events]
        dataset = with_events(dataset, sorted(found, key=lambda event: event.time))
    elif leaves and left is not None:
        dataset = with_events(dataset, [left])
    remarks = tuple(engine.remarks()) if isinstance(engine, TellsRemarks) else ()
    return Recording(dataset, failure, wall, (wall, inside), sampling, remarks, ended)


def _normal_force(body: RollingBall, sample: Sample) -> float:
    """N [N]; NaN where the engine gives no force."""
    return math.nan if sample.force is None else float(normal_force(body, sample.p_WB, sample.force))


# Normal force, relative to the natural one, that is round-off or what a solver's tolerance leaves.
_FAINT = 1e-6
_SAMPLED = ("p_WB", "v_WB", "w_WB", "q_WB", "force")
_NOT_FINITE = "is not finite (NaN or overflow)"


def noticed(message: str) -> bool:
    """Whether a failure's sentence says that a sample was not finite: noticed here, not said by the engine."""
    return any(message.startswith(f"{name} {_NOT_FINITE}") for name in _SAMPLED)


def _finite(sample: Sample, t: float) -> Sample:
    for name in _SAMPLED:
        values = getattr(sample, name)
        if values is None:
            continue
        values = np.asarray(values)
        shape = (4,) if name == "q_WB" else (3,)
        if np.shape(values) != shape:
            raise Diverged(f"the engine gave {name} with shape {np.shape(values)} instead of {shape} at {t:g} s")
        # The sum of finite numbers is finite but for overflow; numpy's own question takes ten times as long.
        if not math.isfinite(sum(values.tolist())) and not np.all(np.isfinite(values)):
            raise Diverged(f"{name} {_NOT_FINITE} at {t:g} s")
    return sample
