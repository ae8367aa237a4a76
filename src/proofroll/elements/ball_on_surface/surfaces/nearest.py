"""The distance of places from a surface of which only the points are said: by the nearest of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.elements.ball_on_surface.surfaces.surface import Surface


def distance_by_nearest(surface: Surface) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Distance, gradient and upper half of the Hessian, one after the other: of floats, and of arrays.

    With the nearest point x(u), its tangents T, the metric G = TᵀT and B = e1·∂²x/∂u∂u, a place is p = x - d e1, so
    dp = T (1 + d G⁻¹B) du along the surface, and de1 = -T G⁻¹ B du (Weingarten): ∇d = -e1, and
    ∇∇d = T G⁻¹ B (G + d B)⁻¹ Tᵀ. No difference is taken.
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
