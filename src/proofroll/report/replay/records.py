"""Records of a replay: cases, the runs in them, and their packed numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.files.json_data import MERGED, OPTIONAL
from proofroll.report.replay.library import thinned

if TYPE_CHECKING:
    import xarray as xr

# Speeds that a person can choose, relative to real time.
SPEEDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.25, 0.5, 1.0)


@dataclass(frozen=True)
class Ghost:
    """A run that can be shown beside the truth.

    Attributes:
        key: identifies its case, so that one run is shown once.
        engine: name of the engine.
        settings: of the engine, complete.
        name, colour: as in the figures of its comparison.
        distance: largest distance of its bodies from the true ones [m].
        motion: its trajectory.
        file: path of its stored trajectory, as the page shows it; empty: not stored.
        message: reason why it ended early; empty: it did not.
    """

    key: str
    engine: str
    settings: Mapping[str, Any]
    name: str
    colour: int
    distance: float
    motion: xr.Dataset
    file: str
    message: str = ""

    @property
    def default(self) -> bool:
        """True if the run has the settings of the obvious model (preset ``default``)."""
        return self.settings.get("preset") == "default"

    def ending(self, reached: float) -> str:
        """Reason why it is not shown to the end; ``reached``: time of its last frame [s]."""
        return f"until {reached:.3g} s: {self.message or 'it leaves the picture'}"


@dataclass(frozen=True)
class Replayed:
    """A true motion and the runs shown beside it.

    Attributes:
        scene: with the parameters of the case.
        true: the true motion.
        file: path of the stored truth, as the page shows it; empty: not stored.
        ghosts: runs drawn beside it.
        group: name of the group of cases that it belongs to.
        label: name in its group.
        solid: name of what is drawn solid: the truth, or where there is none the run alone.
    """

    scene: Scene
    true: xr.Dataset
    file: str
    ghosts: list[Ghost]
    group: str
    label: str
    solid: str = "truth"


def present(motion: xr.Dataset, names: Collection[str]) -> dict[str, npt.NDArray[Any]]:
    """Values of the named variables; those that the motion lacks are left out."""
    return {name: motion[name].to_numpy() for name in names if name in motion.variables}


@dataclass
class PackedNumbers:
    """Arrays for the page: names and shapes, and all numbers in one sequence of bytes.

    Attributes:
        arrays: name, number of the run (0: the truth; -1: shared), width, length, step of each.
        content: the numbers, thinned (:func:`proofroll.report.replay.library.thinned`).
    """

    arrays: list[tuple[str, int, int, int, float]] = field(default_factory=list)
    content: bytearray = field(default_factory=bytearray)

    def put(self, name: str, run: int, values: FloatArray | None, step: float) -> None:
        """Adds an array whose first axis is time; None is ignored.

        Args:
            name: name on the page.
            run: number of its run, 0: the truth, -1: shared by all.
            values: shape (n, ...).
            step: rounding step, in the array's unit.
        """
        if values is not None:
            rows = values.reshape(len(values), -1)
            self.arrays.append((name, run, rows.shape[1], len(rows), step))
            self.content.extend(thinned(rows, step))


# Function of a kind of scene for one truth: returns its part of the case, the number of frames of each ghost, the
# numbers.
Drawer = Callable[[Replayed], tuple[dict[str, Any], list[int], PackedNumbers]]


class ReplayKind(NamedTuple):
    """Drawing of a kind of scene in the replay.

    Attributes:
        name: name of the kind in the page's program.
        seen: largest invisible error of a position [m], as a function of the scene.
        draw: function that draws a truth and its ghosts.
        readings: names and units of the coordinates listed beside the picture, as a function of the scene.
    """

    name: str
    seen: Callable[[Scene], float]
    draw: Drawer
    readings: Callable[[Scene], list[tuple[str, str]]]


@dataclass(frozen=True)
class ReplayedRun:
    """One motion of a case; ``shown``: True if visible at first; ``message``: reason for an early end."""

    name: str
    colour: int
    shown: bool
    frames: int
    message: str
    trajectory: str
    settings: Mapping[str, Any] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class ReplayCase:
    """Description of a truth and its ghosts; ``own``: of its kind of scene; ``arrays``: see :class:`PackedNumbers`."""

    group: str
    label: str
    kind: str
    scene: str
    own: Mapping[str, Any] = field(metadata=MERGED)
    runs: list[ReplayedRun]
    arrays: list[tuple[str, int, int, int, float]] | None = field(default=None, metadata=OPTIONAL)

    @property
    def described(self) -> ReplayCase:
        """Copy without its numbers, which can be computed from the named trajectories."""
        return replace(self, arrays=None)


@dataclass(frozen=True)
class Replay:
    """Content of a replay.

    Attributes:
        library: three.js from :func:`proofroll.report.replay.library.three`, or None.
        start: number of the case to begin with, in which a ghost is furthest off.
        largest: distance of that ghost [m].
        cases: descriptions of the cases.
        packed: the numbers of each case.
        speeds: speeds of the replay that a person can choose.
    """

    library: dict[str, str] | None
    start: int
    cases: list[ReplayCase]
    packed: list[str]
    speeds: tuple[float, ...] = SPEEDS
    largest: float = 0.0
