"""Loads of bushings in scalars, from the half-angle of the relative rotation, without functions of angles.

The angle follows from tan(θ/4) by three halvings, tan(x/2) = tan x / (1 + √(1 + tan² x)), and a short series, so that
nothing is singular at rest.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.truth.numerics.scalars import (
    Scalar,
    Vector,
    add,
    clean,
    cross,
    minus,
    mul,
    plus,
    product,
    scaled,
    turned,
    turned_back,
)

_HALVINGS = 3
_ARCTANGENT = [(-1.0) ** n / (2 * n + 1) for n in range(10)]  # of atan(t)/t by t²
_COTANGENT = (1 / 3, 1 / 45, 2 / 945, 1 / 4725, 2 / 93555, 1382 / 638512875, 4 / 18243225)  # of (1 - y cot y)/y² by y²


def bushing_load(
    bushing: Bushing,
    R_a: Sequence[Vector],
    R_b: Sequence[Vector],
    motion: tuple[Vector, Vector, Vector, Vector],
    functions: Mapping[str, Any],
) -> tuple[list[Scalar], list[Scalar]]:
    """Force and moment on body_b at its end, world axes; the opposite acts on body_a at the same place.

    Args:
        bushing: between the bodies.
        R_a: rotation of body_a, by rows.
        R_b: rotation of body_b, by rows.
        motion: from the end on body_a to that on body_b [m], the difference of their velocities [m/s], the angular
            velocity of body_b minus that of body_a, and the latter [rad/s], world axes.
        functions: square root for these scalars.
    """
    apart, slide, turning, w_a = motion
    A = product(R_a, [clean(row) for row in bushing.frame_a])
    k, c = (list(map(float, values)) for values in (bushing.stiffness, bushing.damping))
    seen = minus(slide, cross(w_a, apart))
    force = plus(_times(k[:3], turned_back(A, apart)), _times(c[:3], turned_back(A, seen)))
    moment = _times(c[3:], turned_back(A, turning))
    if any(k[3:]):
        B = product(R_b, [clean(row) for row in bushing.frame_b])
        moment = plus(moment, _gradient(product(list(zip(*A, strict=True)), B), k[3:], functions["sqrt"]))
    return scaled(-1.0, turned(A, force)), scaled(-1.0, turned(A, moment))


def _times(factors: Sequence[float], vector: Vector) -> list[Scalar]:
    return list(map(mul, factors, vector))


def _gradient(R: Sequence[Vector], k: Sequence[float], root: Any) -> list[Scalar]:
    def sqrt(x: Scalar) -> Scalar:
        return math.sqrt(x) if isinstance(x, float) else root(x)

    cosine = mul(0.5, sqrt(add(1.0, R[0][0], R[1][1], R[2][2])))  # of half the angle
    halves = [add(R[2][1], mul(-1.0, R[1][2])), add(R[0][2], mul(-1.0, R[2][0])), add(R[1][0], mul(-1.0, R[0][1]))]
    sines = scaled(0.25 / cosine, halves)  # of half the angle, along the axis
    square = (1.0 - cosine) / (1.0 + cosine)  # of the tangent of a quarter of the angle
    sums = []
    for _ in range(_HALVINGS):
        sums.append(1.0 + sqrt(1.0 + square))
        square = square / (sums[-1] * sums[-1])
    arc = _series(_ARCTANGENT, square)
    shrunk = 1.0 + cosine
    for total in sums:
        shrunk = shrunk * total
    theta = scaled(2.0 ** (_HALVINGS + 2) * arc / shrunk, sines)
    # (1 - x cot x)/x² of half the angle, from that of half of half, and so on
    factor = _series(_COTANGENT, square * arc * arc)
    tangent = 1.0 / arc
    for total in [None, *sums[::-1]]:
        tangent = tangent if total is None else 0.5 * tangent * total
        factor = 0.25 * (factor + tangent)
    product = _times(k, theta)
    across = cross(theta, product)
    return plus(product, scaled(0.5, across), scaled(0.25 * factor, cross(theta, across)))


def _series(coefficients: Sequence[float], x: Scalar) -> Scalar:
    total: Scalar = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        total = coefficient + x * total
    return total
