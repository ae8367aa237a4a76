"""Regime maps: what becomes of a ball over its initial speed and static friction, as a file of a study asks for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import study_file
from proofroll.files.validation import first_problem

if TYPE_CHECKING:
    import xarray as xr

STUDY = "regimes"
# Maps of this process by what they are made from: a report and its figures show the same ones.
_MADE: dict[tuple[RegimesStudy, str], list[xr.Dataset]] = {}


@dataclass(frozen=True)
class EvenValues:
    """Equally spaced values.

    Attributes:
        low, high: first and last.
        count: how many.
    """

    low: float
    high: float
    count: int

    @property
    def values(self) -> FloatArray:
        """All of them."""
        return np.linspace(self.low, self.high, self.count)


@dataclass(frozen=True)
class RegimesStudy:
    """Maps of what becomes of the ball, one for each rolling resistance.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene: name of the scene.
        until: length of each run [s].
        speed, mu_static: the axes: initial speed [m/s] and static friction [-].
        rolling_resistance: f [m]; one map for each.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    speed: EvenValues
    mu_static: EvenValues
    rolling_resistance: tuple[float, ...]

    @property
    def runs(self) -> int:
        """Number of runs of all maps."""
        return self.speed.count * self.mu_static.count * len(self.rolling_resistance)


def load_regimes(name: str) -> RegimesStudy:
    """Reads a file by its path, its name, or the scene that it is about.

    Raises:
        InputError: there is none, it is broken, or its numbers make no sense.
    """
    path, content = study_file(name, STUDY)
    try:
        found = TypeAdapter(RegimesStudy).validate_python({**content, "name": path.stem})
    except ValidationError as error:
        raise first_problem(error, path.name) from None
    if not (math.isfinite(found.until) and found.until > 0):
        raise InputError(f"{path.name}: until", found.until, "give a positive, finite time in s")
    if not found.rolling_resistance:
        raise InputError(f"{path.name}: rolling_resistance", [], "give at least one value in m")
    for axis, given in (("speed", found.speed), ("mu_static", found.mu_static)):
        if given.count < 1 or not 0 < given.low <= given.high < math.inf:
            raise InputError(f"{path.name}: {axis}", given, "give 0 < low <= high and a count of 1 or more")
    for resistance in found.rolling_resistance:
        load_scene(found.scene, rolling_resistance=resistance, speed=found.speed.low, mu_static=found.mu_static.low)
    return found


def regime_maps(study: RegimesStudy, workers: int, progress: Callable[[int], None] | None = None) -> list[xr.Dataset]:
    """One map per value of the rolling resistance, each from runs of the truth.

    Args:
        study: the axes.
        workers: processes at once.
        progress: called with the number of runs just finished.
    """
    from proofroll.truth.regimes import regime_map

    scenes = [load_scene(study.scene, rolling_resistance=f) for f in study.rolling_resistance]
    key = study, "".join(scene.digest for scene in scenes)
    if key not in _MADE:
        axes = study.speed.values, study.mu_static.values
        _MADE[key] = [
            regime_map(scene, *axes, until=study.until, workers=workers, progress=progress) for scene in scenes
        ]
    return _MADE[key]


for _typed in (RegimesStudy, EvenValues):
    setattr(_typed, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010 -- the name is pydantic's, not the class's
