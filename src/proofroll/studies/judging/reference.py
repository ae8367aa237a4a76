"""Truth of one scene, with all data that trajectories of engines are compared with, and whether anything happens."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import FloatArray, Vectors, magnitudes
from proofroll.core.columns import SAMPLED_BAR
from proofroll.core.dataset import (
    BORDERS,
    BY_STEPS,
    CONTINUOUS,
    LEFT_OUT,
    Key,
    bar_until,
    before_end,
    common_span,
    end_of_truth,
    ended_early,
    observe,
    part,
    scales,
)
from proofroll.core.element_abilities import KnowsAnotherScene
from proofroll.core.events import EVENT_ORDER, JUMPS, Event, EventKind, events_of
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.verdict import TrueCurve

if TYPE_CHECKING:
    import xarray as xr


OWN_STEPS = "its steps are the reference, which is no judge of itself"  # of the formulation of a reference by steps
# Samples on each side of an event through which a parabola is laid.
_SIDE = 3


def beside_events(times: FloatArray, curve: FloatArray, events: Sequence[float], late: float) -> float:
    """Largest error of a curve if each of its events is late by a given time.

    At an event a curve jumps in value, slope or curvature (position, velocity, force where friction switches). A sample
    between the true event and the late one is wrong by the jump of the value. Later samples are wrong by what the jumps
    of slope and curvature make of the delay.

    Args:
        times: times of the curve [s], shape (time,).
        curve: values, shape (time, …).
        events: times of the events [s].
        late: largest delay of an event [s].
    """
    error = 0.0
    for event in events:
        index = int(np.searchsorted(times, event))
        sides = slice(max(index - _SIDE, 0), index), slice(index, index + _SIDE)
        if min(len(times[side]) for side in sides) < _SIDE:
            continue
        earlier_part, later_part = (_taylor(times[side] - event, curve[side]) for side in sides)
        value, slope, bend = np.max(np.abs(later_part - earlier_part), axis=1)
        error += late * float(slope + bend * (times[-1] - event))
        if np.any(np.abs(times - event) <= late):
            error += float(value)
    return error


def _taylor(t: FloatArray, values: FloatArray) -> FloatArray:
    """Value, slope and curvature at t = 0 of the parabola through three samples, shape (3, components)."""
    made = np.linalg.solve(t[:, None] ** np.arange(_SIDE), values.reshape(_SIDE, -1))
    return np.asarray(made * [[1.0], [1.0], [2.0]])


# At which other forces that have no value beside impacts jump, too; those of contacts are judged there.
_REVERSES = frozenset({EventKind.SLIP, EventKind.STICK, EventKind.REST, EventKind.TURN})
_PARTED = 0.1  # part of their largest difference at which two runs have parted
_ROUNDED = 1e-9  # part of a distance in time that is round-off


@dataclass(frozen=True)
class Reference:
    """The truth with its observables.

    Attributes:
        scene: with the parameters of the truth.
        dataset: the true trajectory.
        curves: observable -> its true values; of a force that is not determinate all the time, zero where it is not.
        sizes: observable -> its scale.
        determinate: observable -> where the truth has a value; only those that lack some.
        distance: from events, at which forces jump, within which no force is judged [s].
    """

    scene: Scene
    dataset: xr.Dataset
    curves: dict[str, FloatArray]
    sizes: dict[str, float]
    determinate: dict[str, NDArray[np.bool_]] = field(default_factory=dict)
    distance: float = 0.0

    @classmethod
    def of(cls, scene: Scene, dataset: xr.Dataset, distance: float = 0.0) -> Self:
        """Reference from a true trajectory."""
        dataset = before_end(scene, dataset)
        curves, determinate = _true_curves(scene, dataset)
        return cls(scene, dataset, curves, scales(scene, dataset), determinate, distance)

    def common_span(self, trajectories: Mapping[Key, xr.Dataset]) -> tuple[Reference, dict[Key, xr.Dataset]]:
        """Truth and runs cut to the time in which they are comparable (:class:`WatchesRuns`)."""
        truth, runs = common_span(self.scene, self.dataset, trajectories)
        if truth is self.dataset:
            return self, runs
        curves, determinate = _true_curves(self.scene, truth)
        return replace(self, dataset=truth, curves=curves, determinate=determinate), runs

    def another_scene(self, lines: Sequence[Mapping[str, Any]]) -> str | None:
        """Reason why a model with this certificate represents another kind of scene than the one asked for; or None."""
        for element in self.scene.elements:
            if isinstance(element, KnowsAnotherScene):
                why = element.another_scene(lines, part(self.scene, element, self.dataset))
                if why is not None:
                    return why
        return None

    @property
    def ill_posed(self) -> str:
        """Reason why changes of the parameters below their accuracy change the motion; empty: they do not."""
        return str(self.dataset.attrs.get("ill_posed", ""))

    @property
    def by_steps(self) -> str:
        """Engine and formulation, as a setting, whose finer and finer steps lead to this; empty: it is a truth."""
        return str(self.dataset.attrs.get(BY_STEPS, ""))

    def tells(self, name: str, tolerance: float) -> bool:
        """True if the error bar of an observable is within a tolerance, in its unit."""
        if name not in self.curves:
            return False
        return self.true(name, self.curves[name]).error_bar <= tolerance

    def determines(self, name: str) -> bool:
        """False if the error bar of an observable is infinite, or the equations do not determine it all the time."""
        return bool(np.isfinite(self._known(name, self.curves.get(name, np.zeros(0)))[1]))

    def bar_until(self, name: str, time: float) -> float:
        """Error bar of a variable up to a time [s], in its unit."""
        return bar_until(self.dataset.variables[name].attrs, time)

    @property
    def ended(self) -> str:
        """Clause on the time and reason of an early end of the truth, behind which nothing is judged; or empty."""
        end, word = ended_early(self.dataset), "reference" if self.by_steps else "truth"
        return f"{end_of_truth(end[0]).replace('truth', word)}: {end[1]}" if end else ""

    @property
    def untouched(self) -> bool:
        """True if bodies may touch and none does: no event, and no force of a contact."""
        return untouched(self.scene, self.dataset.variables, self.events)

    @property
    def quiet(self) -> str:
        """Sentence on a truth in which nothing moves, or nothing touches; empty: something does."""
        return quiet(self.scene, self.dataset.variables, self.events)

    def shared(self, routes: Collection[str]) -> str:
        """Sentence about a route of the truth that is among ``routes``, and its check; empty if none is."""
        # of further elements, and of an orientation, behind a semicolon
        names = {key: str(self.dataset.attrs.get(key, "")).partition(";")[0] for key in ("route", "second_route")}
        keys = [key for key, name in names.items() if re.split(r"[,(]", name)[0].strip() in routes]
        if not keys:
            return ""
        others = [name for key, name in names.items() if key not in keys]
        checked = f"only {others[0]} checks both" if others else "nothing checks both"
        return f"rests on the same equations as the truth itself ({names[keys[0]]}): {checked}"

    def ill_posed_for(self, name: str) -> str:
        """Reason why the question for an observable is ill-posed, for every run alike; empty: it is not.

        Laws that hold for any motion, as residuals do, stay judged.
        """
        return self.ill_posed if self.scene.observables[name].hangs_on_events else ""

    def scale(self, name: str) -> float | None:
        """Size to which a percentage of an observable refers: its scale, or an event's first time; None: unknown."""
        if self.scene.observables[name].role == Role.EVENT and name in self.curves:
            return next((float(time) for time in self.curves[name]), None)
        return self.sizes.get(name)

    def true(self, name: str, values: FloatArray) -> TrueCurve:
        """True curve of an observable, of infinite error bar if there are no values; ``values`` are an engine's."""
        curve, bar = self._known(name, values)
        curve, source = self._on_either_side(name, curve, values), "reference" if self.by_steps else "truth"
        return TrueCurve(curve, bar, self.ill_posed_for(name), source)

    def _on_either_side(self, name: str, curve: FloatArray, values: FloatArray) -> FloatArray:
        """True curve with a run's own values at samples on an impact, where what jumps has a value on each side.

        Of forces it has them at all samples that are not judged.
        """
        item = self.scene.observables[name]
        if item.role == Role.REACTION and self.distance and curve.shape[1:] == values.shape[1:]:
            count = min(len(curve), len(values))
            times = self.dataset.variables["time"].values
            beside = np.flatnonzero(self.beside_changes(times[len(times) - len(curve) :])[:count])
            curve = curve.copy()
            curve[beside] = values[beside]
        if item.role == Role.EVENT or item.unit in CONTINUOUS or len(curve) != len(values):
            return curve
        jumps = [event for event in self.events if event.kind in JUMPS]
        if not jumps or len(times := self.dataset.variables["time"].values[1:]) != len(curve):
            return curve
        low, high = (np.array([getattr(event, end) for event in jumps]) for end in ("time_low", "time_high"))
        on = ((low <= times[:, None]) & (times[:, None] <= high)).any(axis=1)
        return curve if on.all() else np.where(on.reshape(-1, *[1] * (curve.ndim - 1)), values, curve)

    def _known(self, name: str, values: FloatArray) -> tuple[FloatArray, float]:
        """True values of an observable and their error bar."""
        item = self.scene.observables[name]
        if item.name == EVENT_ORDER and not self.by_steps:
            return np.zeros(1), 0.0
        if item.role == Role.EVENT and self.by_steps:  # no two steps have the same touches and slips
            return np.full_like(values, np.nan), np.inf
        if item.role == Role.EVENT:
            times = self.curves.get(name, np.zeros(0))  # of a scene without events there are none
            return times, max((event.time_high - event.time_low for event in self.events), default=0.0)
        curve = self.curves.get(name)
        if curve is None:  # for example a force that the equations do not determine all the time
            return np.full_like(values, np.nan), np.inf
        if item.role != Role.RESIDUAL:
            return curve, self.bar_until(name, float(self.dataset.variables["time"].values[-1]))
        # Zero for a perfect run; the residual of the truth is the resolution of the measurement.
        return np.zeros_like(values), float(np.max(np.abs(curve), initial=0.0))

    def magnitude(self, name: str) -> float:
        """Size of the numbers whose round-off an observable has.

        These are its own values, and those of the larger variable if it is a small difference of one.
        """
        numbers = [self.curves.get(name, np.zeros(0))]
        for element in self.scene.elements:
            for item in element.observables:
                if item.difference_of and self.scene.label(element, item.name) == name:
                    numbers.append(part(self.scene, element, self.dataset)[item.difference_of].to_numpy())
        return max(self.scale(name) or 0.0, *(float(np.max(np.abs(values), initial=0.0)) for values in numbers))

    def vectors(self, name: str) -> Vectors:
        """Number of the vector of each component of a variable; None: its components are on their own."""
        item, variables = self.scene.observables.get(name), self.dataset.variables
        if item is not None and item.vectors:
            return item.vectors
        if name not in variables or variables[name].dims[-1:] not in {("xyz",), ("wxyz",)}:
            return None
        shape = variables[name].shape[1:]
        return tuple(np.repeat(np.arange(math.prod(shape[:-1])), shape[-1]).tolist())

    def own_bar(self, name: str, dataset: xr.Dataset) -> float:
        """Error bar of a run's events, half the width of the widest bracket, or of a sum over its samples; else 0."""
        item = self.scene.observables[name]
        if item.sums_samples and name in dataset.variables:
            return float(dataset.variables[name].attrs.get(SAMPLED_BAR, 0.0))
        if item.role != Role.EVENT or item.name == EVENT_ORDER:
            return 0.0
        widths = [event.time_high - event.time_low for event in self.events_of(dataset)]
        return max([*widths, float(dataset.attrs.get(LEFT_OUT, 0.0))]) / 2

    def beside(self, name: str, values: FloatArray, dataset: xr.Dataset, step: float | None) -> float:
        """Error of an observable of a run whose events are a step late or early .

        Args:
            name: of the observable.
            values: of the run.
            dataset: the run; if it reports no events, those of the truth are used, and the jumps of the true values.
            step: fixed step [s]; None: it adapts, and steps end at samples.
        """
        role, curve = self.scene.observables[name].role, self.curves.get(name)
        if role == Role.EVENT:
            return 2 * self.own_bar(name, dataset)
        times = self.dataset["time"].to_numpy()
        times = times[len(times) - len(values) :] if len(values) <= len(times) else times
        if len(times) != len(values):
            return 0.0  # the values are no function of the sample times
        reported = any("event_kind" in part(self.scene, item, dataset) for item in self.scene.elements)
        events = self.events_of(dataset) if reported else self.events
        if curve is not None and not reported and role != Role.RESIDUAL and curve.shape == values.shape:
            # a run's own samples beside a true event may lie on its other side
            values = np.where(np.isfinite(curve), curve, values)
        widest = max((event.time_high - event.time_low for event in events), default=0.0)
        late = min(widest if reported else 2 * self.sampled_bar, step or np.inf)
        return beside_events(times, values, [event.time for event in events], late)

    def unsettled(self, name: str, change: FloatArray) -> str:
        """Clause on the event behind which an observable of two runs first differs; empty: there is none.

        Args:
            name: of the observable.
            change: difference of the runs.
        """
        times = self.dataset["time"].to_numpy()
        if self.scene.observables[name].role == Role.EVENT or not 0 < len(change) <= len(times):
            return ""
        apart = magnitudes(change, self.vectors(name)).max(axis=1, initial=0.0)
        parted = times[len(times) - len(change) :][int(np.argmax(apart > _PARTED * apart.max()))]
        earlier = [event for event in self.events if event.time <= parted]
        return f"after the {earlier[-1].kind.replace('_', '-')} at {earlier[-1].time:.4g} s" if earlier else ""

    @cached_property
    def sampled_bar(self) -> float:
        """Error bar of an event that is located by samples only [s]: half the longest sampling interval."""
        return float(np.max(np.diff(self.dataset.variables["time"].values), initial=0.0)) / 2

    @cached_property
    def changes(self) -> FloatArray:
        """Times at which forces may jump [s]: of the true events, and of all other changes of what acts."""
        borders = np.atleast_1d(self.dataset.attrs.get(BORDERS, np.zeros(0)))
        return np.unique([*(event.time for event in self.events), *borders])

    @property
    def events(self) -> list[Event]:
        """True events of all elements."""
        return self.events_of(self.dataset)

    def beside_changes(self, times: FloatArray) -> NDArray[np.bool_]:
        """True at times [s] so near to one of the :attr:`changes` that no force is judged, shape (time,)."""
        return np.asarray((np.abs(times[:, None] - self.changes) < (1 - _ROUNDED) * self.distance).any(axis=1))

    def events_of(self, dataset: xr.Dataset) -> list[Event]:
        """Events of all elements in a run."""
        return [event for item in self.scene.elements for event in events_of(part(self.scene, item, dataset))]


