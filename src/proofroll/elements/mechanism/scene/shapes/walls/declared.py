"""Surfaces declared by a position and optionally a distance; all other geometry is derived from these."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from typing_extensions import override

from proofroll.core.arrays import FloatArray, cross, read_only
from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.walls.curved import NO_BEND, NO_NORMAL, CurvedWall, Seen
from proofroll.elements.mechanism.scene.shapes.walls.formula import differentiated

# Places along each coordinate at which a declaration is checked, and from which Newton's method for the nearest point
# starts.
_PLACES = 17
# Largest discrepancy of a consistent declaration by round-off, relative to the surface's size.
_CLOSE = 1e-9
_NEWTON = 12


class Declared:
    """Base of surfaces; a subclass is a frozen dataclass with ``name`` and ``kind``, and defines these.

    * ``coordinates``, ``units``, ``periods``, ``domain``, in such an order that the product of the tangents points to
      the wall;
    * :meth:`point`, and where it has a formula, which is faster, :meth:`distance`, in ``+ - * /``, ``**`` and the
      functions of :mod:`proofroll.elements.mechanism.scene.shapes.walls.formula`, so that they can be differentiated;
    * :meth:`offset`, and where it is known, which is faster, :meth:`locate`.

    Tangents, curvature, frame and normal are derivatives.
    """

    name: str
    kind: str
    coordinates: tuple[str, str]
    units: tuple[str, str]
    periods: tuple[float | None, float | None] = (None, None)
    origin: ClassVar[Array] = read_only(np.zeros(3))
    axis: ClassVar[Array] = read_only(np.array([0.0, 0.0, 1.0]))

    @property
    def domain(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """(least, greatest) of each coordinate, where the surface is checked and drawn; a whole turn for an angle."""
        raise NotImplementedError

    def offset(self, ball_radius: float) -> Declared:
        """Surface on which the centre of a touching ball of this radius [m] moves.

        Raises:
            InputError: the ball has no room.
        """
        raise NotImplementedError

    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        """World coordinates of the point u of the surface [m]."""
        raise NotImplementedError

    @property
    def knows_distance(self) -> bool:
        """True if :meth:`distance` is a formula; if not, distances are taken from the nearest point."""
        return type(self).distance is not Declared.distance

    def distance(self, x: Any, y: Any, z: Any) -> Any:  # noqa: ARG002 -- said by subclasses
        """Distance of a place in the world from the surface [m]: positive where balls are, negative behind the wall.

        Raises:
            InputError: the surface has no formula of it.
        """
        raise InputError(f"{self.name}: kind", self.kind, "a formula of the distance is needed here, and it has none")

    def checked(self) -> None:
        """Checks that position, distance and coordinates agree with each other all over the domain.

        Raises:
            InputError: a point of the surface is not at distance zero, the distance has no unit gradient, the
                coordinates lead away from the wall, or the coordinates of a point do not lead back to it.
        """
        u = self.places()
        p = self.position(u)
        size = float(np.max(np.ptp(p, axis=0)))
        off = float(np.max(np.abs(self.gap(p))))
        if not off <= _CLOSE * size:
            raise InputError(
                f"{self.name}: distance", off, "the points of the surface are not at distance zero from it"
            )
        if not np.min(np.einsum("ni,ni->n", self.frame(u)[..., 0], self.normal(p))) > 0:
            names = ", ".join(self.coordinates)
            raise InputError(
                f"{self.name}: coordinates", names, "the product of their tangents leads away from the wall; swap them"
            )
        slope = np.linalg.norm(self.normal(p), axis=-1)
        worst = float(slope[np.argmax(np.abs(slope - 1))])
        if not abs(worst - 1) <= _CLOSE:
            raise InputError(
                f"{self.name}: distance", worst, "a distance grows by one metre per metre along the normal"
            )
        missed = float(np.max(np.linalg.norm(self.position(self.locate(p)) - p, axis=-1)))
        if not missed <= _CLOSE * size:
            raise InputError(f"{self.name}: locate", missed, "the coordinates of a point do not lead back to it")

    def places(self) -> FloatArray:
        """Coordinates on a grid over the domain without its edges [rad or m], shape (n, 2)."""
        inner = (np.arange(_PLACES) + 0.5) / _PLACES
        axes = [low + (high - low) * inner for low, high in self.domain]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)

    def scales(self, u1: float, u2: float) -> tuple[float, float]:  # noqa: ARG002 -- those of walls vary
        """Largest way per unit of each coordinate [m/unit]: the largest radius for an angle, 1 for a length."""
        return self._scales

    @cached_property
    def _scales(self) -> tuple[float, float]:
        lengths = np.linalg.norm(self.tangents(self.places()), axis=-2).max(axis=0)
        scale, second_scale = (1.0 if unit == "m" else float(x) for unit, x in zip(self.units, lengths, strict=True))
        return scale, second_scale

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """Point of the surface [m], shape (..., 3)."""
        return self._bent(u, 0, 1)[..., 0]

    def _bent(self, u: npt.ArrayLike, lowest: int, count: int) -> FloatArray:
        """Derivatives number ``lowest`` to ``lowest + count`` of x, y and z by the coordinates, shape (..., 3, count).

        Order: value, two first derivatives, three second derivatives.
        """
        u = np.asarray(u, dtype=np.float64)
        parts = _chart(self)[0](*u.tolist()) if u.ndim == 1 else _chart(self)[1](u[..., 0], u[..., 1])
        derivatives = [parts[6 * axis + index] for axis in range(3) for index in range(lowest, lowest + count)]
        return _stacked(derivatives, u.shape[:-1]).reshape(*u.shape[:-1], 3, count)

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """Its derivatives [m/unit], shape (..., 3, 2)."""
        return self._bent(u, 1, 2)

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """Its second derivatives [m/unit²], shape (..., 3, 2, 2)."""
        return self._bent(u, 3, 3)[..., [[0, 1], [1, 2]]]

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """Local frame with columns e1, towards the wall, e2, along the first coordinate, and e3 = e1 × e2."""
        tangents = self.tangents(u)
        across = cross(tangents[..., 0], tangents[..., 1])
        e1 = across / np.linalg.norm(across, axis=-1, keepdims=True)
        e2 = tangents[..., 0] / np.linalg.norm(tangents[..., 0], axis=-1, keepdims=True)
        return np.stack([e1, e2, cross(e1, e2)], axis=-1)

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Coordinates of the nearest point, shape (..., 2): Newton's method, from the nearest of a grid.

        A periodic coordinate is in (-period/2, period/2].
        """
        p = np.asarray(p_WB, dtype=np.float64)
        flat, samples = p.reshape(-1, 3), self.places()
        u = samples[np.argmin(np.linalg.norm(flat[:, None] - self.position(samples)[None], axis=-1), axis=1)]
        for _ in range(_NEWTON):
            off, tangents = self.position(u) - flat, self.tangents(u)
            bent = np.einsum("ni,nijk->njk", off, self.second(u)) + np.swapaxes(tangents, -1, -2) @ tangents
            u = u - np.linalg.solve(bent, np.einsum("nij,ni->nj", tangents, off)[..., None])[..., 0]
        for column, period in enumerate(self.periods):
            if period is not None:
                u[:, column] -= period * np.ceil(u[:, column] / period - 0.5)
        return np.asarray(u.reshape(*p.shape[:-1], 2))

    def _away(self, p_WB: npt.ArrayLike, lowest: int, count: int) -> FloatArray:
        """Derivatives number ``lowest`` to ``lowest + count`` of the distance, shape (..., count).

        Order: value, gradient by x, y, z, upper half of the Hessian, row by row.
        """
        p = np.asarray(p_WB, dtype=np.float64)
        parts = _field(self)[0](*p.tolist()) if p.ndim == 1 else _field(self)[1](p[..., 0], p[..., 1], p[..., 2])
        return _stacked(parts[lowest : lowest + count], p.shape[:-1])

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Distance from the surface [m], shape (...); negative behind it."""
        return self._away(p_WB, 0, 1)[..., 0]

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """e1, minus the gradient of the gap, shape (..., 3)."""
        return -self._away(p_WB, 1, 3)

    def normal_gradient(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Gradient of e1 [1/m], shape (..., 3, 3)."""
        return -self._away(p_WB, 4, 6)[..., [[0, 1, 2], [1, 3, 4], [2, 4, 5]]]


