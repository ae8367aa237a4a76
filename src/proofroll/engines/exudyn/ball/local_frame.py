"""Homogeneous surfaces: their derivatives in the local frame, which are the same at every place."""

from dataclasses import dataclass

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.surfaces import Generator, Surface


@dataclass(frozen=True)
class LocalGeometry:
    """A homogeneous surface in its own local frame e1, e2, e3, where its derivatives are constant.

    Attributes:
        tangents: ∂p/∂u [m/unit], shape (3, 2).
        second: ∂²p/∂u∂u [m/unit²], shape (3, 2, 2).
        turn: angular velocity of the frame per rate of u [rad/unit], shape (3, 2).
        generators: the two rigid motions that slide the surface along itself.
    """

    tangents: FloatArray
    second: FloatArray
    turn: FloatArray
    generators: tuple[Generator, Generator]


def local_geometry(surface: Surface, u0: FloatArray) -> LocalGeometry:
    """Constant local coefficients of a surface."""
    return LocalGeometry(*_coefficients(surface, surface.generators, u0), surface.generators)


def _coefficients(
    surface: Surface, generators: tuple[Generator, Generator], u: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    to_local = surface.frame(u).T
    turn = np.zeros((3, 2))
    for column, generator in enumerate(generators):
        if generator.kind == "rotation":
            turn[:, column] = to_local @ np.asarray(generator.axis)
    second = np.einsum("ij,jkl->ikl", to_local, surface.second(u))
    # Components that are zero in exact arithmetic are round-off in a tilted world: set to zero, to save their terms.
    # The size of round-off depends on the size of the wall.
    derivatives = (to_local @ surface.tangents(u), second, turn)
    rounded = (np.where(np.abs(x) < 1e-14 * np.max(np.abs(x)), 0.0, x) for x in derivatives)
    tangents, second, turn = rounded
    return tangents, second, turn


def curvature(surface: Surface, u0: FloatArray) -> FloatArray:
    """∂e1/∂p along e2 and e3 in the local frame [1/m], symmetric, shape (2, 2); the same everywhere if homogeneous."""
    frame = surface.frame(u0)
    return np.asarray((frame.T @ surface.normal_gradient(surface.position(u0)) @ frame)[1:, 1:])
