"""Replay: choice of the cases and runs to show, and their packed numbers for the page."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.core.whole_turns import on_turns_of
from proofroll.files.trajectory_file import StoredTrajectory
from proofroll.report.comparison.summary import reported, runs_at
from proofroll.report.labels import names, symbol, unit
from proofroll.report.pages import packed
from proofroll.report.replay.library import three
from proofroll.report.replay.records import Ghost, PackedNumbers, Replay, ReplayCase, Replayed, ReplayedRun, ReplayKind
from proofroll.report.styles import styles
from proofroll.running.case import Status
from proofroll.studies.comparison.outcome import ComparedPoint, Outcome, Run
from proofroll.studies.comparison.planning import point_name

# Frames per second of motion that look continuous, least number of frames of a slowed replay, and largest number unless
# fast turns need more.
LEAST_PER_SECOND, LEAST_FRAMES, MOST_FRAMES = 60, 120, 600
# Turn of a body from one frame to the next [rad]: one that looks smooth, and the largest one, for beyond half a turn
# interpolation goes the shorter, wrong way.
SMOOTH_TURN, WIDEST_TURN = 1.2, 2.5
# Most coordinates whose values are listed; rounding of a listed value, relative to its size; part of the largest value
# of any run that this size is at least, as packed numbers have at most 2^30 steps; least size, in the value's unit.
_MOST_READINGS, _ROUNDED, _PACKED, _LEAST = 6, 2.0**-20, 1e-3, 1e-9


def replay_content(outcomes: list[Outcome], kind: ReplayKind, page_engines: Sequence[str] = ()) -> Replay:
    """Replay of comparisons, all of scenes of one kind.

    There is one case for each truth with a known motion. Its ghosts are two kinds of runs: all with ``default``
    settings, and for each engine the worst run with other settings, if its error is visible. At first the page shows
    each engine's worst run with ``default`` settings. Colours are those of the page, whose engines are in its order.
    """
    shown_in: dict[str, tuple[ComparedPoint, list[tuple[Outcome, str]]]] = {}
    for outcome in outcomes:
        points = {name: point for name, point in outcome.points.items() if name not in outcome.laws_alone}
        for name, point in points.items():
            if point.reference is not None and np.isfinite(point.reference.dataset["p_WB"]).all():
                shown_in.setdefault(point.case.key, (point, []))[1].append((outcome, name))
    looks = {id(outcome): _looks(outcome, page_engines) for outcome in outcomes}
    digests = {outcome.scene.digest for outcome in outcomes}
    cases, numbers, furthest = [], [], []
    for point, shared in shown_in.values():
        assert point.reference is not None  # only points with a truth are listed
        true = point.reference.dataset["p_WB"].to_numpy()
        ghosts = [
            ghost for outcome, name in shared for ghost in _ghosts(runs_at(outcome, name), looks[id(outcome)], true)
        ]
        ghosts = _chosen(ghosts, kind.seen(point.scene))
        # The comparison with the most runs at this point names the case.
        title = max(shared, key=lambda pair: len(runs_at(*pair)))[0].comparison.title
        label = point_name(point.case.parameters).replace("_", " ").replace("=", " ") or point.scene.title
        replayed = Replayed(
            scene=point.scene,
            true=point.reference.dataset,
            file=point.trajectory.shown,
            ghosts=ghosts,
            group=title,
            label=label,
        )
        content, packed_numbers = case_content(replayed, kind)
        cases.append(content)
        numbers.append(packed_numbers)
        off = max((ghost.distance for ghost in ghosts if np.isfinite(ghost.distance)), default=0.0)
        furthest.append((off, point.scene.digest in digests))
    largest = max(furthest, default=(0.0, False))
    return Replay(three(), furthest.index(largest) if furthest else 0, cases, numbers, largest=largest[0])


def joined(parts: list[Replay]) -> Replay | None:
    """One replay of several kinds of scenes, starting where a ghost is furthest off; None if no part has cases."""
    parts = [part for part in parts if part.cases]
    if not parts:
        return None
    cases, numbers = [case for part in parts for case in part.cases], [item for part in parts for item in part.packed]
    worst = max(parts, key=lambda part: part.largest)
    offset = sum(len(part.cases) for part in parts[: parts.index(worst)])
    return replace(worst, start=offset + worst.start, cases=cases, packed=numbers)


def frame_times(until: float, fastest: float) -> FloatArray:
    """Evenly spaced times of frames [s], shape (n,), close enough for the spin ``fastest`` [rad/s] to look right."""
    turned = until * fastest
    count = max(LEAST_PER_SECOND * until, turned / SMOOTH_TURN, LEAST_FRAMES)
    return np.linspace(0.0, until, 1 + int(np.ceil(max(min(count, MOST_FRAMES), turned / WIDEST_TURN))))


def case_content(replayed: Replayed, kind: ReplayKind) -> tuple[ReplayCase, str]:
    """Description of a truth with its ghosts and their drawing, and their numbers as packed text."""
    numbers, frames, drawn = kind.draw(replayed)
    furthest = {ghost.engine: ghost for ghost in reversed(replayed.ghosts)}  # the one furthest off comes first
    until, whole = numbers["until"], numbers["frames"]
    readings = _readings(replayed, kind, np.linspace(0.0, until, whole), frames, drawn)
    runs = [
        ReplayedRun(name=replayed.solid, colour=-1, shown=True, frames=whole, message="", trajectory=replayed.file),
        *(
            ReplayedRun(
                name=ghost.name,
                colour=ghost.colour,
                shown=furthest[ghost.engine] is ghost,
                frames=count,
                message=ghost.ending(until * (count - 1) / max(1, whole - 1)) if count < whole else "",
                trajectory=ghost.file,
                settings=ghost.settings,
            )
            for ghost, count in zip(replayed.ghosts, frames, strict=True)
        ),
    ]
    case = ReplayCase(
        group=replayed.group,
        label=replayed.label,
        kind=kind.name,
        scene=replayed.scene.title,
        own={**numbers, "readings": readings},
        runs=runs,
        arrays=drawn.arrays,
    )
    return case, packed(bytes(drawn.content))


def _readings(
    replayed: Replayed, kind: ReplayKind, times: FloatArray, counts: list[int], drawn: PackedNumbers
) -> list[dict[str, object]]:
    """Symbol, unit and size of each reading: coordinates of the kind, then the energy, as far as the truth has them.

    Their values go to ``drawn`` as ``reading0``, …: of the truth at ``times`` [s], of each ghost at the first of its
    count of frames, unless the ghost does not give it in full.
    """
    readings: list[dict[str, object]] = []
    motions = [ghost.motion for ghost in replayed.ghosts]
    for name, text in [*kind.readings(replayed.scene)[:_MOST_READINGS], ("energy", "J")]:
        if name not in replayed.true or not np.isfinite(values := replayed.true[name].to_numpy()).all():
            continue
        column = np.interp(times, replayed.true["time"], values)
        furthest = [float(np.nanmax(np.abs(run[name].to_numpy()), initial=0.0)) for run in motions if name in run]
        size = max(float(np.abs(column).max()), *(_PACKED * value for value in furthest if np.isfinite(value)), _LEAST)
        packed_name = f"reading{len(readings)}"
        readings.append({"symbol": symbol(name), "unit": unit(text), "size": size})
        drawn.put(packed_name, 0, column, _ROUNDED * size)
        for number, (ghost, count) in enumerate(zip(replayed.ghosts, counts, strict=True), start=1):
            if name not in ghost.motion:
                continue
            run = ghost.motion[name].to_numpy()
            shifted = on_turns_of(values[: len(run)], run, name, (replayed.true, ghost.motion))
            if shifted is not None and np.isfinite(shifted).all():
                column = np.interp(times[:count], ghost.motion["time"], shifted)
                drawn.put(packed_name, number, column, _ROUNDED * size)
    return readings


def in_sight(off: npt.NDArray[np.bool_]) -> int | None:
    """Number of frames until a thing leaves the picture for good (``off`` from then on); None: all frames."""
    return 1 + int(np.flatnonzero(~off).max(initial=0)) if off[-1] else None


def distance(path: FloatArray, true: FloatArray) -> float:
    """Largest distance between bodies [m], over the samples that both motions have."""
    count = min(len(path), len(true))
    return float(np.linalg.norm(path[:count] - true[:count], axis=-1).max())


def _looks(outcome: Outcome, page_engines: Sequence[str]) -> list[tuple[str, int]]:
    """Name and colour of each row, as in the comparison's figures."""
    rows, _ = reported(outcome)
    return [(name, style.colour) for name, style in zip(names(rows), styles(rows, page_engines), strict=True)]


