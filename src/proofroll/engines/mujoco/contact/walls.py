"""Curved walls of a mechanism in MuJoCo: planes that are posed tangent to the wall before each evaluation of forces.

MuJoCo has no concave shapes but facets, which are another surface. A plane stands for a wall to first order; the rows
of its contact lack the turning of the normal (J̇v).
"""

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism, Tree
from proofroll.elements.mechanism.scene.rotations import Array, quaternion_from_z, turned, turned_back
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, Shape, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls.curved import CurvedWall, PlacedWall
from proofroll.engines.mujoco.settings import MujocoSettings


def curved_end(contact: BodyContact) -> int | None:
    """0 or 1: the first or second shape of a contact is a curved wall; None: neither is."""
    return next(
        (k for k, shape in enumerate((contact.shape_a, contact.shape_b)) if isinstance(shape, CurvedWall)), None
    )


def check_walls(mechanism: Mechanism, settings: MujocoSettings) -> None:
    """Raises Refused for curved walls with an integrator that evaluates forces within a step."""
    curved = next((contact for contact in mechanism.contacts if curved_end(contact) is not None), None)
    if curved is not None and settings.integrator == "RK4":
        raise Refused(
            f"the plane that stands for the curved wall of {curved.name} is posed once a step, and RK4 needs it in "
            "each stage; set integrator=Euler"
        )


class _Plane(NamedTuple):
    """A plane in MuJoCo.

    Attributes:
        geom, under: its geom, and how deep that lies under it [m].
        wall: in the frame of its body.
        bodies: of the wall and of the sphere; 0 is the world.
        centre: of the sphere in the frame of its body [m].
    """

    geom: int
    under: float
    wall: PlacedWall
    bodies: tuple[int, int]
    centre: Sequence[float]

    def pose(self, model: Any, data: Any, above: float) -> None:
        """Poses the plane where the sphere of ``data`` is nearest to the wall, and ``above`` it [m]."""
        carrier, ball = self.bodies
        x, y, z = data.xpos[ball].tolist()
        if any(self.centre):
            u, v, w = turned(data.xmat[ball].reshape(3, 3).tolist(), self.centre)
            x, y, z = x + u, y + v, z + w
        if carrier:
            u, v, w = data.xpos[carrier].tolist()
            x, y, z = turned_back(data.xmat[carrier].reshape(3, 3).tolist(), (x - u, y - v, z - w))
        distance, u, v, w = self.wall.seen(x, y, z)
        up = above - self.under - distance
        model.geom_quat[self.geom] = quaternion_from_z((u, v, w))
        model.geom_pos[self.geom] = x + up * u, y + up * v, z + up * w


def _in_its_body(wall: CurvedWall) -> PlacedWall:
    return PlacedWall(wall, np.eye(3), np.zeros(3))


def tangent(wall: CurvedWall, centre: Array) -> HalfSpace:
    """Plane tangent to a wall where a sphere is nearest, whose centre is given in the frame of the wall's body [m].

    Where several points are as near, it lies across the axis.
    """
    distance, *direction = _in_its_body(wall).seen(*centre.tolist())
    normal = np.array(direction)
    return HalfSpace(centre - distance * normal, normal)


def shapes_at_start(mechanism: Mechanism) -> Sequence[tuple[Shape, Shape]]:
    """Shapes of each contact, with planes tangent at the start in place of curved walls."""
    motion, pairs = None, []
    for contact in mechanism.contacts:
        shapes, end = [contact.shape_a, contact.shape_b], curved_end(contact)
        if end is not None:
            motion = motion or Tree(mechanism).at(*mechanism.start())
            carrier, ball = (mechanism.body_index[(contact.body_a, contact.body_b)[k]] for k in (end, 1 - end))
            wall, sphere = _wall_and_sphere(contact, end)
            centre = motion.p_WB[ball] + motion.R_WB[ball] @ sphere.centre
            shapes[end] = tangent(wall, motion.R_WB[carrier].T @ (centre - motion.p_WB[carrier]))
        pairs.append((shapes[0], shapes[1]))
    return pairs


def _wall_and_sphere(contact: BodyContact, end: int) -> tuple[CurvedWall, SphereShape]:
    shapes = contact.shape_a, contact.shape_b
    wall, sphere = shapes[end], shapes[1 - end]
    assert isinstance(wall, CurvedWall)
    assert isinstance(sphere, SphereShape)  # alone has a rule
    return wall, sphere


class Walls:
    """The planes of a compiled model that stand for curved walls; false if there are none."""

    def __init__(self, model: Any, mechanism: Mechanism) -> None:
        self._model, self._planes = model, dict[int, _Plane]()
        for number, contact in enumerate(mechanism.contacts):
            end = curved_end(contact)
            if end is None:
                continue
            (wall, sphere), bodies = _wall_and_sphere(contact, end), (contact.body_a, contact.body_b)
            geom = model.geom(f"contact{number}{'ab'[end]}").id
            model.geom_sameframe[geom] = 0  # else MuJoCo takes the body's pose for the geom's
            under = float(model.geom_size[geom, 2]) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX else 0.0
            of_bodies = model.body(bodies[end]).id, model.body(bodies[1 - end]).id
            placed, centre = _in_its_body(wall), np.asarray(sphere.centre).tolist()
            self._planes[number] = _Plane(geom=geom, under=under, wall=placed, bodies=of_bodies, centre=centre)
        self._above = dict.fromkeys(self._planes, 0.0)  # m

    def __bool__(self) -> bool:
        return bool(self._planes)

    def pose(self, data: Any) -> None:
        """Poses all planes for the configuration of ``data``, whose poses may be old."""
        if self._planes:
            mujoco.mj_kinematics(self._model, data)
        for number, plane in self._planes.items():
            plane.pose(self._model, data, self._above[number])

    def lift(self, depths: Mapping[int, float]) -> None:
        """Sets the heights of planes to the depth at which each carries its load, by number of contact [m]."""
        self._above = {number: depths.get(number, 0.0) for number in self._planes}

    @contextlib.contextmanager
    def unlifted(self) -> Iterator[None]:
        """Poses planes at their walls, for the geometry of the scene."""
        above, self._above = self._above, dict.fromkeys(self._planes, 0.0)
        try:
            yield
        finally:
            self._above = above
