"""Balls that roll on surfaces in maximal coordinates: a further witness of scenes with balls, and of those that mix.

Tests hold it against a ball's two routes, with which it shares neither coordinates nor equations; it makes no truth.
Whole scenes are put together in ``rolling_scenes.py``.

A ball is a free body. Its contact point stands still, v + ω × a e1 = 0, in three rows; of these only the distance along
the normal e1 can be violated by a place, the other two hold velocities alone (Blajer 2006, section 2). Of the surface
only its distance is used, and its derivatives; neither coordinates nor frames of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.elements.ball_on_surface.surfaces import Cylinder, Declared, Plane, Surface
from proofroll.elements.ball_on_surface.surfaces.formula import Jet, sqrt, variables
from proofroll.elements.mechanism.checks import WORLD, Vector
from proofroll.elements.mechanism.model import Mechanism
from proofroll.truth.mechanism.constraint_rows import AXES, NONE, ConstraintRow, ConstraintRows
from proofroll.truth.mechanism.maximal_bodies import BodyInScalars
from proofroll.truth.mechanism.maximal_equations import MaximalEquations
from proofroll.truth.scalars import Scalar, cross, dot, scaled


@dataclass(frozen=True)
class RollingContact:
    """A ball that rolls without slip on a wall that stands.

    Attributes:
        body: its name.
        radius: a [m].
        path: the surface on which its centre moves.
        start: a place of its centre [m], which tells on which side of a plane or cylinder it is.
    """

    body: str
    radius: float
    path: Surface
    start: Vector

    def normal(self, r: Sequence[Scalar], v: Sequence[Scalar]) -> tuple[Scalar, list[Scalar], list[Scalar]]:
        """Gap [m], normal e1 towards the wall and its rate [1/s] of a centre at r with velocity v, of any scalars."""
        gap: Jet = self._distance(*variables(*r))
        xx, xy, xz, yy, yz, zz = gap.second
        bent = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return gap.value, [-1.0 * x for x in gap.first], [-1.0 * dot(row, v) for row in bent]

    def _distance(self, *r: Any) -> Any:
        if isinstance(self.path, Declared):
            return self.path.distance(*r)
        if isinstance(self.path, Plane):
            normal = self.path.normal(np.array(self.start))
            return float(self.path.gap(np.zeros(3))) - sum(x * float(n) for x, n in zip(r, normal, strict=True))
        assert isinstance(self.path, Cylinder)
        axis = [float(k) for k in self.path.generators[1].axis]
        along = sum(x * k for x, k in zip(r, axis, strict=True))
        return self.path.radius - sqrt(sum((x - k * along) ** 2 for x, k in zip(r, axis, strict=True)))


class RollingRows(ConstraintRows):
    """Rows of joints and loops, and of the balls ``rolling`` at these numbers."""

    rolling: dict[int, RollingContact]

    def of(self, number: int) -> list[ConstraintRow]:
        """All rows of a joint, loop or rolling contact."""
        return self._of_rolling(number) if number in self.rolling else super().of(number)

    def _of_rolling(self, number: int) -> list[ConstraintRow]:
        """The contact point of a ball does not move; only its distance from the wall can be violated by a place."""
        ball, view = self.rolling[number], self._views[self._connections[number].b]
        gap, e1, e1_rate = ball.normal(view.r, view.v)
        arm = scaled(ball.radius, e1)
        towards = scaled(ball.radius, cross(view.w, e1_rate))
        rows = []
        for n in AXES:
            residual = scaled(-1.0, scaled(gap, e1))
            on_b, on_a = (n, cross(arm, n)), (scaled(-1.0, n), NONE)
            rows.append(self.row(number, dot(n, residual), dot(n, towards), on_b, on_a, (n, NONE)))
        return rows


def rolling_equations(balls: Sequence[RollingContact]) -> type[MaximalEquations]:
    """Equations of mechanisms with these balls; their forces come after those of joints and loops."""

    class RollingEquations(MaximalEquations):
        """A mechanism some of whose bodies, free ones without joints of their own, are balls that roll on a wall."""

        def __init__(self, mechanism: Mechanism, allow_planar: bool) -> None:
            super().__init__(mechanism, allow_planar)
            self._rolling = dict(enumerate(balls, len(self.connections)))
            self.connections += [
                self.connection("rolling", WORLD, ball.body, NONE, NONE, np.eye(3), np.eye(3)) for ball in balls
            ]

        def _rows(self, views: Sequence[BodyInScalars]) -> ConstraintRows:
            rows = RollingRows(self.bodies, self.u_slices, self.connections, views)
            rows.rolling = self._rolling
            return rows

    return RollingEquations
