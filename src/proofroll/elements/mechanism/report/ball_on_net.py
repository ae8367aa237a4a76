"""Drawing of a ball on a curved wall: the wall as a net of coordinate lines, the ball at its start, its velocity."""

import itertools
import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.walls import BowlWall, ConeWall, CurvedWall, DeclaredWall, TorusWall
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.report.labels import symbol
from proofroll.report.pen import Drawing, View, unit

_SIZE = 128.0  # half the width of the drawn part of the wall [px]
_LINES, _FINE = 13, 61  # lines of the net along each coordinate, and points of each
_VIEWER = unit(np.array([math.cos(math.radians(-62)), math.sin(math.radians(-62)), math.tan(math.radians(32))]))
_WHOLE, _FAR = (-math.pi, math.pi), 1.6  # a turn; length of a wall without an end, over the way to the ball

Domain = tuple[tuple[float, float], tuple[float, float]]


class Net(Protocol):
    """A surface with coordinates."""

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """Its points [m], shape (..., 3)."""

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Unit normals out of the ball, shape (..., 3)."""


def ball_on_net(element: MechanismElement) -> Drawing | None:
    """Drawing of an element that is described in the local frame of a curved wall; None for any other."""
    body, mechanism = element.on_wall, element.mechanism
    if body is None:
        return None
    contact = mechanism.contacts[body.contact_index]
    carrier, wall = (contact.body_b, contact.shape_b) if body.sign > 0 else (contact.body_a, contact.shape_a)
    if not isinstance(wall, CurvedWall | DeclaredWall):
        return None
    motion, number = Tree(mechanism).at(*mechanism.start()), mechanism.body_index[carrier]
    frame = body.surface.frame(body.u0)
    p0 = motion.p_WB[body.index]
    foot = p0 + body.ball.radius * frame[:, 0]
    net: Net
    if isinstance(wall, DeclaredWall):
        net, domain = wall.surface, wall.surface.domain
    else:
        net = wall_coordinates(wall, 0.0, motion.R_WB[number], motion.p_WB[number])
        domain = _domain(wall, float(np.linalg.norm(foot - motion.p_WB[number] - motion.R_WB[number] @ wall.point)))
    (low, high), (lowest, highest) = domain
    grid = np.stack(np.meshgrid(np.linspace(low, high, _FINE), np.linspace(lowest, highest, _FINE)), axis=-1)
    middle = net.position(grid.reshape(-1, 2))
    size = 0.5 * float(np.max(np.ptp(middle, axis=0)))
    centre = (middle.min(axis=0) + middle.max(axis=0)) / 2
    picture, view = Drawing(), View(_VIEWER, (0, 0, 1), _SIZE / size)

    def line(u1: FloatArray, u2: FloatArray) -> None:
        points = net.position(np.stack(np.broadcast_arrays(u1, u2), axis=-1))
        looks = np.where(view.towards(net.normal(points)) > 0, "hidden", "line")  # seen from behind
        cuts = [0, *(1 + np.flatnonzero(looks[1:] != looks[:-1])).tolist(), len(looks) - 1]
        for start, end in itertools.pairwise(cuts):
            if end > start:
                picture.path(view(points[start : end + 1] - centre), str(looks[start]))

    for value in np.linspace(low, high, _LINES):
        line(np.full(1, value), np.linspace(lowest, highest, _FINE))
    for value in np.linspace(lowest, highest, _LINES):
        line(np.linspace(low, high, _FINE), np.full(1, value))
    for name, tangent in zip(body.surface.coordinates, frame[:, 1:].T, strict=True):
        picture.vector(view([foot - centre, foot - centre + 0.45 * size * tangent]), "thin", symbol(name), by=14.0)
    speed = float(np.linalg.norm(body.v0))
    if speed:
        picture.vector(view([p0 - centre, p0 - centre + 0.4 * size * body.v0 / speed]), "motion", "v")
    picture.disc(view(p0 - centre).tolist(), body.ball.radius * view.scale, "ball")
    picture.gravity(view, body.gravity, view(-1.25 * size * view.right))
    return picture


def _domain(wall: CurvedWall, away: float) -> Domain:
    """Coordinates of the drawn part of a wall; ``away``: of the ball from its origin [m]."""
    match wall:
        case BowlWall():
            equator = 2 * wall.radius
            return (-equator, equator), (-equator, equator)
        case ConeWall():
            return _WHOLE, (0.05 * away, _FAR * away)
        case TorusWall():
            return _WHOLE, _WHOLE
    return _WHOLE, (-_FAR * away, _FAR * away)
