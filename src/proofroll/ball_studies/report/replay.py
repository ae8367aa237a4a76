"""Balls on surfaces in the replay: the wall, the balls, what presses between them."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.ball_studies.report.poses import NEEDED, Poses, Sampled, poses
from proofroll.ball_studies.report.wall import middle, wall
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.files.json_data import plain
from proofroll.report.labels import symbol, unit
from proofroll.report.replay.records import PackedNumbers, Replayed, some
from proofroll.report.replay.replay import frame_times, in_sight

# What the numbers of the picture are rounded to, powers of two: 8e-6 m, 6e-5 of a quaternion, 1e-3 N. None is seen.
LENGTH, TURN, FORCE = 2.0**-17, 2.0**-14, 2.0**-10
# A ball that is further from the true one than this many lengths of the scene has left the picture.
_FAR = 20.0
# What is off by less than this part of the ball's radius looks right.
_SEEN = 0.01
# Over real time: a ball that rolls turns too fast for the eye at full speed.
_SPEED = 0.1
# Where the camera stands: about the vertical and above the horizon [rad].
_FROM = (-1.15, 0.5)


def seen(scene: Scene) -> float:
    """Largest invisible error of a ball's place [m]."""
    return _SEEN * rolling_ball(scene).ball.radius


def drawn(replayed: Replayed) -> tuple[dict[str, Any], list[int], PackedNumbers]:
    """Drawing of a ball in the replay: see :data:`proofroll.report.replay.records.Drawer`."""
    body = rolling_ball(replayed.scene)
    coordinates = body.surface.coordinates
    sampled = some(replayed.true, [*NEEDED, *coordinates])
    times = frame_times(float(sampled["time"][-1]), float(np.linalg.norm(sampled["w_WB"], axis=1).max()))
    true = poses(body, sampled, times)
    ghosts = [_reachable(poses(body, some(ghost.motion, NEEDED), times), true, body) for ghost in replayed.ghosts]
    u = np.stack([np.interp(times, sampled["time"], sampled[name]) for name in coordinates], axis=1)
    built = wall(body, u)
    numbers = PackedNumbers()
    numbers.put("points", -1, built.points.reshape(-1, 3), LENGTH)
    numbers.put("outward", -1, built.normals.reshape(-1, 3), TURN)
    numbers.put("middle", -1, middle(body, u), LENGTH)
    numbers.put("coordinates", 0, u, LENGTH)
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
        "coordinates": [
            {"symbol": symbol(name), "unit": unit(text)}
            for name, text in zip(coordinates, body.surface.units, strict=True)
        ],
        "events": _events(sampled),
        "wall": {"rows": len(built.points), "columns": built.points.shape[1], "lines": list(built.lines)},
    }
    return case, [shown.time.size for shown in ghosts], numbers


def _events(sampled: Sampled) -> list[dict[str, Any]]:
    kinds = [kind.decode() if isinstance(kind, bytes) else str(kind) for kind in sampled.get("event_kind", ())]
    times = np.asarray(sampled.get("event_time", ())).tolist()
    return [{"kind": kind, "time": plain(time)} for kind, time in zip(kinds, times, strict=True)]


def _reachable(shown: Poses, true: Poses, body: RollingBall) -> Poses:
    """The frames until a ball leaves the picture for good: coordinates that grow without bound draw nothing."""
    centre = true.p_WB.mean(axis=0)
    size = float(np.linalg.norm(true.p_WB - centre, axis=1).max()) + body.ball.radius
    last = in_sight(np.linalg.norm(shown.p_WB - centre, axis=1) > _FAR * size)
    kept: dict[str, Any] = {name: None if values is None else values[:last] for name, values in vars(shown).items()}
    return dataclasses.replace(shown, **kept)
