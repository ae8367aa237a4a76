"""Coordinates on walls: there and back, derivatives, and the local frame."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.rotations import about, from_quaternion, from_rpy, from_z, quaternion_from_z
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, Wall
from proofroll.elements.mechanism.scene.shapes.walls import Bore, BowlWall, ConeWall, EdgeLine, Shaft, TorusWall
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.elements.mechanism.scene.shapes.walls.curved import CurvedWall, PlacedWall

POINT, AXIS = np.array([0.1, -0.2, 0.3]), np.array([0.36, 0.48, 0.8])
RADIUS = 0.05
WALLS: dict[str, Wall] = {
    "plane": HalfSpace(POINT, AXIS),
    "bore": Bore(POINT, AXIS, 0.3),
    "shaft": Shaft(POINT, AXIS, 0.3),
    "bowl": BowlWall(POINT, AXIS, 0.3),
    "cone": ConeWall(POINT, AXIS, 0.6),
    "torus": TorusWall(POINT, AXIS, 0.4, 0.02),
}
CURVED = {name: wall for name, wall in WALLS.items() if isinstance(wall, CurvedWall)}
PLACES = np.array([[0.3, 0.2], [-0.7, 0.15], [0.1, 0.4]])


@pytest.mark.parametrize("name", WALLS)
def test_coordinates_of_a_place_lead_back_to_it(name: str) -> None:
    """A centre at any coordinates touches, and has these coordinates, on a body that is moved and turned."""
    turned, moved = about(1, 2.5) @ about(0, 0.3), np.array([1.0, 2.0, -1.0])
    surface = wall_coordinates(WALLS[name], RADIUS, turned, moved)
    p = surface.position(PLACES)
    np.testing.assert_allclose(surface.gap(p), 0.0, atol=1e-14)
    np.testing.assert_allclose(surface.locate(p), PLACES, rtol=1e-13)
    # off the wall along its normal the coordinates stay, and the gap is the way
    away = p - 0.01 * surface.normal(p)
    np.testing.assert_allclose(surface.gap(away), 0.01, rtol=1e-12)
    np.testing.assert_allclose(surface.locate(away), PLACES, rtol=1e-12)


@pytest.mark.parametrize("name", WALLS)
def test_derivatives_are_those_of_the_position(name: str) -> None:
    """Tangents, second derivatives and the normal's gradient against central differences; e2 lies along the first."""
    surface, step = wall_coordinates(WALLS[name], RADIUS), 1e-5
    p, frame = surface.position(PLACES), surface.frame(PLACES)
    for column in range(2):
        off = step * np.eye(2)[column]
        ahead, behind = PLACES + off, PLACES - off
        slope = (surface.position(ahead) - surface.position(behind)) / (2 * step)
        bend = (surface.tangents(ahead) - surface.tangents(behind)) / (2 * step)
        np.testing.assert_allclose(surface.tangents(PLACES)[..., column], slope, atol=1e-9)
        np.testing.assert_allclose(surface.second(PLACES)[..., column], bend, atol=1e-8)
    for axis in range(3):
        off = step * np.eye(3)[axis]
        turn = (surface.normal(p + off) - surface.normal(p - off)) / (2 * step)
        np.testing.assert_allclose(surface.normal_gradient(p)[..., axis], turn, atol=1e-8)
    np.testing.assert_allclose(np.linalg.det(frame), 1.0, rtol=1e-13)
    np.testing.assert_allclose(np.swapaxes(frame, -1, -2) @ frame, np.broadcast_to(np.eye(3), frame.shape), atol=1e-14)
    along = np.einsum("ti,ti->t", frame[..., 1], surface.tangents(PLACES)[..., 0])
    np.testing.assert_allclose(along, np.linalg.norm(surface.tangents(PLACES)[..., 0], axis=-1), rtol=1e-13)


@pytest.mark.parametrize("name", WALLS)
def test_a_coordinate_is_no_longer_than_its_scale(name: str) -> None:
    """The way per unit of a coordinate at a place is that of the chart; on a bowl it is the largest, at its bottom."""
    surface = wall_coordinates(WALLS[name], RADIUS)
    ways = np.linalg.norm(surface.tangents(PLACES[0]), axis=0)
    scales = surface.chart.scales(*PLACES[0].tolist())
    assert np.all(ways <= np.array(scales) * (1 + 1e-12))


def test_a_wall_without_coordinates_is_named() -> None:
    """A kind of wall whose coordinates nobody knows is told, with those that are known."""

    class Egg(EdgeLine):
        kind = "egg"

    with pytest.raises(InputError, match="no coordinates of such a wall"):
        wall_coordinates(Egg(POINT, AXIS, 0.3), RADIUS)


@pytest.mark.parametrize(
    "axis", [(0, 0, 1), (0, 0, -1), (0.6, 0, 0.8), (0.36, 0.48, -0.8), (0, 1, 0), (1e-9, 1e-9, -1)]
)
def test_the_smallest_rotation_turns_z_to_an_axis(axis: tuple[float, float, float]) -> None:
    """It is a rotation by the angle between them; about y it is that of a tilt by any angle."""
    unit = np.array(axis) / np.linalg.norm(axis)
    R = from_z(unit)
    np.testing.assert_allclose(R[:, 2], unit, atol=1e-15)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert np.trace(R) == pytest.approx(1 + 2 * unit[2], abs=1e-12)
    for angle in (0.3, 2.5, 4.0, -1.0):
        np.testing.assert_allclose(from_z(about(1, angle)[:, 2]), about(1, angle), atol=1e-14)
    quaternion = quaternion_from_z(unit.tolist())
    assert np.linalg.norm(quaternion) == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(from_quaternion(quaternion)[:, 2], unit, atol=1e-15)


@pytest.mark.parametrize("name", CURVED)
def test_a_wall_is_the_same_from_other_axes(name: str) -> None:
    """From axes turned and moved against its body's it is as far, and its normal is turned with them."""
    wall, place = CURVED[name], np.array([0.15, -0.1, 0.45])
    expected, in_wall, _ = wall.seen(*(wall.frame.T @ (place - wall.point)).tolist())
    R, origin = from_rpy((0.3, -1.1, 2.0)), np.array([0.2, 0.1, -0.4])
    distance, *normal = PlacedWall(wall, R, origin).seen(*(R @ (place - origin)).tolist())
    assert distance == pytest.approx(expected, abs=1e-15)
    np.testing.assert_allclose(normal, R @ wall.frame @ in_wall, atol=1e-15)


def test_where_several_points_are_nearest_the_normal_is_the_axis() -> None:
    """On its axis, where a bore has no normal, one that is placed has its axis for it, turned as the wall is."""
    wall, R = CURVED["bore"], from_rpy((0.3, -1.1, 2.0))
    distance, *normal = PlacedWall(wall, R, POINT).seen(0.0, 0.0, 0.0)
    assert distance == pytest.approx(0.3)
    np.testing.assert_allclose(normal, R @ AXIS, atol=1e-15)
    assert not any(wall.seen(0.0, 0.0, 0.0)[1])
