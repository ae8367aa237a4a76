"""Every ball scene written as a body with a sphere that touches a wall, held against the ball's own truth.

What the general mechanics lacks is refused by the words expected here; each refusal is to become an agreement.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.core.events import Event, events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene

FIELDS = ("p_WB", "v_WB", "w_WB")
WORDS = {"bounce": "impact"}  # events of a ball that have another name between bodies
ROUND_OFF = 1e-12  # s: least distance of the brackets of two events that counts
WALLS = {"Cylinder": "bore", "Plane": "plane", "Bowl": "bowl", "Cone": "cone", "Torus": "torus"}


class Case(NamedTuple):
    """A ball scene: its name, parameters, end [s], and words of the refusal of its general form, if there is one."""

    scene: str
    parameters: dict[str, float]
    until: float
    refused: str = ""


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
        "plane": f"position = {under}\nnormal = {normal.tolist()}",
    }
    laws = {"friction": float(law.mu_static), "restitution": float(law.restitution or 0.0)}
    more = {
        "kinetic_friction": (float(law.mu_kinetic), float(law.mu_static)),
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
            f'[[geometries]]\nname = "wall"\nbody = "world"\nkind = "{kind}"',
            of_wall.get(kind, ""),
            f"turning = {turning!r}" if turning else "",
            '[[pairs]]\nname = "contact"\ngeometries = ["sphere", "wall"]',
            *(f"{key} = {value!r}" for key, value in laws.items()),
        ]
    )


NO_BOUND, NO_KEY = "friction = inf: must be finite", "there is no such key here"
REFUSED = [
    Case("bouncing_ball", {}, 0.0, NO_BOUND),
    Case("bouncing_ball", {"mu_static": 0.1, "tangential_restitution": 0.5}, 0.0, f"tangential_restitution.*{NO_KEY}"),
    Case("bowl", {}, 0.0, "kind = 'bowl': it must be"),
    Case("cone", {}, 0.0, "kind = 'cone': it must be"),
    Case("inclined_plane", {}, 0.0, NO_BOUND),
    Case("inclined_plane", {"mu_static": 0.5, "mu_kinetic": 0.3}, 0.0, f"kinetic_friction.*{NO_KEY}"),
    Case("rolling_stop", {}, 0.0, f"rolling_resistance.*{NO_KEY}"),
    Case("sphere_in_cylinder", {}, 0.0, NO_BOUND),
    Case("tilted_cylinder", {}, 0.0, NO_BOUND),
    Case("torus_rim", {}, 0.0, "kind = 'torus': it must be"),
    Case("turntable", {}, 0.0, f"turning = 3.0: {NO_KEY}"),
]
_BOUNCE = {"tilt": 0.2, "height": 0.3, "speed": 0.5, "back_spin": 40.0, "restitution": 0.6, "mu_static": 0.1}
AGREE = [
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


@pytest.mark.parametrize("case", REFUSED, ids=lambda case: f"{case.scene} {' '.join(case.parameters)}".strip())
def test_what_bodies_lack_of_a_ball_is_refused_by_its_name(case: Case, tmp_path: Path) -> None:
    """A law or a wall that only a ball has is refused in a scene of bodies with the name of its key."""
    with pytest.raises(InputError, match=case.refused):
        loaded(case, tmp_path)


@pytest.mark.parametrize("case", AGREE, ids=lambda case: f"{case.scene} {' '.join(case.parameters)}".strip())
def test_a_ball_written_as_a_body_moves_as_its_own_truth_says(case: Case, tmp_path: Path) -> None:
    """Position, velocity, spin and events of both truths agree within the sum of their error bars."""
    times = np.linspace(0.0, case.until, 5)
    own, general = (truth(scene, times) for scene in loaded(case, tmp_path))
    for field in FIELDS:
        values = general[field].to_numpy().reshape(len(times), -1)
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
