"""Scenes of a ball that rolls in an upright cylinder, as a fixture, and their motion."""

from __future__ import annotations

import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.polar import first_route

# Nothing about this motion is zero or symmetric, so a lost sign or a swapped axis shows.
GENERAL = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0}
RESISTING = {"rolling_resistance": 5e-4}


@pytest.fixture(
    params=[
        ("sphere_in_cylinder", GENERAL),
        ("sphere_in_cylinder", GENERAL | RESISTING),
        ("sphere_in_cylinder", {"speed": -4.0}),
    ],
    ids=["cylinder", "cylinder-resisting", "cylinder-backwards"],
)
def scene(request: pytest.FixtureRequest) -> Scene:
    """Scenes with nothing special about their numbers."""
    name, parameters = request.param
    return load_scene(name, **parameters)


def rolled(body: RollingBall, times: FloatArray) -> BallMotion:
    """Motion and force of a ball that rolls at rising times [s], by the route that finds first slips."""
    gripped = body.with_contact(mu_static=100.0)  # more than any test needs; routes of slips want a bound
    return first_route(gripped).rolling(float(times[-1]))[1](times)
