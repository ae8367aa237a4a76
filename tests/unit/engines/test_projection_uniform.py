"""The equations that are written out for uniform surfaces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.projection.geometry import GeneralSurface, Uniform, geometry_of
from proofroll.engines.projection.method import ProjectedBall
from proofroll.engines.projection.orientation import EulerAngles, Orientation, RotatingFrame
from proofroll.files.scene_file import load_scene

RNG = np.random.default_rng(0)


def bodies() -> list[RollingBall]:
    """Balls in and on surfaces, upright and tilted, with and without rolling resistance."""
    found = []
    for name in ("sphere_in_cylinder", "inclined_plane"):
        for f in (0.0, 5e-4):
            body = rolling_ball(load_scene(name, rolling_resistance=f))
            found += [body, dataclasses.replace(body, surface=dataclasses.replace(body.surface, tilt=0.4))]  # type: ignore[type-var]  # a dataclass
    return found


def state(orientation: Orientation) -> np.ndarray:
    """Anywhere but near the singularity."""
    x = RNG.normal(size=7 + orientation.size)
    if orientation.size:
        x[3] = RNG.uniform(0.4, 2.7)
    return x


@pytest.mark.parametrize("orientation", [EulerAngles(), RotatingFrame()], ids=["euler", "rotating_frame"])
def test_they_are_the_projected_ones(orientation: Orientation) -> None:
    """In random states they give the accelerations, reactions and eliminations of the projections carried out."""
    for body in bodies():
        geometry = geometry_of(body.surface)
        assert isinstance(geometry, Uniform)
        written, carried = (ProjectedBall(body, kind, orientation) for kind in (geometry, GeneralSurface(body.surface)))
        for _ in range(5):
            x = state(orientation)
            expected, found = carried.response(carried.kinematics(x)), written.response_at(x)
            scale = np.abs(expected.acceleration).max()
            np.testing.assert_allclose(found.acceleration, expected.acceleration, atol=1e-12 * scale, rtol=0)
            np.testing.assert_allclose(found.multipliers, expected.multipliers, rtol=1e-9, atol=1e-11)
            np.testing.assert_allclose(found.N, expected.N, rtol=1e-11)
            np.testing.assert_allclose(written.rates(x), carried.rates(x), atol=1e-12 * scale, rtol=0)
            np.testing.assert_allclose(written.eliminated(x), carried.eliminated(x), atol=1e-11)


def test_states_that_are_not_finite() -> None:
    """A state that has overflowed is an arithmetic error, which the adapter reports, and not another kind."""
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    for orientation, place in ((EulerAngles(), 3), (EulerAngles(), 0)):
        ball = ProjectedBall(body, geometry_of(body.surface), orientation)
        x = state(orientation)
        x[place] = np.inf
        with pytest.raises(ArithmeticError):
            ball.rates(x)