def _true_curves(scene: Scene, dataset: xr.Dataset) -> tuple[dict[str, FloatArray], dict[str, NDArray[np.bool_]]]:
    """``curves`` and ``determinate`` of a :class:`Reference`."""
    curves, determinate = observe(scene, dataset), {}
    for name, item in scene.observables.items():
        if (
            item.role is not Role.REACTION
            or name not in dataset.variables
            or (name in curves and item.at_impacts and not item.sums_samples)
        ):
            continue
        values = dataset.variables[name].values[1:]
        mask = np.isfinite(values)
        if not item.at_impacts:
            jumps = JUMPS if item.of_contacts else JUMPS | _REVERSES
            mask[_unsteady(scene, dataset, jumps)[1:]] = False
        if item.sums_samples:
            mask[_behind_impacts(scene, dataset)[1:]] = False
        if mask.all():
            continue
        curve = np.where(mask, values, 0.0)
        if curve.any() or (mask.any() and np.isfinite(values).all()):  # zeros beside unknown loads tell nothing
            curves[name], determinate[name] = curve, mask
        else:
            curves.pop(name, None)
    return curves, determinate


def _behind_impacts(scene: Scene, dataset: xr.Dataset) -> NDArray[np.bool_]:
    """Samples behind the first impact, shape (time,)."""
    happened = [event for element in scene.elements for event in events_of(part(scene, element, dataset))]
    impact = min((event.time_low for event in happened if event.kind in JUMPS), default=np.inf)
    return np.asarray(dataset.variables["time"].values >= impact)


