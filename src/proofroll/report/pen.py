"""Drawings of lines, arrows and letters: from points in space to marks of an SVG picture."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray

# Points along a whole circle, enough to look smooth on a screen.
_ROUND = 72
_HEAD = 8.0  # length of an arrow's head [px]
_LETTER = 8.0  # width of a letter [px]
_MARGIN = 4.0  # around a drawing [px]
_GRAVITY = 44.0  # length of the arrow of gravity [px]


@dataclass(frozen=True)
class View:
    """A parallel projection.

    Attributes:
        viewer: direction towards the viewer, any length, shape (3,).
        up: direction that is upright in the picture, any length, shape (3,).
        scale: pixels per metre.
    """

    viewer: npt.ArrayLike
    up: npt.ArrayLike
    scale: float

    def __call__(self, point: npt.ArrayLike) -> FloatArray:
        """Positions of points in the picture [px], shape (..., 2): y downwards, the origin at (0, 0)."""
        right = self.right
        upright = np.cross(unit(self.viewer), right)
        p = np.asarray(point, dtype=np.float64)
        return np.stack([self.scale * p @ right, -self.scale * p @ upright], axis=-1)

    @property
    def right(self) -> FloatArray:
        """Unit direction in space that points to the right in the picture, shape (3,)."""
        return unit(np.cross(np.asarray(self.up, dtype=np.float64), unit(self.viewer)))

    def towards(self, direction: npt.ArrayLike) -> FloatArray:
        """Component of a direction towards the viewer, shape (...)."""
        return np.asarray(np.asarray(direction, dtype=np.float64) @ unit(self.viewer))


@dataclass(frozen=True)
class Polyline:
    """A line through places of the picture [px], closed or not."""

    points: list[list[float]]
    closed: bool
    look: str


@dataclass(frozen=True)
class Disc:
    """A circle of the picture [px]."""

    centre: list[float]
    radius: float
    look: str


@dataclass(frozen=True)
class Letters:
    """Part of a lettering: plain letters, or an index (``sub``)."""

    text: str
    sub: bool


@dataclass(frozen=True)
class Lettering:
    """Letters centred at a place of the picture [px]."""

    x: float
    y: float
    parts: list[Letters]
    look: str


@dataclass(frozen=True)
class Picture:
    """A finished picture: marks in drawing order; ``box``: x, y, width and height around all of them [px]."""

    box: list[float]
    marks: list[Polyline | Disc | Lettering]
    label: str


@dataclass
class Drawing:
    """A picture in the making.

    ``look`` of a mark is the name of its style: ``line``, ``thin``, ``hidden``, ``axis``, ``wall``, ``ball``,
    ``ghost``, ``faint``, ``motion``, ``force``, ``frame``, the same with ``-head`` for the filled heads of arrows, and
    ``letter``, ``motion-letter``, ….
    """

    marks: list[Polyline | Disc | Lettering] = field(default_factory=list)
    _bounds: list[FloatArray] = field(default_factory=list)

    @property
    def box(self) -> list[float]:
        """x, y, width and height around all marks so far [px]."""
        places = np.concatenate(self._bounds)
        low, high = np.floor(places.min(axis=0)) - _MARGIN, np.ceil(places.max(axis=0)) + _MARGIN
        return [*low.tolist(), *(high - low).tolist()]

    def picture(self, label: str) -> Picture:
        """Finished picture; ``label`` describes it."""
        return Picture(self.box, self.marks, label)

    def path(self, points: npt.ArrayLike, look: str, closed: bool = False) -> None:
        """Draws a line through places of the picture, shape (n, 2)."""
        places = np.asarray(points, dtype=np.float64)
        self._bounds.append(places)
        self.marks.append(Polyline(np.round(places, 1).tolist(), closed, look))

    def disc(self, centre: Sequence[float], radius: float, look: str) -> None:
        """Draws a circle in the plane of the picture, for example the outline of a ball."""
        (x, y), r = centre, radius
        self._bounds.append(np.array([[x - r, y - r], [x + r, y + r]]))
        self.marks.append(Disc([round(x, 1), round(y, 1)], round(r, 1), look))

    def arrow(self, points: npt.ArrayLike, look: str) -> None:
        """Draws an arrow along a line through places of the picture, straight or curved, shape (n, 2)."""
        places = np.asarray(points, dtype=np.float64)
        self.path(places, look)
        tip = places[-1]
        direction = unit(tip - places[-2])
        side = 0.36 * across(direction)
        self.path(
            [tip, tip - _HEAD * (direction + side), tip - _HEAD * (direction - side)], f"{look}-head", closed=True
        )

    def vector(
        self, ends: npt.ArrayLike, look: str, name: str, by: float = 11.0, beside: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Draws a straight arrow between two points, shape (2, 2), with its name ``by`` pixels past the tip."""
        self.arrow(ends, look)
        a, b = np.asarray(ends, dtype=np.float64)
        letters = "letter" if look == "thin" else f"{look}-letter"
        self.text(b + by * unit(b - a) + [0.0, 4.5], name, letters, beside)

    def gravity(self, view: View, gravity: FloatArray, place: npt.ArrayLike) -> None:
        """Draws the direction of gravity [m/s²], shape (3,), at a place of the picture; nothing without gravity."""
        if np.any(gravity):
            self.vector(np.asarray(place) + np.outer([0.0, _GRAVITY], unit(view(gravity))), "force", "g")

    def covers(self, place: npt.ArrayLike, symbol: str) -> bool:
        """True if letters centred at a place of the picture [px], shape (2,), would cover letters written before."""
        x, y = np.asarray(place, dtype=np.float64)
        return any(
            abs(mark.y - y) < 1.5 * _LETTER
            and abs(mark.x - x) < 0.5 * _LETTER * (len(symbol) + sum(len(part.text) for part in mark.parts))
            for mark in self.marks
            if isinstance(mark, Lettering)
        )

    def text(
        self, place: npt.ArrayLike, symbol: str, look: str = "letter", beside: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Writes letters centred at a place of the picture, shifted by ``beside`` [px].

        ``_`` begins an index of one character: ``V_0``, ``c = b − a``.
        """
        x, y = (np.asarray(place, dtype=np.float64) + beside).tolist()
        parts: list[Letters] = []
        for number, piece in enumerate(symbol.split("_")):
            if number:
                parts.append(Letters(piece[:1], True))
            rest = piece[1:] if number else piece
            if rest:
                parts.append(Letters(rest, False))
        # Letters are about as wide and high as this; the margin holds the rest of wider ones.
        width = _LETTER * sum(len(part.text) for part in parts)
        left = x - width / 2
        self._bounds.append(np.array([[left, y - 1.5 * _LETTER], [left + width, y + 0.5 * _LETTER]]))
        self.marks.append(Lettering(round(x, 1), round(y, 1), parts, look))


def turn(start: float, end: float) -> FloatArray:
    """Angles from ``start`` to ``end`` [rad], close enough for a smooth circle."""
    return np.linspace(start, end, max(2, round(_ROUND * abs(end - start) / (2 * math.pi)) + 1))


def circle(centre: npt.ArrayLike, start: npt.ArrayLike, side: npt.ArrayLike, angles: Iterable[float]) -> FloatArray:
    """Points of a circle in space at angles [rad] from the radius ``start`` towards ``side``, shape (n, 3)."""
    phi = np.asarray(list(angles), dtype=np.float64)[:, None]
    return np.asarray(np.asarray(centre) + np.cos(phi) * np.asarray(start) + np.sin(phi) * np.asarray(side))


def across(direction: FloatArray) -> FloatArray:
    """Unit vector of the picture at right angles to a direction, shape (2,)."""
    return unit([-direction[1], direction[0]])


def unit(vector: npt.ArrayLike) -> FloatArray:
    """Unit vector in the same direction; zero stays zero."""
    v = np.asarray(vector, dtype=np.float64)
    return np.asarray(v / (np.linalg.norm(v) or 1.0))
