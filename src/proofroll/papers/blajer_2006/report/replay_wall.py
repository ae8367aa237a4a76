"""Wall of a replayed ball: a grid of points around its path, and targets for the camera."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.model import RollingBall

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
