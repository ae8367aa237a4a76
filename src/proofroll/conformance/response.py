"""Checks of an engine's motion against the scene and its truth, independent of the adapter's reports on its model."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING
from unittest import SkipTest

import numpy as np

from proofroll.conformance.subject import Subject, UnlikeSceneError, contrasts, truth_scenes
from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import first_difference
from proofroll.core.dataset import columns_of, part, scales
from proofroll.core.engine import precision_of
from proofroll.core.events import events_of
from proofroll.core.first_steps import MOST, first_steps, softness
from proofroll.core.number_format import number
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import round_off_of

if TYPE_CHECKING:
    import xarray as xr

# Length of the run [s], and its parts at which it is sampled: no multiples of common sampling intervals.
_LENGTH = 0.1
_PARTS = (2**0.5 - 1, (5**0.5 - 1) / 2, np.pi / 4, 1.0)
# The times are rounded up to multiples of this step [s], of which most engines' steps are divisors: they share a truth.
_STEP = 2e-3
# Largest tolerance, relative to the change of a variable by accelerations as at the start.
_MOST = 0.1
_SOFT = 0.01  # of it, what a softening explains that is declared for first accelerations; all of it would hide faults
# Tolerance in changes by halving the step: an error of first order is twice that, and as much again is for other terms.
_MARGIN = 4.0
_ROUND_OFF = 1e-8
# Least change of a velocity by a law, in changes by accelerations as at the start, that shows whether it acts.
_SEEN = 1e-2
# Deviation of a law's strength from 1 that softness explains: a stop of two steps rebounds by 4 %. Halvings of the step
# until what they leave of the strength is below that, and the most that they may leave.
_STRENGTH, _HALVINGS, _MOST_LEFT = 0.05, 4, 0.5
# Time before and after an event [s] between which only jumps change the state.
_MOMENT = 1e-7


def first_steps_fit_the_scene(subject: Subject) -> None:
    """Check: the initial acceleration, derived from the first steps, is the scene's.

    Skipped for contacts too soft to show it, and for motions at rest or at a switch within these steps.
    """
    subject.build()
    lines = first_steps(subject.engine, subject.scene, subject.settings)
    if not lines:
        raise SkipTest("the first steps cannot show it (soft contact, or rest); the run against the truth judges it")
    difference = first_difference([dataclasses.replace(line, tolerance=min(line.tolerance, MOST)) for line in lines])
    if difference is not None:
        raise UnlikeSceneError(subject, str(difference))


def moves_as_the_truth(subject: Subject) -> None:
    """Check: a short run has the positions, velocities and forces of the truth at all its samples."""
    step = subject.settings.dt if subject.fixed_step else None
    times = _times(step)
    true = _trajectory(subject.scene.digest, tuple(times.tolist()))
    moved = _moved(subject, times, true)
    finer = _moved(subject.finer(0.5), times, true) if step is not None else moved
    soft = min(softness(subject.build(), subject.scene), _SOFT)
    sizes = _sizes(subject.scene, times[-1], true)
    beside = _beside_events(subject.scene, step or 0.0, true)
    for name, values in moved.items():
        exact = true[name].to_numpy()[1:]
        mask = ~np.isnan(exact)  # leaves out forces that the scene does not determine
        error, change = (
            float(np.max(np.abs(values - rival)[mask], initial=0.0)) / sizes[name] for rival in (exact, finer[name])
        )
        # Round-off is relative to the value, which may be many times its change by gravity.
        size = float(np.nanmax(np.abs(exact), initial=0.0)) / sizes[name]
        rough = max(_ROUND_OFF, 10 * subject.closeness, round_off_of(precision_of(subject.settings), size))
        allowed = min(_MOST, _MARGIN * change + soft + rough + beside.get(name, 0.0) / sizes[name])
        if error > allowed or math.isnan(error):
            unit, scale = true[name].attrs["units"], sizes[name]
            raise UnlikeSceneError(
                subject,
                f"{name} is off by {number(error * scale)} {unit}, {error:.2g} of its scale in a run of "
                f"{times[-1]:.2g} s, {number(scale)} {unit}; allowed {allowed:.2g}",
            )


def law_acts(subject: Subject, without: Scene) -> None:
    """Check: a law has its strength: it changes the run by as much as it changes the truth.

    The run's velocities are fitted as those of the truth ``without`` the law and a part of the law's change of them.
    The part is 1 within what halving the step leaves; it is 0 where an engine drops the law, whatever softness it
    declares.
    """
    times = _times(subject.settings.dt if subject.fixed_step else None)
    true, other = (_trajectory(scene.digest, tuple(times.tolist())) for scene in (subject.scene, without))
    sizes = _sizes(subject.scene, times[-1], true)

    def velocities(values: Mapping[str, FloatArray]) -> FloatArray:
        return np.concatenate([np.ravel(values[name]) / sizes[name] for name in ("v_WB", "w_WB")])

    truth_with, start = (velocities({name: run[name].to_numpy()[1:] for name in sizes}) for run in (true, other))
    change = truth_with - start
    if np.abs(change).max() <= _SEEN:
        raise SkipTest("the law changes nothing within this run")

    def strength(run: Subject) -> float:
        return float((velocities(_moved(run, times, true)) - start) @ change / (change @ change))

    part, left = strength(subject), 0.0
    for halvings in range(1, _HALVINGS + 1 if subject.fixed_step else 1):
        coarse_part, part = part, strength(subject.finer(0.5**halvings))
        left = _MARGIN * abs(part - coarse_part)
        if left <= _STRENGTH:
            break
    if left > _MOST_LEFT:
        raise SkipTest("the law changes less than the engine's steps do within this run")
    if not abs(part - 1) <= _STRENGTH + left:
        words = f"the law has {part:.2f} of its strength in a run of {times[-1]:.2g} s"
        raise UnlikeSceneError(subject, f"{words}, allowed 1 ± {_STRENGTH + left:.2g}: the engine does not follow it")


def _times(step: float | None) -> FloatArray:
    """Times of the samples [s]; after whole steps, if the engine has a fixed step."""
    times = np.array([0.0, *(part * _LENGTH for part in _PARTS)])
    if step is None:
        return times
    shared = np.ceil(times / _STEP - 1e-9) * _STEP
    if np.all(np.abs(shared / step - np.round(shared / step)) < 1e-9):
        return shared
    return np.unique(np.ceil(times / step - 1e-9)) * step


def _moved(subject: Subject, times: FloatArray, true: xr.Dataset) -> dict[str, FloatArray]:
    """State and reactions of the engine at all times but the first."""
    columns = columns_of(subject.scene, times, subject.samples(times))
    moved = {name: columns[name].to_numpy()[1:] for name in _sizes(subject.scene, times[-1], true) if name in columns}
    reactions = {name for name, item in subject.scene.observables.items() if item.role == Role.REACTION}
    return {  # reactions that an engine does not report are no error
        name: values for name, values in moved.items() if name not in reactions or not np.any(np.isnan(values))
    }


def _sizes(scene: Scene, length: float, true: xr.Dataset) -> dict[str, float]:
    """Size of each compared variable: its change by the loads over the time ``length`` [s]; of a reaction its scale."""
    responses: dict[str, float] = {}
    for element in scene.elements:
        start = element.first_motion
        pull = (start.pull or start.scale) if start else element.length / element.natural_time**2
        fall = pull * length
        lengths = {"p_WB": fall * length / 2, "v_WB": fall, "w_WB": fall / element.length}
        responses |= {scene.label(element, name): size for name, size in lengths.items()}
    names = [name for name, item in scene.observables.items() if item.role == Role.REACTION and item.headline]
    sizes = scales(scene, true)
    return {name: size for name, size in (responses | {name: sizes[name] for name in names}).items() if name in true}


def _beside_events(scene: Scene, step: float, true: xr.Dataset) -> dict[str, float]:
    """Error of each variable if an event is one step [s] late, which the change by halving the step may not show.

    A position is wrong by the jump of the velocity times the step; a velocity by the jump times the angle by which the
    contact turns within the step. Empty without events or without a fixed step.
    """
    distances: dict[str, float] = {}
    for element in scene.elements:
        times_of_events = np.array(
            [event.time for event in events_of(part(scene, element, true)) if event.time > _MOMENT]
        )
        if not times_of_events.size or not step:
            continue
        around = np.unique([0.0, *(times_of_events - _MOMENT), *(times_of_events + _MOMENT)])
        values_around = part(scene, element, _trajectory(scene.digest, tuple(around.tolist())))
        early, late = (np.searchsorted(around, times_of_events + moment) for moment in (-_MOMENT, _MOMENT))
        rates = {name: values_around[name].to_numpy() for name in ("v_WB", "w_WB") if name in values_around}
        jumps = {name: float(np.max(np.abs(values[late] - values[early]))) for name, values in rates.items()}
        if "v_WB" in rates:
            turn = step * float(np.max(np.abs(rates["v_WB"]))) / element.length
            errors = {"p_WB": step * jumps["v_WB"], **{name: turn * jump for name, jump in jumps.items()}}
            distances |= {scene.label(element, name): error for name, error in errors.items()}
    return distances


@cache
def _trajectory(digest: str, times: tuple[float, ...]) -> xr.Dataset:
    """Truth of the scene with this digest at these times, cached for all engines and presets."""
    from proofroll.core.truth import truth

    scenes = [*truth_scenes().values(), *itertools.chain.from_iterable(contrasts().values())]
    return truth(next(scene for scene in scenes if scene.digest == digest), np.array(times))