def _ghosts(
    runs: list[tuple[int, Run, StoredTrajectory]], looks: list[tuple[str, int]], true: FloatArray
) -> list[Ghost]:
    ghosts = []
    for number, run, motion in runs:
        assert run.case is not None  # it has a trajectory
        engine, away = run.case.engine, distance(motion.dataset["p_WB"].to_numpy(), true)
        message = "" if run.result.status == Status.DONE else run.result.message
        name, colour = looks[number]
        ghosts.append(
            Ghost(
                key=run.case.key,
                engine=engine.name,
                settings=engine.settings,
                name=name,
                colour=colour,
                distance=away,
                motion=motion.dataset,
                file=motion.shown,
                message=message,
            )
        )
    return ghosts


def _chosen(ghosts: list[Ghost], seen: float) -> list[Ghost]:
    """Ghosts to show, by engine in the order of the comparisons, the furthest from the truth first; each run once.

    All runs with ``default`` settings, and of each engine the furthest other run, if its distance exceeds ``seen`` [m]
    or the engine has no default run.
    """
    once = {ghost.key: ghost for ghost in reversed(ghosts)}  # the first comparison names it
    chosen = []
    for engine in dict.fromkeys(ghost.engine for ghost in ghosts):
        of_engine = sorted(
            (ghost for ghost in once.values() if ghost.engine == engine), key=lambda ghost: -ghost.distance
        )
        default = [ghost for ghost in of_engine if ghost.default]
        usual = [ghost for ghost in of_engine if not ghost.default][:1]
        chosen += default + [ghost for ghost in usual if ghost.distance > seen or not default]
    return chosen
