"""Differences of two stored runs of one scene: numbers, settings, versions and events."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.dataset import observe, scales
from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.core.number_format import counted, number, spaced
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.whole_turns import on_turns_of
from proofroll.files.scene_file import load_scene
from proofroll.files.trajectory_file import read

if TYPE_CHECKING:
    import xarray as xr


# Largest difference, relative to the size of the quantity, that counts as round-off. Another compiler or order of sums
# changes numbers by some 1e-13, solvers of constraints by their tolerances, other physics or methods by far more.
ROUND_OFF = 1e-9


class NumberKind(StrEnum):
    """Kind of difference between the numbers of two runs."""

    SAME_BITS = "same bits"
    ROUND_OFF = "round-off"
    CHANGED = "changed"


@dataclass(frozen=True)
class NumbersApart:
    """Difference of two trajectories, for the observable with the largest relative difference.

    Attributes:
        quantity, unit: of that observable; empty if nothing differs.
        difference: the largest, in its unit.
        relative: difference divided by the observable's size [1].
        kind: of difference.
    """

    quantity: str = ""
    unit: str = ""
    difference: float = 0.0
    relative: float = 0.0
    kind: NumberKind = NumberKind.SAME_BITS


def numbers_apart(
    scene: Scene, data: xr.Dataset, new_data: xr.Dataset, sizes: Mapping[str, float]
) -> list[NumbersApart]:
    """Differences of two runs with samples at the same times, for each observable that differs, the largest first.

    Args:
        scene: of both runs.
        data: earlier run.
        new_data: later run.
        sizes: observable -> its size, to which its difference is relative; by default its largest value.
    """
    differences = []
    curves, rivals = observe(scene, data), observe(scene, new_data)
    for name, curve in curves.items():
        item, rival = scene.observables[name], rivals.get(name)
        if rival is None or item.role not in {Role.MOTION, Role.REACTION} or curve.ndim != rival.ndim:
            continue
        rival = on_turns_of(curve, rival, name, (data, new_data))
        if rival is None:
            continue
        count = min(len(curve), len(rival))
        if curve[:count].shape != rival[:count].shape or np.array_equal(curve[:count], rival[:count], equal_nan=True):
            continue
        difference = float(np.nanmax(np.abs(curve[:count] - rival[:count]), initial=0.0))
        relative = difference / (sizes.get(name) or float(np.nanmax(np.abs(curve), initial=0.0)) or 1.0)
        kind = NumberKind.ROUND_OFF if relative <= ROUND_OFF else NumberKind.CHANGED  # NaN counts as a difference
        differences.append(
            NumbersApart(quantity=name, unit=item.unit, difference=difference, relative=relative, kind=kind)
        )
    return sorted(differences, key=lambda item: -item.relative if item.relative >= 0 else -math.inf)


# Times of two runs are one instant up to this part of the longer run: samples are rounded to the step of the engine.
_ONE_INSTANT = 1e-12


@dataclass(frozen=True)
class TwoRuns:
    """Differences of two stored runs.

    Attributes:
        old, new: paths of the runs.
        scene: of both.
        instants: number of instants at which both have samples.
        about: engine, settings, parameters and versions that differ, as ``settings.dt`` -> both values, or None.
        numbers: observables that differ, the largest difference first.
        events: number of events of each run.
        event_time: largest difference of the times of events in the same order [s]; None if kinds or numbers differ.
    """

    old: str
    new: str
    scene: str
    instants: int
    about: dict[str, tuple[Any, Any]]
    numbers: list[NumbersApart]
    events: tuple[int, int]
    event_time: float | None

    @property
    def changed(self) -> bool:
        """True if the runs differ by more than round-off, or in their events."""
        return self.event_time is None or any(item.kind == NumberKind.CHANGED for item in self.numbers)

    @property
    def sentence(self) -> str:
        """The largest difference, in one sentence."""
        at_instants = f"at {counted(self.instants, 'instants')}"
        if not self.numbers:
            return f"Both runs of {self.scene} have the same bits {at_instants}."
        worst = self.numbers[0]
        size, gap = number(worst.relative), f"{number(worst.difference)}{spaced(worst.unit)}"
        if worst.kind == NumberKind.ROUND_OFF:
            return f"Both runs of {self.scene} are equal to {size} of each size {at_instants}."
        return f"Both runs of {self.scene} differ, most in {worst.quantity}: {gap}, {size} of its size, {at_instants}."

    @property
    def lines(self) -> Iterator[str]:
        """Differences of what was asked for, of events and of quantities, a line each."""
        for name, (value, new_value) in self.about.items():
            yield f"{name}: {'–' if value is None else value} → {'–' if new_value is None else new_value}"
        if self.event_time is None:
            yield f"!! events: {self.events[0]} → {self.events[1]}, or of other kinds"
        elif self.event_time:
            yield f"{counted(self.events[0], 'events')} of the same kinds, at most {number(self.event_time)} s apart"
        for item in self.numbers:
            sign = "!!" if item.kind == NumberKind.CHANGED else "  "
            size = f"{number(item.relative)} of its size"
            yield f"{sign} {item.quantity}: {number(item.difference)}{spaced(item.unit)}, {size}"

    @property
    def markdown(self) -> str:
        """The differences as a comment on a change of code, in Markdown."""
        return "\n".join([f"**proofroll**: {self.sentence}", "", *(f"- {line.strip()}" for line in self.lines), ""])


def two_runs(old: Path, new: Path) -> TwoRuns:
    """Differences of two runs that ``proofroll run --out`` wrote, at the instants that both have.

    Raises:
        InputError: a file cannot be read or does not name its scene, the scenes differ, or no instant is shared.
    """
    data, new_data = _read(old, "old"), _read(new, "new")
    names = [str(item.attrs.get("scene_path", item.attrs["scene"])) for item in (data, new_data)]
    if names[0] != names[1]:
        raise InputError("new", new, f"is a run of {names[1]}, and {old} one of {names[0]}; name two runs of one scene")
    scene = load_scene(names[0], **_object(data, "parameters"))
    data, new_data = _at_shared_instants(data, new_data, new)
    sizes = {name: size for name, size in scales(scene, data).items() if np.isfinite(size)}
    events, new_events = events_of(data), events_of(new_data)
    kinds, new_kinds = ([(event.kind, event.name) for event in run] for run in (events, new_events))
    delays = [abs(event.time - rival.time) for event, rival in zip(events, new_events, strict=False)]
    return TwoRuns(
        old=str(old),
        new=str(new),
        scene=scene.name,
        instants=data.sizes["time"],
        about=_about(data, new_data),
        numbers=numbers_apart(scene, data, new_data, sizes),
        events=(len(events), len(new_events)),
        event_time=max(delays, default=0.0) if kinds == new_kinds else None,
    )


def _read(path: Path, side: str) -> xr.Dataset:
    try:
        data = read(path)
    except (OSError, ValueError) as problem:
        raise InputError(side, path, f"cannot be read as a run: {problem}") from None
    if "scene" not in data.attrs:
        raise InputError(side, path, "does not name its scene; proofroll run SCENE --out FILE.nc writes one that does")
    return data


def _object(data: xr.Dataset, name: str) -> Mapping[str, Any]:
    """Attribute that is a JSON object; empty if there is none."""
    try:
        value = json.loads(str(data.attrs.get(name, "{}")))
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}


def _about(data: xr.Dataset, new_data: xr.Dataset) -> dict[str, tuple[Any, Any]]:
    """Differences of what was asked for, by name; settings and versions of one engine alone."""
    one_engine = data.attrs.get("engine") == new_data.attrs.get("engine")
    objects = ("parameters", "settings", "versions") if one_engine else ("parameters",)
    values = [
        {name: run.attrs.get(name) for name in ("engine", "machine")}
        | {f"{name}.{key}": value for name in objects for key, value in _object(run, name).items()}
        for run in (data, new_data)
    ]
    pairs = [(name, values[0].get(name), values[1].get(name)) for name in dict.fromkeys([*values[0], *values[1]])]
    return {name: (value, new_value) for name, value, new_value in pairs if value != new_value}


def _at_shared_instants(data: xr.Dataset, new_data: xr.Dataset, path: Path) -> tuple[xr.Dataset, xr.Dataset]:
    """Both runs at the instants that both have."""
    times, new_times = (item["time"].to_numpy() for item in (data, new_data))
    if not (len(times) and len(new_times)):
        raise InputError("new", path, "one of the runs has no samples")
    end = np.clip(np.searchsorted(new_times, times), 0, len(new_times) - 1)
    start = np.maximum(end - 1, 0)
    place = np.where(np.abs(new_times[start] - times) < np.abs(new_times[end] - times), start, end)
    mask = np.abs(new_times[place] - times) <= _ONE_INSTANT * max(times[-1], new_times[-1])
    if np.count_nonzero(mask) < 2:
        raise InputError("new", path, "has no samples at the times of the other run; run both with one --every")
    return data.isel(time=np.flatnonzero(mask)), new_data.isel(time=place[mask])
