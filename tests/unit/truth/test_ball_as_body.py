"""Every ball scene written as a body with a sphere that touches a wall, held against the ball's own truth.

All laws and walls of a ball are there for bodies; a wall that turns is one of a body with a prescribed motion.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from proofroll.core.events import Event, events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene

FIELDS = ("p_WB", "v_WB", "w_WB")
WORDS = {"bounce": "impact"}  # events of a ball that have another name between bodies
ROUND_OFF = 1e-12  # s: least distance of the brackets of two events that counts
WALLS = {"Cylinder": "bore", "Plane": "plane", "Bowl": "bowl", "Cone": "cone", "Torus": "torus"}

# A body that turns as a wall does, about an axis through the origin.
TABLE = """
[[bodies]]
name = "disc"
mass = 1.0
inertia = [1.0, 1.0, 1.0]
[[joints]]
name = "axle"
kind = "revolute"
parent = "world"
child = "disc"
axis = {axis}
motion = "= {turning!r}*t"
"""


class Case(NamedTuple):
    """A ball scene: its name, parameters and end [s]."""

    scene: str
    parameters: dict[str, float]
    until: float


def as_body(scene: Scene) -> str:
    """Scene file of a ball's scene in bodies, geometries, pairs and joints."""
    (element,) = scene.elements
    ball, wall, law = element.rolling, element.surface, element.contact  # type: ignore[attr-defined]
    start, gravity, radius = element.start, np.array(ball.gravity, dtype=float), float(ball.ball.radius)  # type: ignore[attr-defined]
    size = float(np.linalg.norm(gravity))
    kind, moment = WALLS[type(wall).__name__], float(ball.ball.inertia)
    normal = -np.array(ball.surface.normal(ball.p0), dtype=float)  # from the wall to the ball
    tilt = float(getattr(wall, "tilt", 0.0))
    axis = [math.sin(tilt), 0.0, math.cos(tilt)]
    under = (np.array(ball.p0) - (radius + start.gap) * normal).tolist()
    of_wall = {
        "bore": f"radius = {getattr(wall, 'radius', 0.0)!r}\naxis = {axis}",
        "bowl": f"radius = {getattr(wall, 'radius', 0.0)!r}",
        "cone": f"slope = {getattr(wall, 'slope', 0.0)!r}",
        "torus": f"radius = {getattr(wall, 'wire_radius', 0)!r}\nring_radius = {getattr(wall, 'ring_radius', 0)!r}",
        "plane": f"position = {under}\nnormal = {normal.tolist()}",
    }
    laws = {"friction": float(law.mu_kinetic), "restitution": float(law.restitution or 0.0)}
    more = {
        "static_friction": (float(law.mu_static), float(law.mu_kinetic)),
        "rolling_resistance": (float(law.rolling_resistance), 0.0),
        "tangential_restitution": (float(law.tangential_restitution), 0.0),
    }
    laws |= {key: value for key, (value, usual) in more.items() if value != usual}
    turning = float(getattr(wall, "turning", 0.0))
    return "\n".join(
        [
            'title = "a ball as a body"\nsource = "this project"\n[gravity]',
            f"magnitude = {size!r}\ndirection = {(gravity / size).tolist()}" if size else "magnitude = 0",
            f'[[bodies]]\nname = "ball"\nmass = {float(ball.ball.mass)!r}\ninertia = {[moment] * 3}',
            '[[joints]]\nname = "free"\nkind = "free"\nparent = "world"\nchild = "ball"',
            f"q0 = {[*map(float, ball.p0), 1.0, 0.0, 0.0, 0.0]}\nv0 = {[*map(float, ball.v0), *map(float, ball.w0)]}",
            f'[[geometries]]\nname = "sphere"\nbody = "ball"\nkind = "sphere"\nradius = {radius!r}',
            TABLE.format(axis=axis, turning=turning) if turning else "",
            f'[[geometries]]\nname = "wall"\nbody = "{"disc" if turning else "world"}"\nkind = "{kind}"',
            of_wall.get(kind, ""),
            '[[pairs]]\nname = "contact"\ngeometries = ["sphere", "wall"]',
            *(f"{key} = {value!r}" for key, value in laws.items()),
        ]
    )


