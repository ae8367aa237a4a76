"""Constraint rows of joints and loops between bodies that are each free in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, FACTS, JointKind
from proofroll.truth.bodies.maximal_bodies import AXES, BodyInScalars, GeneralBody, Planar
from proofroll.truth.numerics.scalars import (
    Scalar,
    add,
    cross,
    dot,
    is_zero,
    minus,
    mul,
    plus,
    product,
    scaled,
    sub,
    turned,
)

NONE = (0.0, 0.0, 0.0)
_Wrench = tuple[Sequence[Scalar], Sequence[Scalar]]


@dataclass(frozen=True)
class Connection:
    """A joint or loop between bodies a and b: its places from the centres of mass and frames (rows), in body axes.

    ``length``: of a loop that holds a distance [m].
    """

    kind: str
    a: int
    b: int
    place_a: Sequence[float]
    place_b: Sequence[float]
    frame_a: Sequence[Sequence[float]]
    frame_b: Sequence[Sequence[float]]
    length: float = 0.0


@dataclass
class ConstraintRow:
    """One scalar constraint: Φ = 0, Σ coefficient·u = 0, Σ coefficient·u̇ + bias = 0.

    Attributes:
        residual: Φ.
        coefficients: by the index of the velocity in u.
        bias: velocity terms of Φ̈.
        connection: index of the joint or loop.
        force, torque: applied to body b at the joint by a unit multiplier, in world axes.
        besides: the other joints of a coupling: index, force, torque of each.
    """

    residual: Scalar
    coefficients: dict[int, Scalar]
    bias: Scalar
    connection: int
    force: Sequence[Scalar]
    torque: Sequence[Scalar]
    besides: tuple[tuple[int, Sequence[Scalar], Sequence[Scalar]], ...] = ()

    def less(self, ratio: float, row: ConstraintRow) -> ConstraintRow:
        """Row of a coupling: this row minus ``ratio`` times another; on rates only, without a residual."""
        coefficients = dict(self.coefficients)
        for index, value in row.coefficients.items():
            coefficients[index] = sub(coefficients.get(index, 0.0), mul(ratio, value))
        bias = sub(self.bias, mul(ratio, row.bias))
        share = (row.connection, scaled(-ratio, row.force), scaled(-ratio, row.torque))
        besides = (*self.besides, share)
        return ConstraintRow(
            residual=0.0,
            coefficients=coefficients,
            bias=bias,
            connection=self.connection,
            force=self.force,
            torque=self.torque,
            besides=besides,
        )


class ConstraintRows:
    """Constraint rows of all connections in one state.

    Args:
        bodies: the bodies.
        u_slices: slice of each body's velocities in u.
        connections: joints and loops.
        views: poses and velocities of the bodies in scalars, the ground last.
    """

    def __init__(
        self,
        bodies: Sequence[GeneralBody | Planar],
        u_slices: Sequence[slice],
        connections: Sequence[Connection],
        views: Sequence[BodyInScalars],
    ) -> None:
        self._bodies, self._u_slices, self._connections, self._views = bodies, u_slices, connections, views

    def of(self, number: int) -> list[ConstraintRow]:
        """All rows of a joint or loop."""
        c, a, b, arm_a, arm_b, d, towards = self._apart(number)
        if c.kind == DISTANCE:  # (d·d/L - L)/2
            slide = minus(speed_at(b, arm_b), speed_at(a, arm_a))
            direction = scaled(1.0 / c.length, d)
            residual = mul(0.5, sub(dot(direction, d), float(c.length)))
            bias = add(mul(1.0 / c.length, dot(slide, slide)), dot(direction, towards))
            on_a = scaled(-1.0, cross(arm_a, direction))
            return [
                self.row(
                    number,
                    residual,
                    bias,
                    (direction, cross(arm_b, direction)),
                    (scaled(-1.0, direction), on_a),
                    (direction, NONE),
                )
            ]
        A, B = columns(product(a.R, c.frame_a)), columns(product(b.R, c.frame_b))
        rows = []
        facts = FACTS[c.kind]
        for k in facts.translations:
            if len(facts.translations) < 3:
                rows.append(self._sliding(number, A[k]))
                continue
            n: Sequence[Scalar] = AXES[k]  # along the world's axes
            on_b, on_a = cross(arm_b, n), scaled(-1.0, cross(arm_a, n))
            wrenches = ((n, on_b), (scaled(-1.0, n), on_a), (n, NONE))
            rows.append(self.row(number, dot(n, d), dot(n, towards), *wrenches))
        for k, m in facts.rotations:
            x, y = A[k], B[m]
            t = cross(y, x)
            x_rate, y_rate = cross(a.w, x), cross(b.w, y)
            bias = add(dot(cross(a.w, x_rate), y), mul(2.0, dot(x_rate, y_rate)), dot(x, cross(b.w, y_rate)))
            back = scaled(-1.0, t)
            rows.append(self.row(number, dot(x, y), bias, (NONE, t), (NONE, back), (NONE, t)))
        return rows

    def of_rate(self, number: int, kind: str) -> ConstraintRow:
        """Rate of a revolute or prismatic joint's coordinate as a row; its wrench acts along the coordinate."""
        c = self._connections[number]
        a, b = self._views[c.a], self._views[c.b]
        axis = columns(product(a.R, c.frame_a))[2]
        back = scaled(-1.0, axis)
        if kind == JointKind.REVOLUTE:
            bias = dot(cross(a.w, axis), minus(b.w, a.w))
            return self.row(number, 0.0, bias, (NONE, axis), (NONE, back), (NONE, axis))
        return self._sliding(number, axis)

    def _apart(self, number: int) -> tuple[Any, ...]:
        """Connection, bodies, arms to its two points, vector d between these points, and d̈ at u̇ = 0."""
        c = self._connections[number]
        a, b = self._views[c.a], self._views[c.b]
        arm_a, arm_b = turned(a.R, c.place_a), turned(b.R, c.place_b)
        d = minus(plus(b.r, arm_b), plus(a.r, arm_a))
        return c, a, b, arm_a, arm_b, d, minus(cross(b.w, cross(b.w, arm_b)), cross(a.w, cross(a.w, arm_a)))

    def _sliding(self, number: int, n: Sequence[Scalar]) -> ConstraintRow:
        """Row of the distance between two points along an axis that turns with body a."""
        _, a, b, arm_a, arm_b, d, towards = self._apart(number)
        slide = minus(speed_at(b, arm_b), speed_at(a, arm_a))
        n_rate = cross(a.w, n)
        bias = add(dot(n, towards), mul(2.0, dot(n_rate, slide)), dot(cross(a.w, n_rate), d))
        on_b, on_a = cross(arm_b, n), scaled(-1.0, cross(plus(arm_a, d), n))
        return self.row(number, dot(n, d), bias, (n, on_b), (scaled(-1.0, n), on_a), (n, NONE))

    def row(
        self, number: int, residual: Scalar, bias: Scalar, on_b: _Wrench, on_a: _Wrench, at_joint: _Wrench
    ) -> ConstraintRow:
        """Row from the wrenches of a unit multiplier: on each body, at its centre of mass; and on b, at the joint."""
        c = self._connections[number]
        coefficients: dict[int, Scalar] = {}
        for body, (push, moment) in ((c.b, on_b), (c.a, on_a)):
            if body >= 0:
                entries = self._bodies[body].projected(self._views[body], push, moment)
                for index, entry in enumerate(entries, self._u_slices[body].start):
                    if not is_zero(entry):
                        coefficients[index] = entry
        force, torque = at_joint
        return ConstraintRow(residual, coefficients, bias, number, force=force, torque=torque)


def speed_at(view: BodyInScalars, arm: Sequence[Scalar]) -> list[Scalar]:
    """Velocity of a point of a body in world axes, m/s; ``arm`` leads there from the centre of mass."""
    return plus(view.v, cross(view.w, arm))


def columns(matrix: Sequence[Sequence[Scalar]]) -> list[list[Scalar]]:
    """Columns of a matrix of scalars."""
    return [list(column) for column in zip(*matrix, strict=True)]
