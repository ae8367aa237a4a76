"""The replay: which cases and which balls it shows, and their poses packed for the page."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.report.poses import NEEDED, Poses, Sampled, frame_times, poses
from proofroll.elements.ball_on_surface.report.wall import middle, wall
from proofroll.files.json_data import plain
from proofroll.files.netcdf import read_some
from proofroll.files.scene_file import load_scene
from proofroll.report.comparison_content import by_row, outcome_content
from proofroll.report.labels import names, symbol, unit
from proofroll.report.replay_library import packed, thinned, three
from proofroll.report.styles import styles
from proofroll.running.case import Case, Status
from proofroll.running.store import Store
from proofroll.studies.compare import Outcome, Run
from proofroll.studies.planning import point_name

# What the numbers of the picture are rounded to, powers of two: 8e-6 m, 6e-5 of a quaternion, 1e-3 N. None is seen.
LENGTH, TURN, FORCE = 2.0**-17, 2.0**-14, 2.0**-10
# A ball that is further from the true one than this many lengths of the scene has left the picture.
_FAR = 20.0
# What is off by less than this part of the ball's radius looks right.
SEEN = 0.01


@dataclasses.dataclass(frozen=True)
class _Ghost:
    """A run that can be shown beside the truth.

    Attributes:
        run: the run.
        name, colour: as in the figures of its comparison.
        distance: of its path from the true one, at most [m].
    """

    run: Run
    name: str
    colour: int
    distance: float

    @property
    def engine(self) -> str:
        """Name of the engine."""
        assert self.run.facts is not None  # it ran
        return self.run.facts.name

    @property
    def default(self) -> bool:
        """Whether it is what a user gets by writing the obvious model."""
        assert self.run.facts is not None  # it ran
        return self.run.facts.settings.get("preset") == "default"


def replay_content(outcomes: list[Outcome], store: Store) -> dict[str, Any]:
    """Everything that the replay draws, as plain data.

    There is one case for each truth of the comparisons. Its ghosts are what the engines make of it with ``default``
    settings, and of each engine the other setting whose path is furthest from the true one, if that is seen. At first,
    of each engine the ``default`` one is shown that is furthest off.

    Returns:
        ``library``: from :func:`proofroll.report.replay_library.three`; ``start``: number of the case to begin with;
        ``cases``: names, settings and, as ``arrays``, what lies in the numbers in this order: name, number of the
        ball or -1, width, length, step (:func:`proofroll.report.replay_library.thinned`); ``packed``: the numbers of
        each case.
    """
    found: dict[str, tuple[Case, list[tuple[Outcome, str]]]] = {}
    for outcome in outcomes:
        for point, case in outcome.truths.items():
            if store.trajectory(case).is_file():
                found.setdefault(case.key, (case, []))[1].append((outcome, point))
    looks = {id(outcome): _looks(outcome) for outcome in outcomes}
    made = [_case(case, shared, looks, store) for case, shared in found.values()]
    plainest = [load_scene(case.scene).digest == case.scene_digest for case, _ in found.values()]
    return {
        "library": three(),
        "start": plainest.index(True) if any(plainest) else 0,
        "cases": [case for case, _ in made],
        "packed": [packed(numbers) for _, numbers in made],
    }


def _case(
    case: Case, shared: list[tuple[Outcome, str]], looks: dict[int, list[tuple[str, int]]], store: Store
) -> tuple[dict[str, Any], bytes]:
    """What a case is called and holds, and its numbers."""
    scene = load_scene(case.scene, **case.parameters)
    body = rolling_ball(scene)
    coordinates = body.surface.coordinates
    sampled = read_some(store.trajectory(case), [*NEEDED, *coordinates])
    # The comparison that has most to show at this point names the case.
    title = max(shared, key=lambda pair: len(_runs(pair[0], pair[1], store)))[0].comparison.title
    ghosts = _chosen(
        [
            ghost
            for outcome, point in shared
            for ghost in _ghosts(_runs(outcome, point, store), looks[id(outcome)], sampled["p_WB"], store)
        ],
        SEEN * body.ball.radius,
    )
    first = {ghost.engine: ghost for ghost in reversed(ghosts)}  # the one furthest off comes first
    times = frame_times(sampled)
    true = poses(body, sampled, times, integrate=True)
    drawn = [
        _reachable(poses(body, read_some(_file(ghost.run, store), list(NEEDED)), times), true, body) for ghost in ghosts
    ]
    u = np.stack([np.interp(times, sampled["time"], sampled[name]) for name in coordinates], axis=1)
    built = wall(body, u)
    arrays: list[tuple[str, int, int, int, float]] = []
    content = bytearray()

    def put(name: str, ball: int, values: FloatArray | None, step: float) -> None:
        if values is not None:
            rows = values.reshape(len(values), -1)
            arrays.append((name, ball, rows.shape[1], len(rows), step))
            content.extend(thinned(rows, step))

    put("points", -1, built.points.reshape(-1, 3), LENGTH)
    put("outward", -1, built.normals.reshape(-1, 3), TURN)
    put("middle", -1, middle(body, u), LENGTH)
    put("coordinates", 0, u, LENGTH)
    put("contact", 0, true.contact, LENGTH)
    put("normal", 0, true.normal, TURN)
    put("friction", 0, true.friction, FORCE)
    for ball, shown in enumerate([true, *drawn]):
        put("p", ball, shown.p_WB, LENGTH)
        put("q", ball, shown.q_WB, TURN)
        put("press", ball, shown.press, FORCE)
        put("pull", ball, None if shown.friction is None else np.linalg.norm(shown.friction, axis=1), FORCE)
        put("state", ball, None if shown.state is None else shown.state.astype(np.float64), 1.0)
    contact = body.contact
    case_content = {
        "group": title,
        "label": point_name(case.parameters) or scene.title,
        "scene": scene.title,
        "until": float(times[-1]),
        "frames": times.size,
        "radius": body.ball.radius,
        "friction": plain({"static": contact.mu_static, "kinetic": contact.mu_kinetic}),
        "coordinates": [
            {"symbol": symbol(name), "unit": unit(text)}
            for name, text in zip(coordinates, body.surface.units, strict=True)
        ],
        "events": _events(sampled),
        "wall": {"rows": len(built.points), "columns": built.points.shape[1], "lines": list(built.lines)},
        "balls": [
            {"name": "truth", "colour": -1, "shown": True, "frames": times.size, "message": "",
             "trajectory": f"{store.folder.name}/{store.trajectory(case).name}"},
            *(
                {"name": ghost.name, "colour": ghost.colour, "shown": first[ghost.engine] is ghost,
                 "frames": shown.time.size, "message": _ending(ghost.run, shown, times),
                 "trajectory": f"{store.folder.name}/{ghost.run.result.trajectory}",
                 "settings": plain(_settings(ghost.run))}
                for ghost, shown in zip(ghosts, drawn, strict=True)
            ),
        ],
        "arrays": arrays,
    }  # fmt: skip
    return case_content, bytes(content)


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
    rows = outcome_content(outcome)["rows"]
    return [(name, style["colour"]) for name, style in zip(names(rows), styles(rows), strict=True)]


def _ghosts(runs: list[tuple[int, Run]], looks: list[tuple[str, int]], true: FloatArray, store: Store) -> list[_Ghost]:
    ghosts = []
    for number, run in runs:
        path = read_some(_file(run, store), ["p_WB"])["p_WB"]
        count = min(len(path), len(true))  # a run that ended early has fewer samples
        distance = float(np.linalg.norm(path[:count] - true[:count], axis=1).max())
        ghosts.append(_Ghost(run, *looks[number], distance))
    return ghosts


def _chosen(ghosts: list[_Ghost], seen: float) -> list[_Ghost]:
    """By engine in the order of the comparisons, the furthest from the truth first; each run once.

    All that are ``default``, and of the others the furthest, if it is off by more than ``seen`` [m] or there is none.
    """
    once = {_key(ghost.run): ghost for ghost in reversed(ghosts)}  # the first comparison's name stays
    chosen = []
    for engine in dict.fromkeys(ghost.engine for ghost in ghosts):
        own = sorted((ghost for ghost in once.values() if ghost.engine == engine), key=lambda ghost: -ghost.distance)
        default = [ghost for ghost in own if ghost.default]
        other = [ghost for ghost in own if not ghost.default][:1]
        chosen += default + [ghost for ghost in other if ghost.distance > seen or not default]
    return chosen


def _events(sampled: Sampled) -> list[dict[str, Any]]:
    kinds = [kind.decode() if isinstance(kind, bytes) else str(kind) for kind in sampled.get("event_kind", ())]
    times = np.asarray(sampled.get("event_time", ())).tolist()
    return [{"kind": kind, "time": plain(time)} for kind, time in zip(kinds, times, strict=True)]


def _reachable(shown: Poses, true: Poses, body: RollingBall) -> Poses:
    """The frames until a ball leaves the picture for good: coordinates that grow without bound draw nothing."""
    centre = true.p_WB.mean(axis=0)
    size = float(np.linalg.norm(true.p_WB - centre, axis=1).max()) + body.ball.radius
    far = np.linalg.norm(shown.p_WB - centre, axis=1) > _FAR * size
    if not far[-1]:
        return shown
    last = 1 + int(np.flatnonzero(~far).max(initial=0))
    kept: dict[str, Any] = {name: None if values is None else values[:last] for name, values in vars(shown).items()}
    return dataclasses.replace(shown, **kept)


def _ending(run: Run, shown: Poses, times: FloatArray) -> str:
    """Why a ghost is not there until the end, or nothing."""
    if shown.time.size == times.size:
        return ""
    reason = "it leaves the picture" if run.result.status == Status.DONE else run.result.message
    return f"until {shown.time[-1]:.3g} s: {reason}"


def _settings(run: Run) -> dict[str, Any]:
    return run.facts.settings if run.facts else {}


def _key(run: Run) -> str:
    assert run.case is not None  # it has a trajectory
    return run.case.key


def _file(run: Run, store: Store) -> Path:
    assert run.case is not None  # it has a trajectory
    return store.trajectory(run.case)
