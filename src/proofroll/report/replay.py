"""The replay: which cases and which runs it shows, and their numbers packed for the page. Kinds of scenes draw them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.files.json_data import MERGED, OPTIONAL
from proofroll.files.netcdf import read_some
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison_content import by_row, outcome_content
from proofroll.report.labels import names
from proofroll.report.pages import packed
from proofroll.report.replay_library import thinned, three
from proofroll.report.styles import styles
from proofroll.running.case import Case, Status
from proofroll.running.store import Store
from proofroll.studies.outcome import Outcome, Run
from proofroll.studies.planning import point_name

# How fast a person can let it run, over real time.
SPEEDS = (0.001, 0.003, 0.01, 0.03, 0.1, 0.25, 0.5, 1.0)
# Frames per second of the motion that no eye misses, the fewest of a replay that is slowed down, and the most that it
# keeps where that is enough.
LEAST_PER_SECOND, LEAST_FRAMES, MOST_FRAMES = 60, 120, 600
# A body's turn from one frame to the next [rad]: what is smooth, and what must never be passed, for beyond half a
# turn the shorter way from one orientation to the next is the wrong one.
SMOOTH_TURN, WIDEST_TURN = 1.2, 2.5


@dataclass(frozen=True)
class Ghost:
    """A run that can be shown beside the truth.

    Attributes:
        key: of its case; one run has one.
        engine: name of the engine.
        settings: of the engine, complete.
        name, colour: as in the figures of its comparison.
        distance: of its bodies from the true ones, at most [m].
        file: its trajectory.
        message: why it ended early; empty if it did not.
    """

    key: str
    engine: str
    settings: Mapping[str, Any]
    name: str
    colour: int
    distance: float
    file: Path
    message: str = ""

    @property
    def default(self) -> bool:
        """Whether it is what a user gets by writing the obvious model."""
        return self.settings.get("preset") == "default"

    def ending(self, reached: float) -> str:
        """Why it is not there until the end, where its last frame is at ``reached`` [s]."""
        return f"until {reached:.3g} s: {self.message or 'it leaves the picture'}"


@dataclass(frozen=True)
class Replayed:
    """One truth and the runs beside it.

    Attributes:
        scene: with the parameters of the case.
        file: the truth's trajectory.
        ghosts: what stands beside it.
        group: of cases to which it belongs.
        label: what it is called in its group.
    """

    scene: Scene
    file: Path
    ghosts: list[Ghost]
    group: str
    label: str


@dataclass
class PackedNumbers:
    """What the page unpacks: names and shapes of arrays, and their numbers one after the other.

    Attributes:
        arrays: name, number of the run (0: the truth) or -1, width, length, step of each.
        content: the numbers, thinned (:func:`proofroll.report.replay_library.thinned`).
    """

    arrays: list[tuple[str, int, int, int, float]] = field(default_factory=list)
    content: bytearray = field(default_factory=bytearray)

    def put(self, name: str, run: int, values: FloatArray | None, step: float) -> None:
        """Adds an array whose first axis is time; nothing where there is none.

        Args:
            name: what the page calls it.
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
    """How a kind of scene is replayed.

    Attributes:
        name: under which the page's program knows how to draw it.
        seen: how far a body of a scene can be off and look right [m].
        draw: what is drawn of a truth and its ghosts.
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
    """Everything that the replay draws.

    Attributes:
        library: that draws it, from :func:`proofroll.report.replay_library.three`.
        start: number of the case to begin with.
        cases: in words.
        packed: the numbers of each case.
        speeds: how fast a person can let it run.
    """

    library: dict[str, str] | None
    start: int
    cases: list[ReplayCase]
    packed: list[str]
    speeds: tuple[float, ...] = SPEEDS


def replay_content(outcomes: list[Outcome], store: Store, kind: ReplayKind) -> Replay:
    """Everything that the replay draws.

    There is one case for each truth of the comparisons. Its ghosts are what the engines make of it with ``default``
    settings, and of each engine the other setting whose bodies are furthest from the true ones, if that is seen. At
    first, of each engine the ``default`` one is shown that is furthest off.

    Args:
        outcomes: comparisons of scenes of one kind.
        store: with their trajectories.
        kind: of these scenes.
    """
    found: dict[str, tuple[Case, list[tuple[Outcome, str]]]] = {}
    for outcome in outcomes:
        for point, case in outcome.truths.items():
            if store.trajectory(case).is_file():
                found.setdefault(case.key, (case, []))[1].append((outcome, point))
    looks = {id(outcome): _looks(outcome) for outcome in outcomes}
    cases, numbers = [], []
    for case, shared in found.values():
        scene = load_scene(case.scene, **case.parameters)
        true = read_some(store.trajectory(case), ["p_WB"])["p_WB"]
        ghosts = [
            ghost
            for outcome, point in shared
            for ghost in _ghosts(_runs(outcome, point, store), looks[id(outcome)], true, store)
        ]
        ghosts = _chosen(ghosts, kind.seen(scene))
        # The comparison that has most to show at this point names the case.
        title = max(shared, key=lambda pair: len(_runs(pair[0], pair[1], store)))[0].comparison.title
        replayed = Replayed(scene, store.trajectory(case), ghosts, title, point_name(case.parameters) or scene.title)
        content, packed_numbers = case_content(replayed, kind, lambda file: f"{store.folder.name}/{file.name}")
        cases.append(content)
        numbers.append(packed_numbers)
    plainest = [load_scene(case.scene, asks=case.asks).digest == case.scene_digest for case, _ in found.values()]
    start = plainest.index(True) if any(plainest) else 0
    return Replay(three(), start, cases, numbers)


def joined(parts: list[Replay]) -> Replay | None:
    """The replays of several kinds of scenes as one; the first begins. None where there is nothing to draw."""
    parts = [part for part in parts if part.cases]
    if not parts:
        return None
    cases, numbers = [case for part in parts for case in part.cases], [item for part in parts for item in part.packed]
    return replace(parts[0], cases=cases, packed=numbers)


def frame_times(until: float, fastest: float) -> FloatArray:
    """Evenly spaced times of the frames [s], shape (n,): so many that the fastest body is seen to turn the right way.

    Args:
        until: the last time [s].
        fastest: largest angular velocity of the truth [rad/s].
    """
    turned = until * fastest
    wanted = max(LEAST_PER_SECOND * until, turned / SMOOTH_TURN, LEAST_FRAMES)
    return np.linspace(0.0, until, 1 + int(np.ceil(max(min(wanted, MOST_FRAMES), turned / WIDEST_TURN))))


def case_content(replayed: Replayed, kind: ReplayKind, named: Callable[[Path], str]) -> tuple[ReplayCase, str]:
    """A truth and its ghosts in words, with what is drawn of them; and the numbers, packed.

    Args:
        replayed: what is shown.
        kind: how.
        named: what the page calls a file.
    """
    own, frames, drawn = kind.draw(replayed)
    first = {ghost.engine: ghost for ghost in reversed(replayed.ghosts)}  # the one furthest off comes first
    until, whole = own["until"], own["frames"]
    runs = [
        ReplayedRun("truth", -1, True, whole, "", named(replayed.file)),
        *(
            ReplayedRun(
                name=ghost.name,
                colour=ghost.colour,
                shown=first[ghost.engine] is ghost,
                frames=count,
                message=ghost.ending(until * (count - 1) / max(1, whole - 1)) if count < whole else "",
                trajectory=named(ghost.file),
                settings=ghost.settings,
            )
            for ghost, count in zip(replayed.ghosts, frames, strict=True)
        ),
    ]
    case = ReplayCase(replayed.group, replayed.label, kind.name, replayed.scene.title, own, runs, drawn.arrays)
    return case, packed(bytes(drawn.content))


def distance(path: FloatArray, true: FloatArray) -> float:
    """The largest distance between bodies [m]; a run that ended early has fewer samples."""
    count = min(len(path), len(true))
    return float(np.linalg.norm(path[:count] - true[:count], axis=-1).max())


def _runs(outcome: Outcome, point: str, store: Store) -> list[tuple[int, Run]]:
    """Number of the row and the run, for all runs at a point that have a trajectory."""
    return [
        (number, run)
        for number, runs in enumerate(by_row(outcome).values())
        for run in runs
        if point_name(run.parameters) == point and run.result.trajectory is not None and _file(run, store).is_file()
    ]


def _looks(outcome: Outcome) -> list[tuple[str, int]]:
    """Name and colour of each row, as in the comparison's figures."""
    rows = outcome_content(outcome).rows
    return [(name, style.colour) for name, style in zip(names(rows), styles(rows), strict=True)]