@dataclass(frozen=True, eq=False)
class DeclaredWall(CurvedWall):
    """Wall at rest in the world that a declared surface describes; ``metre``: a metre in the wall's unit of length."""

    surface: Declared
    metre: float = 1.0
    kind: ClassVar[str] = "declared"

    @property
    @override
    def has_formula(self) -> bool:
        return self.surface.knows_distance

    @override
    def away(self, x: Any, y: Any, z: Any) -> Any:
        k = self.metre
        return self.surface.distance(x / k, y / k, z / k) * k

    @cached_property
    @override
    def frame(self) -> Array:
        return np.eye(3)

    @override
    def seen(self, x: float, y: float, z: float) -> Seen:
        if not isinstance(x + y + z, float):
            return super().seen(x, y, z)
        k = self.metre
        distance, *parts = _field(self.surface)[0](x / k, y / k, z / k)
        if not math.isfinite(sum(parts)):
            return distance * k, NO_NORMAL, NO_BEND
        return distance * k, parts[:3], [part / k for part in parts[3:]]


# Functions with the surface as key, for attributes of the surface would have to be pickled with it.
@lru_cache
def _chart(surface: Declared) -> tuple[Callable[..., Any], Callable[..., Any]]:
    return differentiated(surface.point, 2)


@lru_cache
def _field(surface: Declared) -> tuple[Callable[..., Any], Callable[..., Any]]:
    return differentiated(surface.distance, 3) if surface.knows_distance else _distance_by_nearest(surface)


