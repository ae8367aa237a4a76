"""Events of a ball on a wall: begin and end of slip, lift-off."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.element_abilities import SeenInRun
from proofroll.core.events import Event, EventKind, events_of
from proofroll.elements.ball_on_surface.mechanics import (
    always_pressed,
    natural_acceleration,
    normal_force,
)
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallSample

if TYPE_CHECKING:
    import xarray as xr

# Shortest time without pressure that counts as a flight [s]: soft and corrected contacts let a ball hop for less.
_FLIGHT = 0.01
# Normal force, relative to the natural one, that counts as round-off or a solver's tolerance.
_FAINT = 1e-6
# Relative bracket of a time below which a message gives one number, of six digits.
_TOLD = 1e-6
# Events between two states on the wall.
_SWITCHES = (EventKind.SLIP, EventKind.STICK)
# Variables that have a value only on the wall.
_ON_WALL = ("N", "F2", "F3", "needed_friction", "slip2", "slip3", "slip", "gap")

Key = TypeVar("Key", bound=Hashable)


class Watch:
    """Finds slip, and lift-off, which ends a run of a model that holds the ball on the wall.

    See :class:`proofroll.core.element_abilities.RunWatch`.
    """

    def __init__(self, body: RollingBall) -> None:
        self._body, self._leaves = body, not always_pressed(body)
        self._faint = _FAINT * body.ball.mass * natural_acceleration(body)

    def over(self, sample: BallSample) -> bool:
        """True if the wall pulls the ball, which the scene's wall cannot."""
        return self._leaves and self._press(sample) < -self._faint

    def conclude(self, times: FloatArray, samples: Sequence[BallSample], located: Sequence[Event] | None) -> SeenInRun:
        """Events of the run, number of samples that belong to the scene, and the reason if the run ends early."""
        instants, kept, ended = times.tolist(), len(samples), None
        events = list(located or ())
        left = next((event for event in events if event.kind == EventKind.LIFT_OFF), None)
        if self._leaves:
            pressed = [self._press(sample) for sample in samples]
            if left is None and (left := lift_off(instants[:kept], pressed, self._faint)) is not None:
                events.append(left)
            if pressed[-1] < -self._faint and kept > 1:
                kept -= 1
            # Not where it fails later, in flight
            if left is not None and kept < len(instants) and left.time_high >= instants[kept - 1]:
                when = f"at t = {left.time:.6g} s"
                if left.time_high - left.time_low > _TOLD * left.time_high:
                    when = f"between t = {left.time_low:.6g} s and {left.time_high:.6g} s"
                ended = f"the ball leaves the wall {when}, where this run ends: the model does not let go"
        sticking = [sample.sticking for sample in samples[:kept]]
        if any(value is None for value in sticking):
            return SeenInRun(kept, [left] if left is not None else None, ended)
        if located is None or contradicted(instants, sticking, events):
            events = [event for event in events if event.kind not in _SWITCHES]
            events = [*between_samples(instants, [bool(value) for value in sticking]), *events]
        return SeenInRun(kept, sorted(events, key=lambda event: event.time), ended)

    def _press(self, sample: BallSample) -> float:
        """Normal force N [N]; NaN where the engine gives no force."""
        if sample.force is None:
            return math.nan
        return float(normal_force(self._body, np.reshape(sample.p_WB, 3), np.reshape(sample.force, 3)))


def contradicted(times: Sequence[float], sticking: Sequence[bool | None], events: Sequence[Event]) -> bool:
    """True if samples stick where the events imply slip, or the reverse.

    Samples inside an event's bracket, and samples after the ball leaves the wall, are not compared.
    """
    switches = [event for event in events if event.kind in _SWITCHES]
    until = min((event.time_low for event in events if event.kind not in _SWITCHES), default=math.inf)
    for t, sticks in zip(times, sticking, strict=False):
        if any(event.time_low <= t <= event.time_high for event in switches):
            continue
        earlier, later = [e for e in switches if e.time_high < t], [e for e in switches if e.time_low > t]
        expected = (
            earlier[-1].kind == EventKind.STICK
            if earlier
            else later[0].kind == EventKind.SLIP
            if later
            else sticking[0]
        )
        if t < until and bool(sticks) != expected:
            return True
    return False


def between_samples(times: Sequence[float], sticking: Sequence[bool]) -> list[Event]:
    """Slip and stick events between consecutive samples [s] that differ in sticking."""
    return [
        Event(EventKind.STICK if sticks else EventKind.SLIP, 0.5 * (low + high), low, high)
        for stuck, sticks, low, high in zip(sticking, sticking[1:], times, times[1:], strict=False)
        if stuck != sticks
    ]


def lift_off(times: Sequence[float], N: Sequence[float], faint: float) -> Event | None:
    """Lift-off of the ball between two samples; None: it stays on the wall.

    The ball has left where the wall would have to pull, or where it does not press for a hundredth of a second.

    Args:
        times: of the samples [s].
        N: normal force there [N]; that at time 0, which several engines do not know, is ignored.
        faint: normal force that counts as round-off [N].
    """
    pressed = 0
    for index in range(1, len(times)):
        if not N[index] <= faint:  # also where it is NaN
            pressed = index
        elif N[index] < -faint or times[index] - times[pressed + 1] >= _FLIGHT * (1 - 1e-9):
            low, high = times[pressed], times[pressed + 1]
            last_force, next_force = N[pressed], N[pressed + 1]
            part = last_force / (last_force - next_force) if next_force < 0 < last_force else 0.5
            return Event(EventKind.LIFT_OFF, low + part * (high - low), low, high)
    return None


def lift_off_time(dataset: xr.Dataset) -> float:
    """Time at which the ball first leaves the wall [s]; inf: it does not."""
    return min((event.time for event in events_of(dataset) if event.kind == EventKind.LIFT_OFF), default=math.inf)


def common_span(truth: xr.Dataset, runs: Mapping[Key, xr.Dataset]) -> tuple[xr.Dataset, dict[Key, xr.Dataset]]:
    """Truth and runs cut to the samples of the shortest run; variables of the wall set to 0 from the first lift-off on.

    A lift-off earlier than two samples before the true one does not count there: it would hide forces.
    A model that holds the ball on the wall ends its run where the ball leaves it. This is right if the truth's ball
    leaves the wall too, at most one sample later. A run that ends earlier is not cut to, and differs.
    """
    leaves, true = lift_off_time(truth), truth["time"].to_numpy()
    if not np.isfinite(leaves):
        return truth, dict(runs)
    fewest = int(np.searchsorted(true, leaves)) - 1  # samples on the wall, less one
    count = min([len(true), *(run.sizes["time"] for run in runs.values() if run.sizes["time"] >= fewest)])
    earliest = float(true[max(fewest - 1, 0)])
    until = max(min([leaves, *(lift_off_time(run) for run in runs.values())]), earliest)

    def cut(dataset: xr.Dataset) -> xr.Dataset:
        short = dataset.isel(time=slice(count))
        prefixes = (("time", ""), ("between", "between."))
        there = [(start + name, axis) for axis, start in prefixes for name in _ON_WALL if start + name in short]
        on_wall = {
            name: short[name].where(short[axis] < until, 0.0).assign_attrs(short[name].attrs) for name, axis in there
        }
        return short.assign(on_wall)

    return cut(truth), {key: cut(run) for key, run in runs.items()}
