"""Walls in Exudyn that follow spheres: hollow spheres in place of curved walls, and planes of moving bodies.

Exudyn has no contact between a sphere and a curved wall, but one with the inside of a sphere
(``ObjectContactSphereSphere``). Its marker is moved on the wall's body before every Newton residual, so that it touches
the wall where the sphere does: then normal, distance and the velocity of its material are the wall's.
"""

from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall
from proofroll.engines.exudyn.native import Output, exu

# Radius of the hollow sphere in radii of the ball where the wall is not curved. The larger it is, the less its normal
# turns between two residuals, and the more the stiffness magnifies the round-off of the distance.
ON_A_PLANE = 10.0
# Largest part of the distance of both centres that a gap may have: without a distance they have no normal.
_REACH = 1 - 1e-6


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
        centre = _centre(system, self.sphere, self.body)
        place = centre - self.normal * (self.normal @ (centre - self.point))
        system.SetMarkerParameter(self.marker, "localPosition", place.tolist())


def _centre(system: Any, sphere: Any, body: Any) -> Array:
    """Place of a marker in Exudyn's axes of a body, from its centre of mass [m]; None: in the world."""
    centre = np.array(system.GetMarkerOutput(sphere, Output.Position, exu.ConfigurationType.Current))
    if body is None:
        return centre
    R = np.reshape(system.GetObjectOutputBody(body, Output.RotationMatrix, [0, 0, 0]), (3, 3))
    return np.asarray(R.T @ (centre - system.GetObjectOutputBody(body, Output.Position, [0, 0, 0])))


class HollowSphere(NamedTuple):
    """A hollow sphere that stands for a wall.

    Attributes:
        marker, sphere: Exudyn's markers of its centre, on the wall's body, and of the centre of the sphere.
        body: Exudyn's number of the wall's body; None: the world.
        wall: in the frame of its body.
        turn, com: rotation from that frame to Exudyn's axes of the body, and its centre of mass in that frame [m].
        radius, of_sphere: radii [m].
    """

    marker: Any
    sphere: Any
    body: Any
    wall: CurvedWall
    turn: Array
    com: Array
    radius: float
    of_sphere: float

    def follow(self, system: Any) -> None:
        """Moves the hollow sphere to where the sphere is nearest to the wall."""
        centre = _centre(system, self.sphere, self.body)
        place = self.turn @ (self.centre(self.turn.T @ centre + self.com) - self.com)
        system.SetMarkerParameter(self.marker, "localPosition", place.tolist())

    def centre(self, sphere: Array) -> Array:
        """Its centre for a centre of the sphere, both in the frame of the wall's body [m]."""
        return hollow_centre(self.wall, sphere, self.of_sphere, self.radius)


def hollow_centre(wall: CurvedWall, sphere: Array, of_sphere: float, radius: float) -> Array:
    """Centre of a hollow sphere that touches a wall where a sphere is nearest, in the frame of the wall's body [m].

    Beyond a gap of nearly the distance of the two centres it follows the sphere and not the wall. Where several points
    of the wall are as near, it lies along the axis.
    """
    near, distance = wall.near(wall.frame.T @ (sphere - wall.point)), radius - of_sphere
    normal = wall.frame @ near.normal if near.normal.any() else wall.axis
    return np.asarray(sphere + (distance - min(near.distance - of_sphere, _REACH * distance)) * normal)


def hollow_radius(wall: CurvedWall, sphere: Array, of_sphere: float) -> float:
    """Radius that fits a wall's largest curvature where a sphere will touch it [m].

    Of a wall that is not curved there it is :data:`ON_A_PLANE` radii, or more for a sphere that starts far from it.
    """
    place = wall.frame.T @ (sphere - wall.point)
    near = wall.near(place)
    gap = max(near.distance - of_sphere, 0.0)
    touching = wall.near(place - gap * near.normal)
    most = float(np.linalg.eigvalsh(-touching.bend)[-1])  # of the surface on which the centre moves
    flat = max(of_sphere * ON_A_PLANE, of_sphere + 2 * gap)
    return flat if most * flat <= 1 else of_sphere + 1 / most
