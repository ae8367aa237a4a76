"""A declared surface, drawn as a net of its coordinate lines: nothing but what it says of itself is needed."""

from __future__ import annotations

import itertools

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.report.drawings.contact import contact
from proofroll.elements.ball_on_surface.report.drawings.surfaces import SIZE, direction, gravity, overview, right
from proofroll.elements.ball_on_surface.surfaces import Declared
from proofroll.report.labels import symbol
from proofroll.report.pen import Drawing, View

_LINES, _FINE = 13, 61  # lines along each coordinate, and points of each


@overview.register
def net(wall: Declared, body: RollingBall) -> list[Drawing]:
    """The net over the whole domain, the ball at its start, its velocity and the directions of the coordinates."""
    (low, high), (lowest, highest) = wall.domain
    middle = wall.position(wall.places())
    size = 0.5 * float(np.max(np.ptp(middle, axis=0)))
    centre = (middle.min(axis=0) + middle.max(axis=0)) / 2
    drawn, at = Drawing(), View(direction(-62, 32), (0, 0, 1), SIZE / size)

    def line(u1: FloatArray, u2: FloatArray) -> None:
        points = wall.position(np.stack(np.broadcast_arrays(u1, u2), axis=-1))
        looks = np.where(at.towards(wall.normal(points)) > 0, "hidden", "line")  # seen from behind
        cuts = [0, *(1 + np.flatnonzero(looks[1:] != looks[:-1])).tolist(), len(looks) - 1]
        for start, end in itertools.pairwise(cuts):
            if end > start:
                drawn.path(at(points[start : end + 1] - centre), str(looks[start]))

    for value in np.linspace(low, high, _LINES):
        line(np.full(1, value), np.linspace(lowest, highest, _FINE))
    for value in np.linspace(lowest, highest, _LINES):
        line(np.linspace(low, high, _FINE), np.full(1, value))
    start, frame = body.p0 - centre, body.surface.frame(body.u0)
    foot = start + body.ball.radius * frame[:, 0]
    for name, along in zip(body.surface.coordinates, frame[:, 1:].T, strict=True):
        drawn.vector(at([foot, foot + 0.45 * size * along]), "thin", symbol(name), by=14.0)
    speed = float(np.linalg.norm(body.v0))
    if speed:
        drawn.vector(at([start, start + 0.4 * size * body.v0 / speed]), "motion", "v")
    drawn.disc(at(start).tolist(), body.ball.radius * at.scale, "ball")
    gravity(drawn, at, body, at(-1.25 * size * right(at)))
    return [drawn, contact(body, (-0.6, -0.72, 0.36), (0, 0, 1) if abs(frame[2, 0]) < 0.9 else (-1, 0, 0))]