def _distance_by_nearest(surface: Declared) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Distance, gradient and upper half of the Hessian in one list, as a function of floats and as one of arrays.

    With the nearest point x(u), its tangents T, the metric G = TᵀT and B = e1·∂²x/∂u∂u, a place is p = x - d e1, so
    dp = T (1 + d G⁻¹B) du along the surface, and de1 = -T G⁻¹ B du (Weingarten): ∇d = -e1, and
    ∇∇d = T G⁻¹ B (G + d B)⁻¹ Tᵀ, without finite differences.
    """

    def of_arrays(x: Any, y: Any, z: Any) -> list[Any]:
        p = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        u = surface.locate(p)
        tangents, e1 = surface.tangents(u), surface.frame(u)[..., 0]
        distance = np.asarray(np.sum((surface.position(u) - p) * e1, axis=-1))
        turned = np.swapaxes(tangents, -1, -2)
        metric = turned @ tangents
        bent = np.einsum("...i,...ijk->...jk", e1, surface.second(u))
        inner = np.linalg.solve(metric, bent) @ np.linalg.solve(metric + distance[..., None, None] * bent, turned)
        hessian = tangents @ inner
        pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]
        return [distance, *(-e1[..., i] for i in range(3)), *(hessian[..., i, j] for i, j in pairs)]

    def of_floats(x: float, y: float, z: float) -> list[float]:
        return [float(part) for part in of_arrays(x, y, z)]

    return of_floats, of_arrays


def _stacked(parts: Sequence[Any], shape: tuple[int, ...]) -> FloatArray:
    """Numbers, or arrays of this shape, as one array with an additional last axis."""
    if not shape:
        return np.array(parts)
    return np.stack([np.broadcast_to(np.asarray(part, dtype=np.float64), shape) for part in parts], axis=-1)
