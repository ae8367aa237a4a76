"""Walls in Exudyn that follow spheres: hollow spheres in place of curved walls, and planes of moving bodies.

Exudyn has no contact between a sphere and a curved wall, but one with the inside of a sphere
(``ObjectContactSphereSphere``). Its marker is moved on the wall's body before every Newton residual, so that it touches
the wall where the sphere does: then normal, distance and the velocity of its material are the wall's.
"""

from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array, Floats3, turned_back
from proofroll.elements.mechanism.scene.shapes.walls.curved import UPPER, CurvedWall, PlacedWall
from proofroll.engines.exudyn.native import Output, exu

# Radius of the hollow sphere in radii of the ball where the wall is not curved. The larger it is, the less its normal
# turns between two residuals, and the more the stiffness magnifies the round-off of the distance.
ON_A_PLANE = 10.0
# Largest part of the distance of both centres that a gap may have: without a distance they have no normal.
_REACH = 1 - 1e-6
_POSITION, _CURRENT, _ORIGIN = Output.Position, exu.ConfigurationType.Current, [0, 0, 0]


class MovingPlane(NamedTuple):
    """Triangle that stands for the plane of a body, and stays under a sphere.

    Corners as far off as those of a standing plane would magnify the round-off of the body's rotation, so that Newton's
    method would not converge.

    Attributes:
        marker, sphere: Exudyn's markers of the triangle, on its body, and of the centre of the sphere.
        body: Exudyn's number of its body.
        point, normal: of the plane, in Exudyn's axes of the body [m].
    """

    marker: Any
    sphere: Any
    body: Any
    point: Array
    normal: Array

    def follow(self, system: Any) -> None:
        """Moves the triangle to where the sphere is nearest to the plane."""
        centre = np.array(_centre(system, self.sphere, self.body))
        place = centre - self.normal * (self.normal @ (centre - self.point))
        system.SetMarkerParameter(self.marker, "localPosition", place.tolist())


def _centre(system: Any, sphere: Any, body: Any) -> Floats3:
    """Place of a marker in Exudyn's axes of a body, from its centre of mass [m]; None: in the world."""
    x, y, z = system.GetMarkerOutput(sphere, _POSITION, _CURRENT).tolist()
    if body is None:
        return x, y, z
    R = system.GetObjectOutputBody(body, Output.RotationMatrix, _ORIGIN).reshape(3, 3).tolist()
    u, v, w = system.GetObjectOutputBody(body, _POSITION, _ORIGIN).tolist()
    return turned_back(R, (x - u, y - v, z - w))


class HollowSphere(NamedTuple):
    """A hollow sphere that stands for a wall.

    Attributes:
        marker, sphere: Exudyn's markers of its centre, on the wall's body, and of the centre of the sphere.
        body: Exudyn's number of the wall's body; None: the world.
        wall: in Exudyn's axes of its body, from its centre of mass.
        radius, of_sphere: radii [m].
    """

    marker: Any
    sphere: Any
    body: Any
    wall: PlacedWall
    radius: float
    of_sphere: float

    def follow(self, system: Any) -> None:
        """Moves the hollow sphere to where the sphere is nearest to the wall."""
        sphere = _centre(system, self.sphere, self.body)
        place = hollow_centre(self.wall, sphere, self.of_sphere, self.radius)
        system.SetMarkerParameter(self.marker, "localPosition", place)


def hollow_centre(wall: PlacedWall, sphere: Floats3, of_sphere: float, radius: float) -> list[float]:
    """Centre of a hollow sphere that touches a wall where a sphere is nearest, in the axes of the placed wall [m].

    Beyond a gap of nearly the distance of the two centres it follows the sphere and not the wall. Where several points
    of the wall are as near, it lies along the axis.
    """
    (x, y, z), apart = sphere, radius - of_sphere
    distance, nx, ny, nz = wall.seen(x, y, z)
    off = apart - min(distance - of_sphere, _REACH * apart)
    return [x + off * nx, y + off * ny, z + off * nz]


def hollow_radius(wall: CurvedWall, sphere: Array, of_sphere: float) -> float:
    """Radius that fits a wall's largest curvature where a sphere will touch it [m].

    Of a wall that is not curved there it is :data:`ON_A_PLANE` radii, or more for a sphere that starts far from it.
    """
    place = wall.frame.T @ (sphere - wall.point)
    distance, normal, _ = wall.seen(*place.tolist())
    gap = max(distance - of_sphere, 0.0)
    bend = np.array(wall.seen(*(place - gap * np.array(normal)).tolist())[2])[UPPER]
    most = float(np.linalg.eigvalsh(-bend)[-1])  # of the surface on which the centre moves
    flat = max(of_sphere * ON_A_PLANE, of_sphere + 2 * gap)
    return flat if most * flat <= 1 else of_sphere + 1 / most
