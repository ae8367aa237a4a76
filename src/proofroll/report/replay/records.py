"""Records of a replay: cases, the runs in them, and their numbers as the page unpacks them."""

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

# How fast a person can let it run, over real time.
SPEEDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.25, 0.5, 1.0)


@dataclass(frozen=True)
class Ghost:
    """A run that can be shown beside the truth.

    Attributes:
        key: of its case; one run has one.
        engine: name of the engine.
        settings: of the engine, complete.
        name, colour: as in the figures of its comparison.
        distance: of its bodies from the true ones, at most [m].
        motion: its trajectory.
        file: in which that is stored, as the page calls it; empty: in none.
        message: reason for which it ended early; empty: it did not.
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
        """True if its settings are those of the obvious model (preset ``default``)."""
        return self.settings.get("preset") == "default"

    def ending(self, reached: float) -> str:
        """Reason that it is not there until the end, where its last frame is at ``reached`` [s]."""
        return f"until {reached:.3g} s: {self.message or 'it leaves the picture'}"


@dataclass(frozen=True)
class Replayed:
    """A true motion and the runs shown beside it.

    Attributes:
        scene: with the parameters of the case.
        true: the true motion.
        file: in which it is stored, as the page calls it; empty: in none.
        ghosts: motions drawn beside it.
        group: of cases to which it belongs.
        label: name in its group.
    """

    scene: Scene
    true: xr.Dataset
    file: str
    ghosts: list[Ghost]
    group: str
    label: str


def some(motion: xr.Dataset, names: Collection[str]) -> dict[str, npt.NDArray[Any]]:
    """Values of some variables, as far as there are any."""
    return {name: motion[name].to_numpy() for name in names if name in motion.variables}


@dataclass
class PackedNumbers:
    """Arrays for the page: their names and shapes, and their numbers one after the other.

    Attributes:
        arrays: name, number of the run (0: the truth) or -1, width, length, step of each.
        content: the numbers, thinned (:func:`proofroll.report.replay.library.thinned`).
    """

    arrays: list[tuple[str, int, int, int, float]] = field(default_factory=list)
    content: bytearray = field(default_factory=bytearray)

    def put(self, name: str, run: int, values: FloatArray | None, step: float) -> None:
        """Adds an array whose first axis is time; nothing where there is none.

        Args:
            name: name on the page.
            run: whose it is; -1: of all.
            values: shape (n, ...).
            step: to which it is rounded, in its unit.
        """
        if values is not None:
            rows = values.reshape(len(values), -1)
            self.arrays.append((name, run, rows.shape[1], len(rows), step))
            self.content.extend(thinned(rows, step))


# What a kind of scene makes of a truth: its part of the case, how many frames each ghost has, and the numbers.
Drawer = Callable[[Replayed], tuple[dict[str, Any], list[int], PackedNumbers]]


class ReplayKind(NamedTuple):
    """Drawing of a kind of scene in the replay.

    Attributes:
        name: under which the page's program knows how to draw it.
        seen: largest error of a body that still looks right [m].
        draw: function that draws a truth and its ghosts.
    """

    name: str
    seen: Callable[[Scene], float]
    draw: Drawer


@dataclass(frozen=True)
class ReplayedRun:
    """One motion of a case: whether it is ``shown`` at first, how many frames it has, and why it ended early."""

    name: str
    colour: int
    shown: bool
    frames: int
    message: str
    trajectory: str
    settings: Mapping[str, Any] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class ReplayCase:
    """A truth and its ghosts in words; ``own``: what is drawn of them, ``arrays``: see :class:`PackedNumbers`."""

    group: str
    label: str
    kind: str
    scene: str
    own: Mapping[str, Any] = field(metadata=MERGED)
    runs: list[ReplayedRun]
    arrays: list[tuple[str, int, int, int, float]] | None = field(default=None, metadata=OPTIONAL)

    @property
    def described(self) -> ReplayCase:
        """Without its numbers, which follow from the trajectories that it names."""
        return replace(self, arrays=None)


@dataclass(frozen=True)
class Replay:
    """Content of a replay.

    Attributes:
        library: that draws it, from :func:`proofroll.report.replay.library.three`.
        start: number of the case to begin with.
        cases: in words.
        packed: the numbers of each case.
        speeds: speeds of the replay that a person can choose.
    """

    library: dict[str, str] | None
    start: int
    cases: list[ReplayCase]
    packed: list[str]
    speeds: tuple[float, ...] = SPEEDS
