"""Drawings of a ball with symbols: its contact enlarged, and the whole scene by the kind of its wall."""

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.report.pen import Drawing, View, across, circle, turn

_BALL = 84.0  # radius of the ball [px]
# Shift of the normal force by rolling resistance, in radii; the true one would be invisible.
_SHIFT = 0.3
E1, E2, E3 = np.eye(3)


def contact(body: RollingBall, viewer: tuple[float, float, float], up: tuple[float, float, float]) -> Drawing:
    """Drawing of the ball, enlarged, in its local frame at the start of the motion.

    Args:
        body: the scene's ball; gives the direction of motion, and whether there is rolling resistance.
        viewer: direction towards the viewer, in the frame e1, e2, e3.
        up: direction that is upright in the picture, in the same frame.
    """
    view = View(viewer, up, _BALL)
    drawn = Drawing()
    _wall(drawn, view)
    drawn.disc(view(np.zeros(3)).tolist(), _BALL, "ball")
    drawn.path(view(circle(np.zeros(3), E1, E2, turn(0, 2 * np.pi))), "faint", closed=True)
    _frame(drawn, view)
    _drawn_radius(drawn, view)
    _forces(drawn, view, body)
    return drawn


def _wall(drawn: Drawing, view: View) -> None:
    """Draws a piece of the wall's tangent plane at the contact."""
    corners = [E1 + 1.05 * i * E2 + 1.05 * j * E3 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    drawn.path(view(corners), "wall", closed=True)


def _frame(drawn: Drawing, view: View) -> None:
    """Draws the unit vectors at the centre, and the component of angular velocity about each."""
    for index, axis in enumerate((E1, E2, E3)):
        drawn.vector(view([0 * axis, 1.7 * axis]), "frame", f"e_{index + 1}")
        e_second, e_third = np.roll(E1, index + 1), np.roll(E1, index + 2)
        drawn.arrow(view(circle(1.33 * axis, 0.17 * e_second, 0.17 * e_third, turn(-2.4, 2.4))), "motion")
        drawn.text(_aside(view, 1.33 * axis, axis), f"ω_{index + 1}", "motion-letter")


def _aside(view: View, place: FloatArray, axis: FloatArray) -> FloatArray:
    """Place of a letter beside an axis: right of an upright axis, above any other."""
    a, b = view([0 * axis, axis])
    edge, side = b - a, across(b - a)
    upright = abs(edge[1]) > abs(edge[0])
    side = side * (1 if (side[0] > 0 if upright else side[1] < 0) else -1)
    return np.asarray(view(place) + 27.0 * side + [0.0, 4.5])


def _drawn_radius(drawn: Drawing, view: View) -> None:
    """Draws the radius a, in the widest gap between the other lines."""
    axes = view(np.concatenate([np.eye(3), [-E1, E1 + E2, E1 + E3]])) - view(np.zeros(3))
    taken = np.arctan2(axes[:, 1], axes[:, 0])
    angles = np.linspace(-np.pi, np.pi, 37)
    gaps = np.abs((angles[:, None] - taken + np.pi) % (2 * np.pi) - np.pi).min(axis=1)
    angle = float(angles[np.argmax(gaps)])
    centre, ray = view(np.zeros(3)), np.array([np.cos(angle), np.sin(angle)])
    drawn.arrow(np.stack([centre, centre + _BALL * ray]), "thin")
    drawn.text(centre + 0.55 * _BALL * ray + 11.0 * across(ray), "a", beside=(0.0, 4.5))


def _forces(drawn: Drawing, view: View, body: RollingBall) -> None:
    """Draws N along -e1, and F2 and F3 on the ball at the contact; rolling resistance shifts N forward."""
    drawn.disc(view(E1).tolist(), 2.6, "force-head")
    for axis, letter in ((E2, "F_2"), (E3, "F_3")):
        drawn.vector(view([E1, E1 + 1.05 * axis]), "force", letter, by=13.0)
    f = body.contact.rolling_resistance
    shift = _SHIFT * _forward(body) if f else np.zeros(3)
    drawn.arrow(view([E1 + shift, shift + 0.35 * E1]), "force")
    drawn.text(view(shift + 0.5 * E1), "N", "force-letter", beside=(-9.0, -6.0))
    if f:
        drawn.path(view([E1, E1 + shift]), "force")
        drawn.text(view(E1 + 0.5 * shift), "f", "force-letter", beside=(4.0, 16.0))


def _forward(body: RollingBall) -> FloatArray:
    """Unit direction of the centre's velocity at the start, in the local frame; e2 at rest."""
    local = body.surface.frame(body.u0).T @ body.v0
    speed = float(np.linalg.norm(local))
    return np.asarray(local / speed) if speed else E2


_SIZE = 128.0  # half the width of the drawn part of a wall [px]


def overview(wall: UprightCylinder, body: RollingBall) -> list[Drawing]:
    """Drawings of the cylinder cut open, and of the contact enlarged.

    The first has the axis, radii, the circle of the centre, the ball at its start and later.
    """
    b, surface = wall.radius, body.surface
    drawn, view = Drawing(), View(_direction(-68, 24), (0, 0, 1), _SIZE / b)
    top, bottom, here = 0.62 * b, -1.3 * b, (2.55, -0.72 * b)
    _tube(drawn, view, wall, top, bottom)
    drawn.path(view(surface.position(_ring(turn(0, 2 * np.pi), 0.0))), "hidden", closed=True)
    centre, start, level = (surface.position(u) for u in (here, (0.0, 0.0), (here[0], 0.0)))
    axis = wall.position((0.0, 1.0)) - wall.position((0.0, 0.0))
    drawn.path(view([bottom * axis, top * axis]), "axis")
    drawn.vector(view([top * axis, (top + 0.42 * b) * axis]), "thin", "z", beside=(10.0, 8.0))
    _radius(drawn, view, top * axis, wall.position((-0.9, top)), "b", (12.0, 2.0))
    _radius(drawn, view, np.zeros(3), start, "c = b − a", (0.0, 17.0))
    drawn.path(view([np.zeros(3), level]), "thin")
    arc = view(0.4 * surface.position(_ring(turn(0.0, here[0]), 0.0)))
    drawn.arrow(arc, "thin")
    drawn.text(arc[len(arc) // 2], "γ", beside=(9.0, 8.0))
    drawn.arrow(view([level, centre]), "thin")
    drawn.text(view((level + centre) / 2), "z", beside=(10.0, 4.0))
    radius = body.ball.radius * view.scale
    drawn.disc(view(start).tolist(), radius, "ghost")
    drawn.disc(view(centre).tolist(), radius, "ball")
    ahead = surface.frame((0.0, 0.0))[:, 1]
    drawn.vector(view([start, start + 0.62 * b * ahead]), "motion", "V_0", beside=(2.0, 0.0))
    leader = view(centre) + np.outer([0.0, radius, radius + 20.0], [0.9, 0.44])
    drawn.path(leader, "thin")
    drawn.text(leader[-1], "a", beside=(8.0, 5.0))
    drawn.gravity(view, body.gravity, view(-1.35 * b * view.right))
    return [drawn, contact(body, (-0.6, -0.72, 0.36), (0, 0, 1))]


def _tube(drawn: Drawing, view: View, wall: UprightCylinder, top: float, bottom: float) -> None:
    """Draws rims and outline of a cylinder; the part behind is dashed."""
    round_ = turn(0, 2 * np.pi)
    facing = view.towards(wall.frame(_ring(round_, 0.0))[..., :, 0])
    edges = np.flatnonzero(np.diff(np.sign(facing)))
    rims = [view(wall.position(_ring(round_, z))) for z in (top, bottom)]
    drawn.path(rims[0], "wall", closed=True)
    for edge in edges.tolist():
        angle = float(np.interp(0.0, *_rising(facing[edge : edge + 2], round_[edge : edge + 2])))
        drawn.path(view(wall.position(_ring(np.array([angle, angle]), np.array([top, bottom])))), "line")
    for front, look in ((True, "line"), (False, "hidden")):
        runs = np.flatnonzero((facing >= 0) == front)
        for piece in np.split(runs, np.flatnonzero(np.diff(runs) > 1) + 1):
            if piece.size > 1:
                drawn.path(rims[1][piece], look)


def _rising(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    order = np.argsort(x)
    return x[order], y[order]


def _ring(angles: FloatArray, height: float | FloatArray) -> FloatArray:
    """Coordinates (angle, height) of points around an axis, shape (n, 2)."""
    return np.stack([angles, np.broadcast_to(height, angles.shape)], axis=-1)


def _radius(
    drawn: Drawing, view: View, centre: FloatArray, rim: FloatArray, letter: str, beside: tuple[float, float]
) -> None:
    """Draws an arrow along a radius, and its letter ``beside`` the middle [px]."""
    ends = view([centre, rim])
    drawn.arrow(ends, "thin")
    drawn.text(ends.mean(axis=0) + beside, letter)


def _direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    """Direction towards a viewer at these angles [deg], in the world."""
    az, el = np.radians([azimuth, elevation])
    return float(np.cos(el) * np.cos(az)), float(np.cos(el) * np.sin(az)), float(np.sin(el))
