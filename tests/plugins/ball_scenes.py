"""Scenes of a ball on a surface, as a fixture."""

from __future__ import annotations

import pytest

from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene

# Nothing about this motion is zero or symmetric, so a lost sign or a swapped axis shows.
GENERAL = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0}
RESISTING = {"rolling_resistance": 5e-4}


@pytest.fixture(
    params=[
        ("sphere_in_cylinder", GENERAL),
        ("sphere_in_cylinder", GENERAL | RESISTING),
        ("sphere_in_cylinder", {"speed": -4.0}),
        ("inclined_plane", {"normal_spin": 3.0}),
        ("inclined_plane", RESISTING),
    ],
    ids=["cylinder", "cylinder-resisting", "cylinder-backwards", "plane", "plane-resisting"],
)
def scene(request: pytest.FixtureRequest) -> Scene:
    """Scenes with nothing special about their numbers."""
    name, parameters = request.param
    return load_scene(name, **parameters)
