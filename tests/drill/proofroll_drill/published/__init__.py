"""Values and errors that were measured elsewhere, and the same of this machine beside them.

Those of ``numbers.toml``, and ``[[published]]`` of the scenes.
"""

from __future__ import annotations

import functools
import itertools
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import ProofrollError, require_known
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.elements.mechanism.scene.published import Published, read_published
from proofroll.files.scene_file import load_scene, read_scene_file, scene_names
from proofroll.running.simulation import simulate

FILE = Path(__file__).with_name("numbers.toml")
DIGITS = 1e-10  # to which published values of true motions are held; they have ten to eighteen digits
FACTOR = 2.0  # by which an error may be larger than one that was measured elsewhere
SAMPLES = 0.02  # between samples of an engine's run [s]
_FIRST = 1e-3  # the step of the first error of an engine [s]; each that follows is of a tenth of it


@dataclass(frozen=True)
class Held:
    """A published number beside ours.

    Attributes:
        scene, what: names of the scene and of its number.
        kind: a true ``value``, or the ``error`` of an engine.
        published, ours: the numbers; nan where there is no run.
        misses: True if a value is further off than its digits, or an error larger than allowed.
        why: reason that there is no run, or that an error is ``smaller``.
    """

    scene: str
    kind: Literal["value", "error"]
    what: str
    published: float
    ours: float
    misses: bool
    why: str = ""

    @property
    def text(self) -> str:
        """Line for a person: the published number, ours, and whether it misses."""
        digits, of = (".2g", "error of ") if self.kind == "error" else (".13g", "")
        found = f"{self.published:{digits}} published, {self.ours:{digits}} ours"
        return f"{'✗' if self.misses else '✓'} {self.scene}: {of}{self.what}: {found} {self.why}".rstrip()


def held(scenes: list[str]) -> Iterator[Held]:
    """Every published number of some scenes, all if none is named."""
    file = tomllib.loads(FILE.read_text(encoding="utf-8"))
    peers = tables()
    known = dict.fromkeys([*(entry["scene"] for kind in ("truths", "errors") for entry in file[kind]), *peers])
    for name in scenes:
        require_known("scene", name, known, "no number of it was published; choose from")
    for kind, hold in (("truths", of_motion), ("errors", _errors)):
        for entry in file[kind]:
            if not scenes or entry["scene"] in scenes:
                yield from hold(entry)
    for name, entries in peers.items():
        if not scenes or name in scenes:
            for entry in entries:
                yield from of_scene(name, entry)


def tables() -> dict[str, tuple[Published, ...]]:
    """``[[published]]`` of all scenes that have them."""
    read = {name: read_scene_file(name).tables.get("published", []) for name in scene_names()}
    return {name: read_published(content) for name, content in read.items() if content}


def of_scene(scene: str, entry: Published) -> Iterator[Held]:
    """Each observable of a ``[[published]]`` table beside the truth, at the instant at which it is furthest off."""
    found = _motion(scene, entry.times, tuple(entry.parameters.items()))
    for name, values in entry.values.items():
        if name not in found:
            yield Held(scene, "value", name, values[0], np.nan, True, "(the truth has no such observable)")
            continue
        ours = found[name].to_numpy()[-len(values) :]
        share = np.abs(ours - values) / entry.allowed(name)
        worst = int(np.argmax(np.nan_to_num(share, nan=np.inf)))
        said = f"{name} at {entry.times[worst]:g} s" + (f", of {len(values)}" if len(values) > 1 else "")
        yield Held(scene, "value", said, values[worst], float(ours[worst]), not share[worst] <= 1)


@functools.lru_cache(maxsize=2)
def _motion(scene: str, times: tuple[float, ...], parameters: tuple[tuple[str, float], ...]) -> xr.Dataset:
    """Truth at the start and at these times [s]; tables of one scene often share them."""
    return truth(load_scene(scene, **dict(parameters)), np.array([*([] if times[0] == 0 else [0.0]), *times]))


def true_values(scene: str) -> list[dict[str, Any]]:
    """Entries of a scene's true motions; tests of engines hold them at their own tolerances."""
    return [entry for entry in true_motions() if entry["scene"] == scene]


def true_motions() -> list[dict[str, Any]]:
    """All entries of true motions."""
    entries: list[dict[str, Any]] = tomllib.loads(FILE.read_text(encoding="utf-8"))["truths"]
    return entries


def of_motion(entry: Mapping[str, Any]) -> Iterator[Held]:
    """Each number of a true motion beside ours."""
    name, at = entry["scene"], entry["at"]
    found = run_of(entry)
    for variable, published in entry.get("values", {}).items():
        values = np.ravel(found[variable].to_numpy()[-1])
        for place, one in enumerate(np.atleast_1d(published)):
            if np.isfinite(one):
                said = f"{variable}{f'[{place}]' if np.size(published) > 1 else ''} at {at:g} s"
                yield _value(name, said, float(one), float(values[place]))
    # What happens at once, as two feet that stop together, is one time
    groups = itertools.groupby((event.time for event in events_of(found)), lambda time: round(time, 9))
    times = [next(group) for _, group in groups]
    for number, time in enumerate(entry.get("events", []), 1):
        yield _value(name, f"event {number} [s]", time, times[number - 1] if number <= len(times) else np.nan)
    if "rests" in entry:
        yield _value(name, "rest [s]", entry["rests"], times[-1])


def run_of(entry: Mapping[str, Any]) -> xr.Dataset:
    """Truth at the start, half-way and at the end of a true motion."""
    at, parameters = float(entry["at"]), tuple(sorted(entry.get("parameters", {}).items()))
    return _motion(entry["scene"], (at / 2, at), parameters)


def _value(scene: str, what: str, published: float, ours: float) -> Held:
    return Held(scene, "value", what, published, ours, not abs(ours - published) <= DIGITS * max(1.0, abs(published)))


def _errors(entry: Mapping[str, Any]) -> Iterator[Held]:
    name, until = entry["scene"], entry["until"]
    scene = load_scene(name)
    of = entry.get("of", "p_WB")
    true = simulate(scene, "truth", until=until, every=SAMPLES)[of].to_numpy()
    for engine, errors in entry["engines"].items():
        for power, published in enumerate(errors):
            if np.isnan(published):
                continue
            dt = _FIRST / 10**power
            ours, why = np.nan, ""
            try:
                ours = _distance(simulate(scene, engine, until=until, every=SAMPLES, dt=dt)[of].to_numpy(), true)
            except ProofrollError as error:
                why = str(error)
            why = "smaller" if ours < published / FACTOR else why
            misses = not ours <= FACTOR * published  # nan misses
            yield Held(name, "error", f"{engine}, {dt:g} s", published, ours, misses, why)


def _distance(path: FloatArray, true: FloatArray) -> float:
    if path.shape != true.shape:  # it ended early
        return float("nan")
    return float((np.linalg.norm(path - true, axis=-1) if path.ndim > 1 else np.abs(path - true)).max())
