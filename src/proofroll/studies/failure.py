"""What went wrong in a run, by its trajectory, and whether the engine said so: every threshold with its reason."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Self

import numpy as np

from proofroll.case import Result, Status
from proofroll.events import events_of
from proofroll.recording import noticed
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray

if TYPE_CHECKING:
    import xarray as xr

# Accurate: the last coordinate (the height in a cylinder) is off by at most this part of its range.
ACCURATE = 0.01
# Stable: by at most the whole range. Beyond, even a curve that stays at its start would be better.
WRONG = 1.0
# Part of the radius, or of the path's radius of curvature if that is less, by which a ball may be off its wall. The
# lever of friction and the curvature of the path are then wrong by as much, so nothing accurate is left.
OFF_SURFACE = 0.1
# Part of the largest kinetic energy by which the energy may grow. Nothing in a scene drives the ball, so all of it is
# the engine's; runs that hold 1 % of the path stay far below.
GAIN = 0.1
# Part of the initial speed with which a ball may move against the way that it last had, where rolling resistance has
# to bring it to rest: a fixed step that ends beyond rest leaves the ball some speed, which is no motion yet.
BACKWARDS = 0.01
# A path is wrong because of slip where the way slipped while rolling makes up this part of the error or more.
SLIPPED = 0.5


class Failure(StrEnum):
    """Kinds of failure; the value is what a person reads."""

    DIVERGED = "diverged"
    ENERGY_GAIN = "energy gain"
    LEFT = "left the surface"
    SANK = "sank in"
    CREEP = "creep"
    REVERSED = "reversed"
    LOST_PHASE = "lost phase"
    GAVE_UP = "solver gave up"
    CRASHED = "crashed"
    TOO_SLOW = "too slow"
    REFUSED = "refused"


MEANINGS = {
    Failure.DIVERGED: "the state became NaN or overflowed",
    Failure.ENERGY_GAIN: f"the energy grew by more than {GAIN:.0%} of the largest kinetic energy",
    Failure.LEFT: f"the ball came off the wall by more than {OFF_SURFACE:.0%} of its radius",
    Failure.SANK: f"the ball sank into the wall by more than {OFF_SURFACE:.0%} of its radius",
    Failure.CREEP: f"the ball slipped while it should roll, which makes {SLIPPED:.0%} of the error or more",
    Failure.REVERSED: f"rolling resistance drove the ball back, by more than {BACKWARDS:.0%} of the initial speed",
    Failure.LOST_PHASE: "bounded, on the surface and without gain of energy, but wrong",
    Failure.GAVE_UP: "the engine stopped and said why",
    Failure.CRASHED: "the engine's process ended",
    Failure.TOO_SLOW: "no result within the time that the map allows",
    Failure.REFUSED: "the engine, or the check of what it built, refused before the run",
}


@dataclass(frozen=True)
class Outcome:
    """What a run gave.

    Attributes:
        stable: it reached the end, on the surface, without gain of energy, and was not wrong by the whole range.
        accurate: and the last coordinate held 1 % of its range; where there is no truth the same as stable.
        failure: what went wrong first, if it was not accurate.
        silent: it failed, and the engine did not say so.
        error: largest error of the last coordinate in parts of its range; None if it is not known.
        time: when the failure showed [s].
        message: how the run ended.
    """

    stable: bool
    accurate: bool
    failure: Failure | None
    silent: bool
    error: float | None
    time: float | None
    message: str


@dataclass(frozen=True)
class Yardstick:
    """What a run is measured by.

    Attributes:
        body: the scene's.
        times: of the samples [s].
        coordinate: name of the last coordinate of the surface.
        true: its values; None where there is no truth.
        scale: its range.
        kinetic: largest kinetic energy [J].
        fastest: largest angular velocity [rad/s]; None where there is no truth.
        off_surface: allowed distance from the wall, and depth in it [m].
        heading: direction of the true velocity, or of the last one where the ball rests, at each sample, shape (n, 3);
            None where nothing resists rolling, or there is no truth.
        rolls: where the true ball does not slip, at each sample; None where it never does, or there is no truth.
    """

    body: RollingBall
    times: FloatArray
    coordinate: str
    true: FloatArray | None
    scale: float
    kinetic: float
    fastest: float | None
    off_surface: float
    heading: FloatArray | None = None
    rolls: FloatArray | None = None

    @classmethod
    def of(cls, body: RollingBall, times: FloatArray, truth: xr.Dataset | None) -> Self:
        """From the truth, or, where there is none, from the start alone."""
        ball, name = body.ball, body.surface.coordinates[-1]
        bend = float(np.linalg.norm(body.surface.normal_gradient(body.p0), 2))
        length = min(ball.radius, 1 / bend) if bend else ball.radius
        kinetic = 0.5 * ball.mass * float(body.v0 @ body.v0) + 0.5 * ball.inertia * float(body.w0 @ body.w0)
        true, scale, fastest, heading, rolls = None, 1.0, None, None, None
        if truth is not None:
            true = truth[name].to_numpy()
            scale = float(np.ptp(true)) or 1.0
            v, w = truth["v_WB"].to_numpy(), truth["w_WB"].to_numpy()
            fastest = float(np.max(np.linalg.norm(w, axis=-1)))
            kinetic = max(
                kinetic, float(np.max(0.5 * ball.mass * (v**2).sum(-1) + 0.5 * ball.inertia * (w**2).sum(-1)))
            )
            heading = _heading(v) if body.contact.rolling_resistance > 0 else None
            rolls = truth["sticking"].to_numpy() if "sticking" in truth else None
        return cls(body, times, name, true, scale, kinetic, fastest, OFF_SURFACE * length, heading, rolls)


def _heading(v: FloatArray) -> FloatArray:
    """Directions of velocities, shape (n, 3); where one is below the threshold, that before it."""
    speeds = np.linalg.norm(v, axis=-1)
    moves = speeds > BACKWARDS * speeds[0]
    last = np.maximum.accumulate(np.where(moves, np.arange(len(v)), 0))
    return np.asarray(v[last] / np.where(speeds[last] > 0, speeds[last], 1.0)[:, None])


def judge(result: Result, dataset: xr.Dataset | None, yardstick: Yardstick) -> Outcome:
    """What a run gave, held against the yardstick.

    Args:
        result: how it ended.
        dataset: its trajectory as far as it went, if there is one.
        yardstick: of its place.
    """
    early = {Status.CRASHED: Failure.CRASHED, Status.TIMEOUT: Failure.TOO_SLOW, Status.REFUSED: Failure.REFUSED}
    if result.status in early or dataset is None:
        return _failed(early.get(result.status, Failure.GAVE_UP), result, None, None)
    errors = _errors(dataset, yardstick)
    error = None if errors is None else float(np.max(errors, initial=0.0))
    first = _first(dataset, yardstick, errors)
    if result.status == Status.DIVERGED:
        failure, time = first or (None, None)
        if noticed(result.message) or (failure is None and "finite" in result.message):
            failure, time = Failure.DIVERGED, float(dataset["time"][-1])
        elif failure is None:
            lifted = any(event.kind == "lift_off" for event in events_of(dataset))
            failure, time = (Failure.LEFT if lifted else Failure.GAVE_UP), float(dataset["time"][-1])
        return _failed(failure, result, error, time, silent=noticed(result.message))
    if first is not None:
        return _failed(first[0], result, error, first[1], silent=True)
    if errors is not None and yardstick.true is not None and len(errors) < len(yardstick.true):
        # Its model ended the run where the ball would leave the wall.
        return _failed(Failure.LEFT, result, error, float(dataset["time"][-1]))
    if errors is None or error is None or error <= ACCURATE:
        return Outcome(True, True, None, False, error, None, result.message)
    index = int(np.argmax(errors > ACCURATE))
    return Outcome(True, False, _wrong(dataset, yardstick, errors, index), True, error, None, result.message)


def _failed(
    failure: Failure, result: Result, error: float | None, time: float | None, *, silent: bool = False
) -> Outcome:
    return Outcome(False, False, failure, silent, error, time, result.message)


def _errors(dataset: xr.Dataset, yardstick: Yardstick) -> FloatArray | None:
    """Of the last coordinate at each sample, in parts of its range."""
    if yardstick.true is None:
        return None
    values = dataset[yardstick.coordinate].to_numpy()
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.abs(values - yardstick.true[: len(values)]) / yardstick.scale
    return np.where(np.isfinite(errors), errors, np.inf)


def _first(dataset: xr.Dataset, yardstick: Yardstick, errors: FloatArray | None) -> tuple[Failure, float] | None:
    """What makes the run unstable first, and when [s]; None: it is stable as far as it went."""
    times, gap, energy = (dataset[name].to_numpy() for name in ("time", "gap", "energy"))
    with np.errstate(over="ignore", invalid="ignore"):
        signs = {
            Failure.LEFT: gap > yardstick.off_surface,
            Failure.SANK: gap < -yardstick.off_surface,
            Failure.ENERGY_GAIN: energy - energy[0] > GAIN * yardstick.kinetic,
        }
    if yardstick.heading is not None:
        v = dataset["v_WB"].to_numpy()
        along = np.sum(v * yardstick.heading[: len(v)], axis=-1)
        signs[Failure.REVERSED] = along < -BACKWARDS * float(np.linalg.norm(yardstick.body.v0))
    shown = {failure: int(np.argmax(sign)) for failure, sign in signs.items() if np.any(sign)}
    if errors is not None and np.any(errors > WRONG):
        index = int(np.argmax(errors > WRONG))
        if not shown or index < min(shown.values()):
            return _wrong(dataset, yardstick, errors, index), float(times[index])
    if not shown:
        return None
    failure = min(shown, key=lambda item: shown[item])
    return failure, float(times[shown[failure]])


def _wrong(dataset: xr.Dataset, yardstick: Yardstick, errors: FloatArray, index: int) -> Failure:
    """Why a bounded path on the surface is wrong at a sample: by slip, or by anything else."""
    times = dataset["time"].to_numpy()[: index + 1]
    slip = np.hypot(dataset["slip2"].to_numpy(), dataset["slip3"].to_numpy())[: index + 1]
    rolls = np.ones(len(times), dtype=bool)
    if "sticking" in dataset:
        rolls = dataset["sticking"].to_numpy().astype(bool)[: index + 1]
    both = rolls[1:] & rolls[:-1]
    slipped = float(np.sum(both * np.diff(times) * (slip[1:] + slip[:-1]) / 2))
    metres = float(errors[index]) * yardstick.scale * yardstick.body.surface.length_scales[-1]
    return Failure.CREEP if slipped >= SLIPPED * metres else Failure.LOST_PHASE
