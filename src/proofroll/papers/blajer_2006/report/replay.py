"""Replay of balls on surfaces: the wall, the balls, and the contact force."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, hermite
from proofroll.core.events import EventKind
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.stretches import carried
from proofroll.files.json_data import plain
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.report.replay.records import PackedNumbers, Replayed, present
from proofroll.report.replay.replay import frame_times, in_sight

# Divisions of a periodic coordinate, and number of divisions between drawn lines (30 degrees).
_ROUND, _ROUND_LINES = 72, 6
# Largest number of lines along a coordinate without a period; they are far enough apart for the ball to be near one.
_MOST_LINES = 100
# Margin of the wall beyond the path, in radii of the ball.
_MARGIN = 3.0


@dataclass(frozen=True)
class Wall:
    """Grid of points on the wall.

    Attributes:
        points: position [m], shape (rows, columns, 3): along the first coordinate in a row, along the second in a
            column.
        normals: e1 there, shape (rows, columns, 3).
        lines: number of rows, and of columns, from one drawn line to the next.
    """

    points: FloatArray
    normals: FloatArray
    lines: tuple[int, int]


def wall(body: RollingBall, u: FloatArray) -> Wall:
    """Grid of the wall around a path.

    Args:
        body: the scene's ball.
        u: the path in the surface's coordinates, shape (n, 2).
    """
    # Coordinates of the wall and of the centre's surface may differ at opposite points.
    u = body.wall.locate(body.surface.position(u))
    grids: list[npt.NDArray[np.floating]] = []
    every = []
    for column, (period, scale) in enumerate(zip(body.surface.periods, body.surface.length_scales, strict=True)):
        if period is not None:
            grids.append(np.arange(_ROUND + 1) * np.float64(period / _ROUND))
            every.append(_ROUND_LINES)
            continue
        margin = _MARGIN * body.ball.radius / scale
        low, high = float(u[:, column].min()) - margin, float(u[:, column].max()) + margin
        step = _round_step(max(2 * body.ball.radius / scale, (high - low) / _MOST_LINES))
        grids.append(np.arange(math.floor(low / step), math.ceil(high / step) + 1) * step)
        every.append(1)
    grid = np.stack(np.meshgrid(*grids, indexing="xy"), axis=-1)
    points = body.wall.position(grid)
    return Wall(points, body.wall.normal(points), (every[1], every[0]))


def middle(body: RollingBall, u: FloatArray) -> FloatArray:
    """Camera targets for the points of a path [m], shape (n, 3): on the axis of a closed surface.

    Args:
        body: the scene's ball.
        u: the path in the surface's coordinates, shape (n, 2).
    """
    turns = [np.arange(4) * period / 4 if period is not None else np.zeros(1) for period in body.surface.periods]
    shifts = np.stack(np.meshgrid(*turns), axis=-1).reshape(-1, 2)
    return np.asarray(body.surface.position(u[:, None] + shifts).mean(axis=1))


def _round_step(least: float) -> float:
    """Smallest of 1, 2 and 5 times a power of ten that is at least ``least``."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1, 2, 5, 10) if factor * power >= least * (1 - 1e-9))


# Variables of a trajectory by name, "time" included.
Sampled = Mapping[str, npt.NDArray[Any]]
# Names of the variables that a replay uses, if present.
_MOTION = ("p_WB", "v_WB", "w_WB", "q_WB")
NEEDED = ("time", *_MOTION, "N", "F2", "F3", "event_kind", "event_time")

# Steps of the quadrature of the spin from one sample to the next; with 1.3 rad between samples its error is below
# 1e-5 rad.
_SUBSTEPS = 4

# Rounding of the picture's numbers, powers of two: 8e-6 m, 6e-5 of a quaternion, 1e-3 N; all invisible.
LENGTH, TURN, FORCE = 2.0**-17, 2.0**-14, 2.0**-10
# Distance from the true ball, in lengths of the scene, beyond which a ball has left the picture.
_FAR = 20.0
# Largest invisible error, in radii of the ball.
_SEEN = 0.01
# Speed of the replay relative to real time: at full speed a rolling ball turns too fast for the eye.
_SPEED = 0.1
# Angles of the camera, about the vertical and above the horizon [rad].
_FROM = (-1.15, 0.5)