def _ghosts(runs: list[tuple[int, Run]], looks: list[tuple[str, int]], true: FloatArray, store: Store) -> list[Ghost]:
    ghosts = []
    for number, run in runs:
        assert run.case is not None  # it has a trajectory
        engine, file = run.case.engine, _file(run, store)
        away = distance(read_some(file, ["p_WB"])["p_WB"], true)
        message = "" if run.result.status == Status.DONE else run.result.message
        ghosts.append(Ghost(run.case.key, engine.name, engine.settings, *looks[number], away, file, message))
    return ghosts


def _chosen(ghosts: list[Ghost], seen: float) -> list[Ghost]:
    """By engine in the order of the comparisons, the furthest from the truth first; each run once.

    All that are ``default``, and of the others the furthest, if it is off by more than ``seen`` [m] or there is none.
    """
    once = {ghost.key: ghost for ghost in reversed(ghosts)}  # the first comparison's name stays
    chosen = []
    for engine in dict.fromkeys(ghost.engine for ghost in ghosts):
        own = sorted((ghost for ghost in once.values() if ghost.engine == engine), key=lambda ghost: -ghost.distance)
        default = [ghost for ghost in own if ghost.default]
        other = [ghost for ghost in own if not ghost.default][:1]
        chosen += default + [ghost for ghost in other if ghost.distance > seen or not default]
    return chosen


def _file(run: Run, store: Store) -> Path:
    assert run.case is not None  # it has a trajectory
    return store.trajectory(run.case)
