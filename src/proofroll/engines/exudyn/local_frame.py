"""Surfaces as a body that moves along them sees them: coefficients that do not change from place to place."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from proofroll.errors import Refused
from proofroll.surfaces import FloatArray, Generator, Surface

# Nine numbers: e1, e2, e3 in world components, one after the other.
Frame = tuple[float, ...]
FrameAt = Callable[[float, float, float], Frame]


@dataclass(frozen=True)
class LocalGeometry:
    """A homogeneous surface in its own local frame e1, e2, e3, where its derivatives are constant.

    Attributes:
        tangents: ∂p/∂u [m/unit], shape (3, 2).
        second: ∂²p/∂u∂u [m/unit²], shape (3, 2, 2).
        turn: angular velocity of the frame per rate of u [rad/unit], shape (3, 2).
        generators: the two motions.
    """

    tangents: FloatArray
    second: FloatArray
    turn: FloatArray
    generators: tuple[Generator, Generator]


def local_geometry(surface: Surface, u0: FloatArray) -> LocalGeometry:
    """Constant local coefficients of a homogeneous surface.

    Raises:
        Refused: the surface is not homogeneous.
    """
    generators = surface.generators
    if generators is None:
        raise Refused("the wall does not slide along itself, so its rolling constraint has no constant coefficients")
    here = _coefficients(surface, generators, u0)
    # Two generators that do not commute give a frame that slides along itself but derivatives that change.
    for step in ((0.3, 0.0), (0.0, 0.3), (-0.7, 0.4)):
        there = _coefficients(surface, generators, u0 + np.asarray(step))
        for name, one, other in zip(("tangents", "second derivatives", "turn"), here, there, strict=True):
            if not np.allclose(one, other, rtol=1e-9, atol=1e-12):
                raise Refused(f"the {name} of the wall change from place to place in the local frame")
    return LocalGeometry(*here, generators)


def _coefficients(
    surface: Surface, generators: tuple[Generator, Generator], u: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    to_local = surface.frame(u).T
    turn = np.zeros((3, 2))
    for column, generator in enumerate(generators):
        if generator.kind == "rotation":
            turn[:, column] = to_local @ np.asarray(generator.axis)
    second = np.einsum("ij,jkl->ikl", to_local, surface.second(u))
    # Projections that vanish on paper are left as round-off by the tilt of the world; they would only cost time.
    rounded = (np.where(np.abs(x) < 1e-14, 0.0, x) for x in (to_local @ surface.tangents(u), second, turn))
    tangents, second, turn = rounded
    return tangents, second, turn


def curvature(surface: Surface, u0: FloatArray) -> FloatArray:
    """∂e1/∂p along e2 and e3 in the local frame [1/m], symmetric, shape (2, 2); the same everywhere if homogeneous."""
    frame = surface.frame(u0)
    return np.asarray((frame.T @ surface.normal_gradient(surface.position(u0)) @ frame)[1:, 1:])


def frame_at(surface: Surface, u0: FloatArray) -> FrameAt:
    """The local frame as a fast function of the ball's centre, for callbacks that run at every Newton iterate.

    On a surface with a rotation among its generators, e1, e2, e3 keep their components along the radius from that
    axis, the direction around it, and the axis; without one they are constant. Any other surface is asked itself.
    """
    generators = surface.generators
    rotations = [] if generators is None else [g for g in generators if g.kind == "rotation"]
    if generators is None or len(rotations) > 1:
        return lambda x, y, z: tuple(surface.frame(surface.locate((x, y, z))).T.ravel().tolist())
    frame0 = surface.frame(u0)
    if not rotations:
        constant: Frame = tuple(frame0.T.ravel().tolist())
        return lambda x, y, z: constant  # noqa: ARG005 -- the place does not matter on this surface
    nx, ny, nz = rotations[0].axis
    c = (_around(surface.position(u0), np.asarray(rotations[0].axis)).T @ frame0).T.tolist()
    (a1, b1, n1), (a2, b2, n2), (a3, b3, n3) = c

    def frame(x: float, y: float, z: float) -> Frame:
        along = x * nx + y * ny + z * nz
        rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
        inverse = (rx * rx + ry * ry + rz * rz) ** -0.5
        rx, ry, rz = rx * inverse, ry * inverse, rz * inverse
        tx, ty, tz = ny * rz - nz * ry, nz * rx - nx * rz, nx * ry - ny * rx
        return (
            a1 * rx + b1 * tx + n1 * nx,
            a1 * ry + b1 * ty + n1 * ny,
            a1 * rz + b1 * tz + n1 * nz,
            a2 * rx + b2 * tx + n2 * nx,
            a2 * ry + b2 * ty + n2 * ny,
            a2 * rz + b2 * tz + n2 * nz,
            a3 * rx + b3 * tx + n3 * nx,
            a3 * ry + b3 * ty + n3 * ny,
            a3 * rz + b3 * tz + n3 * nz,
        )

    return frame


def gap_at(surface: Surface, u0: FloatArray) -> Callable[[float, float, float], float]:
    """The ball's distance from the wall [m] as a fast function of its centre, for callbacks; see :func:`frame_at`."""
    generators = surface.generators
    kinds = [] if generators is None else sorted(generator.kind for generator in generators)
    frame, p0 = surface.frame(u0), surface.position(u0)
    if kinds == ["translation", "translation"]:
        (ex, ey, ez), reach = frame[:, 0].tolist(), float(frame[:, 0] @ p0)
        return lambda x, y, z: reach - x * ex - y * ey - z * ez
    parallel = generators is not None and abs(np.dot(generators[0].axis, generators[1].axis)) > 1 - 1e-12
    if generators is not None and kinds == ["rotation", "translation"] and parallel:
        nx, ny, nz = generators[0].axis
        radial = p0 - (p0 @ generators[0].axis) * np.asarray(generators[0].axis)
        radius, outward = float(np.linalg.norm(radial)), float(np.sign(radial @ frame[:, 0]))

        def gap(x: float, y: float, z: float) -> float:
            along = x * nx + y * ny + z * nz
            rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
            return outward * (radius - math.sqrt(rx * rx + ry * ry + rz * rz))

        return gap
    return lambda x, y, z: float(surface.gap((x, y, z)))


def _around(p: FloatArray, axis: FloatArray) -> FloatArray:
    """Columns radial, around and along the axis at ``p``."""
    radial = p - (p @ axis) * axis
    radial = radial / np.linalg.norm(radial)
    return np.stack([radial, np.cross(axis, radial), axis], axis=-1)