SLIPS, STICKS, AWAY = 0, 1, 2
_AFTER: Mapping[str, int] = {
    EventKind.SLIP: SLIPS,
    EventKind.STICK: STICKS,
    EventKind.REST: STICKS,
    EventKind.IMPACT: STICKS,
    EventKind.LIFT_OFF: AWAY,
}


@dataclass(frozen=True)
class Poses:
    """Poses of a ball at n frames.

    Attributes:
        time: of the frames [s], shape (n,).
        p_WB: centre [m], shape (n, 3).
        q_WB: orientation, scalar first, shape (n, 4); None: unknown.
        contact: point of the wall's surface that the ball touches or is nearest to [m], shape (n, 3).
        normal: e1, from the ball towards the wall, shape (n, 3).
        press: normal force N [N], shape (n,); None: not reported.
        friction: F2 e2 + F3 e3, on the ball, in the world [N], shape (n, 3), or None.
        state: SLIPS, STICKS or AWAY, shape (n,); None: unknown.
    """

    time: FloatArray
    p_WB: FloatArray
    q_WB: FloatArray | None
    contact: FloatArray
    normal: FloatArray
    press: FloatArray | None
    friction: FloatArray | None
    state: npt.NDArray[np.uint8] | None


def poses(body: RollingBall, sampled: Sampled, times: FloatArray) -> Poses:
    """Poses of a ball at the frames up to the end of its trajectory.

    Args:
        body: the scene's ball.
        sampled: samples of those of the variables :data:`NEEDED` that the trajectory has.
        times: of the frames [s], rising from 0.
    """
    grid = sampled["time"]
    if grid.size < 2:  # it ended before its first step
        times, p_WB = times[:1], sampled["p_WB"][:1]
    else:
        times = times[times <= grid[-1] * (1 + 1e-12)]
        p_WB = hermite(grid, sampled["p_WB"], sampled["v_WB"], times)
    normal = body.surface.normal(p_WB)
    friction = press = None
    if "N" in sampled:
        press, F2, F3 = (np.interp(times, grid, sampled[name]) for name in ("N", "F2", "F3"))
        frame = body.surface.frame(body.surface.locate(p_WB))
        friction = F2[:, None] * frame[..., 1] + F3[:, None] * frame[..., 2]
    return Poses(
        time=times,
        p_WB=p_WB,
        q_WB=_orientation(sampled, times),
        contact=p_WB + (body.ball.radius + body.surface.gap(p_WB))[:, None] * normal,
        normal=normal,
        press=press,
        friction=friction,
        state=None if np.isinf(body.contact.mu_static) else _state(sampled, times),  # it always sticks
    )


def _state(sampled: Sampled, times: FloatArray) -> npt.NDArray[np.uint8] | None:
    """State of the contact at each frame, from the events, whose times are finer than the samples; None: unknown."""
    if "event_kind" not in sampled:
        return None
    events = [(_AFTER[kind], time) for kind, time in _events(sampled) if kind in _AFTER]
    slips = bool(events) and events[0][0] == STICKS  # what sticks first has slipped
    state = np.full(times.shape, SLIPS if slips else STICKS, dtype=np.uint8)
    for after, time in events:
        state[times >= time] = after  # never at NaN
    return state


def _orientation(sampled: Sampled, times: FloatArray) -> FloatArray | None:
    """Orientation at each frame, moved from the sample before by the ball's own spin, shape (n, 4); None: unknown."""
    from scipy.spatial.transform import Rotation

    if "q_WB" not in sampled:
        return None
    grid, w_WB, stored = sampled["time"], sampled["w_WB"], Rotation.from_quat(sampled["q_WB"], scalar_first=True)
    if times.size < 2:
        return np.asarray(sampled["q_WB"][:1])
    # The turn between two samples that the spin does not explain is shared out evenly.
    unexplained = (carried(stored[:-1], grid, w_WB, _SUBSTEPS).inv() * stored[1:]).as_rotvec()
    index = np.clip(np.searchsorted(grid, times, side="right") - 1, 0, grid.size - 2)
    part = (times - grid[index]) / np.diff(grid)[index]
    turned = carried(stored[index], grid, w_WB, _SUBSTEPS, (grid[index], times))
    turned *= Rotation.from_rotvec(part[:, None] * unexplained[index])
    return np.asarray(turned.as_quat(scalar_first=True))


