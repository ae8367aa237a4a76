"""Declared surfaces, by a point or a profile curve alone, held against the walls of the same form."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.shapes.walls import (
    BowlWall,
    ConeWall,
    CurvedWall,
    Declared,
    DeclaredWall,
    TorusWall,
)
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.elements.mechanism.scene.shapes.walls.formula import cos, sin, sqrt
from proofroll.elements.mechanism.scene.shapes.walls.revolved import Revolved

POINT, UP = np.zeros(3), np.array([0.0, 0.0, 1.0])


@dataclasses.dataclass(frozen=True)
class ConeByProfile(Revolved):
    """A cone of slope 0.6 by its profile curve alone."""

    name: str = "wall"
    kind: str = "cone"
    coordinates = ("gamma", "s")
    extent = (0.0, 1.0)

    def profile(self, s: Any) -> tuple[Any, Any]:
        """Along the wall from the tip."""
        return s * np.cos(0.6), s * np.sin(0.6)


@dataclasses.dataclass(frozen=True)
class TorusByProfile(Revolved):
    """A ring of 0.234 m and wire of 9 mm by its profile curve alone."""

    name: str = "wall"
    kind: str = "torus"
    coordinates = ("gamma", "theta")
    units = ("rad", "rad")
    periods = (2 * np.pi, 2 * np.pi)
    extent = (-np.pi, np.pi)

    def profile(self, s: Any) -> tuple[Any, Any]:
        """From the top of the wire, outwards."""
        return sin(s) * 0.009 + 0.234, cos(s) * 0.009


@dataclasses.dataclass(frozen=True)
class BowlByPoint(Declared):
    """A sphere by points and distance, in coordinates that a bowl has."""

    name: str = "wall"
    radius: float = 0.4
    kind: str = "bowl"
    coordinates = ("xi", "eta")
    units = ("m", "m")
    domain = ((-0.5, 0.5), (-0.5, 0.5))

    def offset(self, ball_radius: float) -> BowlByPoint:
        """A smaller sphere."""
        return dataclasses.replace(self, radius=self.radius - ball_radius)

    def point(self, u1: Any, u2: Any) -> tuple[Any, Any, Any]:
        """Stereographic projection."""
        x, y = u1 / (2 * self.radius), u2 / (2 * self.radius)
        size = self.radius / (1.0 + x * x + y * y)
        return 2.0 * x * size, -2.0 * y * size, (x * x + y * y - 1.0) * size

    def distance(self, x: Any, y: Any, z: Any) -> Any:
        """From the inside."""
        return self.radius - sqrt(x * x + y * y + z * z)


CASES = [
    pytest.param(BowlByPoint(), BowlWall(POINT, UP, 0.4), 0.025, True, id="bowl"),
    pytest.param(ConeByProfile(), ConeWall(POINT, UP, 0.6), 0.025, False, id="cone"),
    pytest.param(TorusByProfile(), TorusWall(POINT, UP, 0.234, 0.009), 0.12, False, id="torus"),
]


@pytest.mark.parametrize(("surface", "wall", "radius", "formula"), CASES)
def test_a_declared_surface_is_the_wall_of_its_form(
    surface: Declared, wall: CurvedWall, radius: float, formula: bool
) -> None:
    """Places, tangents, curvature, frames and coordinates of a ball's centre, and the wall as contacts see it."""
    known, found = wall_coordinates(wall, radius), wall_coordinates(DeclaredWall(POINT, UP, surface), radius)
    assert isinstance(found, Declared)
    assert surface.knows_distance == found.knows_distance == formula
    surface.checked()
    found.checked()
    u = np.random.default_rng(1).uniform(0.1, 0.4, (2, 5, 2))
    same = surface.kind != "cone"  # of the same coordinates: a cone's are counted from the tip of the centre's cone
    for name in ("position", "tangents", "second", "frame") if same else ():
        np.testing.assert_allclose(getattr(found, name)(u), getattr(known, name)(u), rtol=0, atol=1e-11)
        np.testing.assert_allclose(getattr(found, name)(u[0, 0]), getattr(known, name)(u[0, 0]), rtol=0, atol=1e-11)
    p = known.position(u) + 0.001
    for name in ("gap", "normal", "normal_gradient", *(["locate"] if same else [])):
        np.testing.assert_allclose(getattr(found, name)(p), getattr(known, name)(p), rtol=0, atol=1e-10)
    for metre in (1.0, 5.0):  # the wall in another unit of length
        distance, normal, bend = DeclaredWall(POINT, UP, surface, metre).seen(*(metre * p[0, 0]).tolist())
        expected, in_wall, bent = wall.seen(*p[0, 0].tolist())
        assert distance == pytest.approx(metre * expected, abs=1e-13)
        if np.array_equal(wall.frame, np.eye(3)):  # the wall's axes need not be the world's
            np.testing.assert_allclose(normal, in_wall, rtol=0, atol=1e-12)
            np.testing.assert_allclose(np.array(bend) * metre, bent, rtol=0, atol=1e-10)


@dataclasses.dataclass(frozen=True)
class Paraboloid(Revolved):
    """z = r²/(4 f), bent most at its bottom, with the radius 2 f."""

    name: str = "wall"
    kind: str = "paraboloid"
    coordinates = ("gamma", "s")
    extent = (0.0, 0.5)

    def profile(self, s: Any) -> tuple[Any, Any]:
        """With f = 0.1 m."""
        return s, s * s / 0.4


def test_a_ball_that_does_not_fit_into_the_curve_is_refused() -> None:
    """Where a profile curve bends more than the ball its centre would have no surface, which one line says."""
    Paraboloid().offset(0.19).checked()
    with pytest.raises(InputError, match=r"must be smaller than wall's curve, 0\.2.* m"):
        Paraboloid().offset(0.21)