_BOUNCE = {"tilt": 0.2, "height": 0.3, "speed": 0.5, "back_spin": 40.0, "restitution": 0.6, "mu_static": 0.1}
AGREE = [
    Case("bouncing_ball", {}, 0.6),
    Case("inclined_plane", {}, 0.5),
    Case("sphere_in_cylinder", {}, 0.5),
    Case("tilted_cylinder", {}, 0.5),
    Case("bouncing_ball", {"mu_static": 0.1, "tangential_restitution": 0.5, "speed": 0.3, "back_spin": 90.0}, 0.8),
    Case("bouncing_ball", {"mu_static": 0.9, "mu_kinetic": 0.2, "tangential_restitution": 0.5, "speed": 1.0}, 0.8),
    Case("inclined_plane", {"mu_static": 0.5, "mu_kinetic": 0.3}, 0.5),
    Case("inclined_plane", {"mu_static": 0.1, "mu_kinetic": 0.06}, 0.5),
    Case("slide_to_roll", {"mu_static": 0.3, "mu_kinetic": 0.2, "cross_speed": 0.7, "back_spin": 30.0}, 1.0),
    pytest.param(
        Case("sphere_in_cylinder", {"mu_static": 0.35, "mu_kinetic": 0.3, "speed": 3.0}, 0.6), marks=pytest.mark.drill
    ),
    Case("turntable", {}, 2.0),
    Case("rolling_stop", {}, 4.0),
    Case("rolling_stop", {"mu_static": 0.3, "cross_speed": 0.3, "normal_spin": 5.0}, 4.0),
    Case("sphere_in_cylinder", {"rolling_resistance": 5e-4}, 0.5),
    Case("bowl", {"rolling_resistance": 5e-4}, 0.5),
    Case("bowl", {}, 1.0),
    Case("cone", {}, 1.0),
    Case("torus_rim", {}, 0.3),
    Case("inclined_plane", {"mu_static": 0.3}, 0.5),
    Case("inclined_plane", {"mu_static": 0.05}, 0.5),
    Case("slide_to_roll", {"cross_speed": 0.7, "back_spin": 30.0}, 1.0),
    Case("bouncing_ball", _BOUNCE, 0.9),
    Case("tilted_cylinder", {"mu_static": 0.5}, 0.4),
    pytest.param(Case("sphere_in_cylinder", {"mu_static": 0.35}, 0.3), marks=pytest.mark.drill),
    pytest.param(Case("sphere_in_cylinder", {"mu_static": 0.35, "speed": 3.0}, 0.6), marks=pytest.mark.drill),
]


def loaded(case: Case, folder: Path) -> tuple[Scene, Scene]:
    """The ball's own scene, and the same written in bodies."""
    own = load_scene(case.scene, **case.parameters)
    (folder / "scene.toml").write_text(as_body(own))
    return own, load_scene(str(folder))


@pytest.mark.parametrize("case", AGREE, ids=lambda case: f"{case.scene} {' '.join(case.parameters)}".strip())
def test_a_ball_written_as_a_body_moves_as_its_own_truth_says(case: Case, tmp_path: Path) -> None:
    """Position, velocity, spin and events of both truths agree within the sum of their error bars."""
    times = np.linspace(0.0, case.until, 5)
    own, general = (truth(scene, times) for scene in loaded(case, tmp_path))
    for field in FIELDS:
        values = general[field].sel(body="ball").to_numpy()
        apart = np.abs(values - own[field].to_numpy()).max()
        assert np.isfinite(values).all(), field
        assert apart <= own[field].attrs["error_bar"] + _bar(general, field), field
    expected = [event for event in events_of(own) if event.time > 0]
    told = [event for event in events_of(general) if event.time > 0]
    assert [event.kind for event in told] == [WORDS.get(event.kind, event.kind) for event in expected]
    for one, other in zip(expected, told, strict=True):
        assert _apart(one, other) <= ROUND_OFF


def _bar(found: Any, field: str) -> float:
    """Error bar of a field at the last time."""
    return float(np.max(found[field].attrs["error_bar"]))


def _apart(one: Event, other: Event) -> float:
    """Distance of the brackets of two events [s]; at most zero: they overlap."""
    return max(one.time_low - other.time_high, other.time_low - one.time_high)
