"""Shapes that touch by formulas of their own, in long doubles: gap, normal, place of contact and their rates."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.shapes.geometry import Geometry

from .extrapolation import Long
from .linear_algebra import cross, long, of_rpy


class Side(NamedTuple):
    """One shape: kind, number of its body, centre from the centre of mass, sizes, axes as columns or one axis."""

    kind: str
    body: int
    centre: Long
    sizes: Any
    axes: Long


class Lying(NamedTuple):
    """A contact: gap, normal from b to a, place on the rounder shape, their rates, and the slide of a over b."""

    gap: Any
    normal: Long
    normal_rate: Long
    place: Long
    place_rate: Long
    slide: Long

    @property
    def slip(self) -> Long:
        """Part of the slide across the normal."""
        return self.slide - self.normal * (self.normal @ self.slide)


def sides_of(geometry: Geometry, index: Mapping[str, int], com: Long) -> list[Side]:
    """Shapes of a geometry: one, or the vertices of a box."""
    body = index[geometry.body] % len(com)
    centre = long(geometry.position) - com[body]
    if geometry.kind == "box":
        half = long(geometry.size) / 2
        turn = of_rpy(geometry.orientation)
        return [Side("sphere", body, centre + turn @ (half * long(corner)), long(0), turn)
                for corner in itertools.product((-1, 1), repeat=3)]  # fmt: skip
    if geometry.kind == "ellipsoid":
        return [Side("ellipsoid", body, centre, long(geometry.axes), of_rpy(geometry.orientation))]
    axis = long(geometry.axis if geometry.kind == "bore" else geometry.normal)
    return [Side(geometry.kind, body, centre, long(geometry.radius or 0), axis / np.sqrt(axis @ axis))]


def lying(a: Side, b: Side, r: Long, R: Long, v: Long, w: Long) -> Lying:
    """The contact of two shapes."""
    if a.kind in {"plane", "bore"}:
        turned = lying(b, a, r, R, v, w)
        return Lying(turned.gap, -turned.normal, -turned.normal_rate, turned.place, turned.place_rate, -turned.slide)
    arm, other = R[a.body] @ a.centre, R[b.body] @ b.centre
    c, f = r[a.body] + arm, r[b.body] + other
    c_rate, f_rate = v[a.body] + cross(w[a.body], arm), v[b.body] + cross(w[b.body], other)
    d, d_rate = c - f, c_rate - f_rate
    if b.kind == "plane":
        n = R[b.body] @ b.axes
        n_rate = cross(w[b.body], n)
        out, out_rate = _farthest(a, n, n_rate, R[a.body], w[a.body])
        gap, place, place_rate = n @ (d + out), c + out, c_rate + out_rate
    else:
        if b.kind == "bore":
            axis = R[b.body] @ b.axes
            k_rate = cross(w[b.body], axis)
            P = np.eye(3, dtype=np.longdouble) - np.outer(axis, axis)
            d_rate = P @ d_rate - (np.outer(k_rate, axis) + np.outer(axis, k_rate)) @ d
            d = P @ d
            sign, reach = -1, b.sizes - a.sizes
        else:
            sign, reach = 1, a.sizes + b.sizes
        length = np.sqrt(d @ d)
        gap = sign * (length - reach)
        n, n_rate = sign * d / length, sign * (d_rate * (d @ d) - d * (d @ d_rate)) / length**3
        place, place_rate = c - a.sizes * n, c_rate - a.sizes * n_rate
    slide = v[a.body] + cross(w[a.body], place - r[a.body]) - v[b.body] - cross(w[b.body], place - r[b.body])
    return Lying(gap, n, n_rate, place, place_rate, slide)


def _farthest(a: Side, n: Long, n_rate: Long, R: Long, w: Long) -> tuple[Long, Long]:
    """Farthest point against a direction from the centre of a shape, and its rate."""
    if a.kind == "sphere":
        return -a.sizes * n, -a.sizes * n_rate
    if a.kind == "ellipsoid":
        axes = R @ a.axes
        Q = (axes * a.sizes**2) @ axes.T
        W = long([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        Q_rate = W @ Q - Q @ W
        h = np.sqrt(n @ Q @ n)
        h_rate = (n @ Q_rate @ n + 2 * n @ Q @ n_rate) / (2 * h)
        return -(Q @ n) / h, -(Q_rate @ n + Q @ n_rate) / h + (Q @ n) * h_rate / h**2
    k = R @ a.axes
    k_rate = cross(w, k)
    e = n - k * (n @ k)
    e_rate = n_rate - k_rate * (n @ k) - k * (n_rate @ k + n @ k_rate)
    size = np.sqrt(e @ e)
    return -a.sizes * e / size, -a.sizes * (e_rate / size - e * (e @ e_rate) / size**3)