def _unsteady(scene: Scene, dataset: xr.Dataset, jumps: Collection[str]) -> NDArray[np.bool_]:
    """Samples next to events of these kinds or to an early end, and those of an ill-posed question, shape (time,)."""
    times = dataset.variables["time"].values
    unsteady = times >= float(dataset.attrs.get("horizon", np.inf))
    unsteady[-1:] |= ended_early(dataset) is not None
    for element in scene.elements:
        for event in events_of(part(scene, element, dataset)):
            if event.kind in jumps:
                next_sample = int(np.searchsorted(times, event.time))
                unsteady[max(next_sample - 1, 0) : next_sample + 1] = True
    return np.asarray(unsteady)


_STILL = 1e-12  # part of the size of an element by which it moves in round-off
_SAME = 1e-6  # relative difference of two intervals of time that is round-off


def untouched(scene: Scene, variables: Any, events: Sequence[Any]) -> bool:
    """True if bodies may touch and none does: no event, no force of a contact, and every gap is open.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name.
        events: of it.
    """
    forces = [name for name, item in scene.observables.items() if item.of_contacts and name in variables]
    arrays = [np.asarray(variables[name].values) for name in forces]
    open_gap = _STILL * min(element.length for element in scene.elements)
    gaps = [name for name, item in scene.observables.items() if item.apart and name in variables]
    closed = any(np.any(np.asarray(variables[name].values) <= open_gap) for name in gaps)
    return bool(arrays) and not (events or closed or any(np.any(values != 0) for values in arrays))