def seen(scene: Scene) -> float:
    """Largest invisible error of a ball's place [m]."""
    return _SEEN * rolling_ball(scene).ball.radius


def readings(scene: Scene) -> list[tuple[str, str]]:
    """Names and units of the coordinates listed beside the picture: those of the wall."""
    surface = rolling_ball(scene).surface
    return list(zip(surface.coordinates, surface.units, strict=True))


def draw_ball(replayed: Replayed) -> tuple[dict[str, Any], list[int], PackedNumbers]:
    """Drawing of a ball in the replay: see :data:`proofroll.report.replay.records.Drawer`."""
    body = rolling_ball(replayed.scene)
    coordinates = body.surface.coordinates
    sampled = _of_ball(present(replayed.true, [*NEEDED, *coordinates]))
    times = frame_times(float(sampled["time"][-1]), float(np.linalg.norm(sampled["w_WB"], axis=1).max()))
    true = poses(body, sampled, times)
    motions = [_of_ball(present(ghost.motion, NEEDED)) for ghost in replayed.ghosts]
    ghosts = [_reachable(poses(body, motion, times), true, body) for motion in motions]
    u = np.stack([np.interp(times, sampled["time"], sampled[name]) for name in coordinates], axis=1)
    built = wall(body, u)
    numbers = PackedNumbers()
    numbers.put("points", -1, built.points.reshape(-1, 3), LENGTH)
    numbers.put("outward", -1, built.normals.reshape(-1, 3), TURN)
    numbers.put("middle", -1, middle(body, u), LENGTH)
    numbers.put("contact", 0, true.contact, LENGTH)
    numbers.put("normal", 0, true.normal, TURN)
    numbers.put("friction", 0, true.friction, FORCE)
    for run, shown in enumerate([true, *ghosts]):
        numbers.put("p", run, shown.p_WB, LENGTH)
        numbers.put("q", run, shown.q_WB, TURN)
        numbers.put("press", run, shown.press, FORCE)
        numbers.put("pull", run, None if shown.friction is None else np.linalg.norm(shown.friction, axis=1), FORCE)
        numbers.put("state", run, None if shown.state is None else shown.state.astype(np.float64), 1.0)
    contact = body.contact
    case = {
        "until": float(times[-1]),
        "frames": times.size,
        "speed": _SPEED,
        "from": list(_FROM),
        "tail": 0.4,
        "least": 0.1,
        "off": "distance of its centre from the true ball's",
        "scale": body.ball.radius,
        "friction": plain({"static": contact.mu_static, "kinetic": contact.mu_kinetic}),
        "events": [{"kind": kind, "time": plain(time)} for kind, time in _events(sampled)],
        "wall": {"rows": len(built.points), "columns": built.points.shape[1], "lines": list(built.lines)},
    }
    return case, [shown.time.size for shown in ghosts], numbers


def _of_ball(sampled: Sampled) -> Sampled:
    """Samples of a ball, from those of a mechanism with one body, too."""
    return {name: values[:, 0] if name in _MOTION and values.ndim > 2 else values for name, values in sampled.items()}


def _events(sampled: Sampled) -> list[tuple[str, float]]:
    """Kind and time [s] of each event."""
    kinds = [kind.decode() if isinstance(kind, bytes) else str(kind) for kind in sampled.get("event_kind", ())]
    return list(zip(kinds, np.asarray(sampled.get("event_time", ())).tolist(), strict=True))


def _reachable(shown: Poses, true: Poses, body: RollingBall) -> Poses:
    """Frames until a ball leaves the picture for good: unbounded coordinates would make the picture useless."""
    centre = true.p_WB.mean(axis=0)
    size = float(np.linalg.norm(true.p_WB - centre, axis=1).max()) + body.ball.radius
    last = in_sight(np.linalg.norm(shown.p_WB - centre, axis=1) > _FAR * size)
    kept: dict[str, Any] = {name: None if values is None else values[:last] for name, values in vars(shown).items()}
    return dataclasses.replace(shown, **kept)
