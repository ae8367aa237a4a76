"""The ball where it touches the wall: its local frame, and the forces on it with their signs. The same for any wall."""

from __future__ import annotations

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.report.pen import Drawing, View, circle, turn

_BALL = 84.0  # radius of the ball [px]
# How far rolling resistance shifts the normal force, in radii: millimetres would not be seen.
_SHIFT = 0.3
E1, E2, E3 = np.eye(3)


def contact(body: RollingBall, viewer: tuple[float, float, float], up: tuple[float, float, float]) -> Drawing:
    """The ball, enlarged, in its local frame at the start of the motion.

    Args:
        body: the scene's ball; of it the direction of gravity, and whether there is rolling resistance, are drawn.
        viewer: direction towards the viewer, in the frame e1, e2, e3.
        up: direction that is upright in the picture, in the same frame.
    """
    at = View(viewer, up, _BALL)
    drawn = Drawing()
    _wall(drawn, at)
    drawn.disc(at(np.zeros(3)).tolist(), _BALL, "ball")
    drawn.path(at(circle(np.zeros(3), E1, E2, turn(0, 2 * np.pi))), "faint", closed=True)
    _frame(drawn, at)
    _radius(drawn, at)
    _forces(drawn, at, body)
    return drawn


def _wall(drawn: Drawing, at: View) -> None:
    """A piece of the wall's tangent plane at the contact."""
    corners = [E1 + 1.05 * i * E2 + 1.05 * j * E3 for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    drawn.path(at(corners), "wall", closed=True)


def _frame(drawn: Drawing, at: View) -> None:
    """Unit vectors at the centre, and the angular velocity that goes with each."""
    for index, axis in enumerate((E1, E2, E3)):
        drawn.vector(at([0 * axis, 1.7 * axis]), "frame", f"e_{index + 1}")
        one, other = np.roll(E1, index + 1), np.roll(E1, index + 2)
        drawn.arrow(at(circle(1.33 * axis, 0.17 * one, 0.17 * other, turn(-2.4, 2.4))), "motion")
        drawn.text(_aside(at, 1.33 * axis, axis, 27.0), f"ω_{index + 1}", "motion-letter")


def _aside(at: View, place: FloatArray, axis: FloatArray, by: float) -> FloatArray:
    """The place of a letter beside an axis: to the right of one that is upright, else above it."""
    a, b = at([0 * axis, axis])
    along = (b - a) / (np.linalg.norm(b - a) or 1.0)
    across = np.array([-along[1], along[0]])
    upright = abs(along[1]) > abs(along[0])
    across = across * (1 if (across[0] > 0 if upright else across[1] < 0) else -1)
    return np.asarray(at(place) + by * across + [0.0, 4.5])


def _radius(drawn: Drawing, at: View) -> None:
    """The radius a, where nothing else is."""
    axes = at(np.concatenate([np.eye(3), [-E1, E1 + E2, E1 + E3]])) - at(np.zeros(3))
    taken = np.arctan2(axes[:, 1], axes[:, 0])
    angles = np.linspace(-np.pi, np.pi, 37)
    gaps = np.abs((angles[:, None] - taken + np.pi) % (2 * np.pi) - np.pi).min(axis=1)
    angle = float(angles[np.argmax(gaps)])
    centre, along = at(np.zeros(3)), np.array([np.cos(angle), np.sin(angle)])
    drawn.arrow(np.stack([centre, centre + _BALL * along]), "thin")
    drawn.text(centre + 0.55 * _BALL * along + 11.0 * np.array([-along[1], along[0]]), "a", beside=(0.0, 4.5))


def _forces(drawn: Drawing, at: View, body: RollingBall) -> None:
    """N against e1, F2 and F3 on the ball at the contact; with rolling resistance N is shifted forward."""
    drawn.disc(at(E1).tolist(), 2.6, "force-head")
    for axis, symbol in ((E2, "F_2"), (E3, "F_3")):
        drawn.vector(at([E1, E1 + 1.05 * axis]), "force", symbol, by=13.0)
    f = body.contact.rolling_resistance
    shift = _SHIFT * _forward(body) if f else np.zeros(3)
    drawn.arrow(at([E1 + shift, shift + 0.35 * E1]), "force")
    drawn.text(at(shift + 0.5 * E1), "N", "force-letter", beside=(-9.0, -6.0))
    if f:
        drawn.path(at([E1, E1 + shift]), "force")
        drawn.text(at(E1 + 0.5 * shift), "f", "force-letter", beside=(4.0, 16.0))


def _forward(body: RollingBall) -> FloatArray:
    """Unit direction of the centre's velocity at the start, in the local frame; e2 where it stands still."""
    local = body.surface.frame(body.u0).T @ body.v0
    speed = float(np.linalg.norm(local))
    return np.asarray(local / speed) if speed else E2