def quiet(scene: Scene, variables: Any, events: Sequence[Any]) -> str:
    """Sentence on a motion in which nothing moves, or nothing touches; empty: something does.

    Args:
        scene: of the motion.
        variables: of it, a mapping by name, ``time`` among them.
        events: of it.
    """
    times = np.asarray(variables["time"].values, dtype=float)
    end = float(times[-1])
    if len(times) < 2 or times[0] > (1 + _SAME) * (times[1] - times[0]):
        return ""  # what happened before the first sample is not known
    if not events and _still(scene, variables):
        return f"Nothing moves up to {end:g} s: every body stays where it starts."
    if untouched(scene, variables, events):
        return f"Nothing touches up to {end:g} s: no contact and no impact is part of the answer."
    return ""


def _still(scene: Scene, variables: Any) -> bool:
    """True if no body of any element moves or turns."""
    for element in scene.elements:
        rate = 1 / element.natural_time
        for name, size, rests in (
            ("p_WB", element.length, False),
            ("q_WB", 1.0, False),
            ("v_WB", rate * element.length, True),
            ("w_WB", rate, True),
        ):
            item = variables.get(scene.label(element, name))
            if item is None:
                return False
            values = np.asarray(item.values)
            least = 0.0 if rests else values[:1]
            if not np.abs(values - least).max(initial=0.0) <= _STILL * size:
                return False
    return True
