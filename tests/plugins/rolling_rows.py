"""Balls that roll on surfaces, in maximal coordinates: an independent check of truths, also in scenes with mechanisms.

Tests compare it with a ball's two routes, with which it shares neither coordinates nor equations; it is no truth.
``rolling_scenes.py`` assembles whole scenes.

A ball is a free body. Its contact point has no velocity, v + ω × a e1 = 0, in three rows. Only the row along the normal
e1 also constrains positions (the distance); the other two constrain velocities alone (Blajer 2006, section 2). Of the
surface, only its distance function and derivatives of it are used, neither coordinates nor frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.elements.mechanism import WORLD, Mechanism
from proofroll.elements.mechanism.scene.shapes.walls.formula import Jet, sqrt, variables
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.truth.bodies.constraint_rows import AXES, NONE, ConstraintRow, ConstraintRows
from proofroll.truth.bodies.maximal_bodies import BodyInScalars
from proofroll.truth.bodies.maximal_equations import MaximalEquations
from proofroll.truth.numerics.scalars import Scalar, cross, dot, scaled


@dataclass(frozen=True)
class RollingContact:
    """A ball that rolls without slip on a wall at rest.

    Attributes:
        body: name of the ball's body.
        radius: radius a [m].
        path: surface on which the ball's centre moves.
    """

    body: str
    radius: float
    path: UprightCylinder

    def normal(self, r: Sequence[Scalar], v: Sequence[Scalar]) -> tuple[Scalar, list[Scalar], list[Scalar]]:
        """Gap [m], normal e1 towards the wall and its rate [1/s], of a centre at r with velocity v; any scalar type."""
        gap: Jet = self._distance(*variables(*r))
        xx, xy, xz, yy, yz, zz = gap.second
        bent = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return gap.value, [-1.0 * x for x in gap.first], [-1.0 * dot(row, v) for row in bent]

    def _distance(self, *r: Any) -> Any:
        axis = [float(k) for k in self.path.axis]
        along = sum(x * k for x, k in zip(r, axis, strict=True))
        return self.path.radius - sqrt(sum((x - k * along) ** 2 for x, k in zip(r, axis, strict=True)))


class RollingRows(ConstraintRows):
    """Rows of joints, loops and rolling balls; ``rolling``: number of the connection -> ball."""

    rolling: dict[int, RollingContact]

    def of(self, number: int) -> list[ConstraintRow]:
        """All rows of a joint, loop or rolling contact."""
        return self._of_rolling(number) if number in self.rolling else super().of(number)

    def _of_rolling(self, number: int) -> list[ConstraintRow]:
        """Three rows of a ball: zero velocity of its contact point; the gap is the only residual of positions."""
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
    """Class of equations for mechanisms with these balls, whose forces follow those of joints and loops."""

    class RollingEquations(MaximalEquations):
        """Equations of a mechanism with rolling balls, which are free bodies of it."""

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
