"""Regime maps (never slips, recovers, falls) over initial speed and static friction, and the files that ask for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.bounds import require_bounds
from proofroll.core.errors import InputError, error_location
from proofroll.core.scene import Scene
from proofroll.core.validation import strict, validated
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import study_file
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.regimes import Regime, analytic_boundaries, classify
from proofroll.running.process_end import in_processes

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.running.cluster import Cluster

STUDY = "regimes"
# Maps made in this process, by their study and scenes: a report and its figures share them.
_MADE: dict[tuple[RegimesStudy, str], list[xr.Dataset]] = {}

_MOST = 1000  # largest number of values on an axis; the runs of a map are the product of two


@dataclass(frozen=True)
class EvenValues:
    """Equally spaced values, as the axis of a map.

    Attributes:
        low, high: first and last.
        count: number of values.
    """

    low: float
    high: float
    count: int

    @property
    def values(self) -> FloatArray:
        """All values, shape (count,)."""
        return np.linspace(self.low, self.high, self.count)

    @property
    def halved(self) -> EvenValues:
        """Axis with half as many intervals; two values stay two."""
        return replace(self, count=self.count // 2 + 1) if self.count > 1 else self


@dataclass(frozen=True)
class RegimesStudy:
    """Regime maps of a ball, one for each rolling resistance.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene: name of the scene.
        until: length of each run [s].
        speed, mu_static: the axes: initial speed [m/s] and static friction [1].
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

    def briefly(self) -> RegimesStudy:
        """Smaller study for a report: a fourth of the runs, every second value of both axes."""
        return replace(self, speed=self.speed.halved, mu_static=self.mu_static.halved)


# Chapter of ``proofroll check --keys``: header of each table, what reads it, fields that are no keys.
CHAPTER = {
    'A regime map: `study = "regimes"`': (
        ("", RegimesStudy, ("name", "speed", "mu_static")),
        ("[speed], [mu_static]", EvenValues),
    )
}


def load_regimes(name: str) -> RegimesStudy:
    """Study from a file, found by its path, its name, or its scene.

    Raises:
        InputError: there is no such file, it is broken, or a number is out of bounds.
    """
    path, content = study_file(name, STUDY)
    study = validated(RegimesStudy, content, path.name, name=path.stem)
    if not study.rolling_resistance:
        raise InputError(f"{path.name}: rolling_resistance", [], "give at least one value in m")
    for axis, values in (("speed", study.speed), ("mu_static", study.mu_static)):
        if not 1 <= values.count <= _MOST or not 0 < values.low <= values.high < math.inf:
            shown = f"from {values.low:g} to {values.high:g}, {values.count} values"
            raise InputError(f"{path.name}: {axis}", shown, f"give 0 < low <= high and a count of 1 to {_MOST}")
    with error_location(path.name):
        require_bounds("until", study.until, above=0)
        for resistance in study.rolling_resistance:
            load_scene(study.scene, rolling_resistance=resistance, speed=study.speed.low, mu_static=study.mu_static.low)
    return study


def regime_maps(
    study: RegimesStudy, workers: int, progress: Callable[[int], None] | None = None, cluster: Cluster | None = None
) -> list[xr.Dataset]:
    """Maps of a study, one per rolling resistance, see :func:`regime_map`; made once in a process."""
    scenes = [load_scene(study.scene, rolling_resistance=f) for f in study.rolling_resistance]
    key = study, "".join(scene.digest for scene in scenes)
    if key not in _MADE:
        axes = study.speed.values, study.mu_static.values
        _MADE[key] = [
            regime_map(scene, *axes, until=study.until, workers=workers, progress=progress, cluster=cluster)
            for scene in scenes
        ]
    return _MADE[key]


def regime_map(
    scene: Scene,
    speeds: Sequence[float] | FloatArray,
    frictions: Sequence[float] | FloatArray,
    *,
    until: float = 4.0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    cluster: Cluster | None = None,
) -> xr.Dataset:
    """Map over initial speed × static friction; the ratio μk/μs is the scene's (1 if unbounded).

    Args:
        scene: one ball on one surface; its other parameters are kept.
        speeds: of the centre [m/s], shape (n,).
        frictions: μs [1], shape (m,).
        until: length of each run [s].
        workers: number of processes; 1 runs in the present one.
        progress: called with the number of runs just finished.
        cluster: runs the rows of the map; None: this machine does.

    Returns:
        Dataset with dims ``speed``, ``mu_static``: ``regime`` (:class:`Regime`), ``slips`` (count), ``first_slip``
        [s, nan: never]; and per speed, where :func:`analytic_boundaries` knows them, ``mu_falls`` and ``mu_slips``.
    """
    import xarray as xr

    body = rolling_ball(scene)
    mus = np.asarray(frictions, dtype=np.float64)
    rows = []
    hosts = set()
    row, places = partial(_row, body, mus, until), [float(speed) for speed in speeds]
    for host, values in (
        cluster.map(row, places) if cluster else (("", row) for row in in_processes(row, places, workers))
    ):
        rows.append(values)
        hosts.add(host)
        if progress is not None:
            progress(len(mus))
    regime, slips, times = np.moveaxis(np.array(rows).reshape(len(rows), len(mus), 3), -1, 0)
    dims = ("speed", "mu_static")
    meaning = ", ".join(f"{item.value}: {item.name.lower().replace('_', ' ')}" for item in Regime)
    result = xr.Dataset(
        {
            "regime": (dims, regime.astype(np.int8), {"units": "1", "long_name": meaning}),
            "slips": (dims, slips.astype(np.int64), {"units": "1", "long_name": "how often a slip began"}),
            "first_slip": (dims, times, {"units": "s", "long_name": "time of the first slip"}),
        },
        coords={
            "speed": ("speed", np.asarray(speeds, dtype=np.float64), {"units": "m/s"}),
            "mu_static": ("mu_static", mus, {"units": "1"}),
        },
        attrs={"scene": scene.name, "until": until, "rolling_resistance": body.contact.rolling_resistance}
        | {"ran_on": ", ".join(sorted(hosts))},
    )
    bounds = analytic_boundaries(body, result["speed"].to_numpy())
    if bounds is not None:
        falls, slipping = bounds
        result["mu_falls"] = ("speed", falls, {"units": "1", "long_name": "below: falls, without rolling resistance"})
        result["mu_slips"] = ("speed", slipping, {"units": "1", "long_name": "above: never slips, without resistance"})
    return result


def _row(body: RollingBall, mus: FloatArray, until: float, speed: float) -> list[tuple[float, float, float]]:
    moving = body.at_speed(speed)
    return [classify(moving.with_contact(mu_static=float(mu)), until) for mu in mus]


strict(RegimesStudy, EvenValues)
