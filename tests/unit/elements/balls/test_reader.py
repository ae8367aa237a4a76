"""Tables of balls read as bodies: what they become, and where a mistake is."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.files.scene_file import load_scene, scene_names

SCENE = """
title = "balls"
source = "invented"
[parameters.length]
value = 0.1
unit = "m"
meaning = "a length"
source = "invented"
[gravity]
magnitude = 9.81
[[balls]]
name = "ball"
radius = 0.02
mass = 0.1
[[surfaces]]
kind = "cylinder"
name = "wall"
radius = 0.3
tilt = 0.4
[[contacts]]
body = "ball"
surface = "wall"
mu_static = 0.5
mu_kinetic = 0.5
[[initial]]
body = "ball"
coordinates = [4.0, "$length"]
velocity = [1.0, 0.5]
spin = 3.0
"""


def read(folder: Path, *changes: tuple[str, str]) -> MechanismElement:
    """The scene's one ball, with lines changed."""
    text = SCENE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "scene.toml").write_text(text)
    (element,) = load_scene(str(folder)).elements
    assert isinstance(element, MechanismElement)
    return element


def ball_scenes() -> Iterator[str]:
    """Names of our scenes of balls."""
    return (name for name in scene_names() if type(load_scene(name).elements[0]).__name__ == "BallOnSurface")


@pytest.mark.drill
def test_every_scene_of_a_ball_starts_as_a_body_where_the_ball_does() -> None:
    """Centre, velocity, spin and gravity of a body are those of the ball; its element has the ball's name."""
    for name in ball_scenes():
        own, element = load_scene(name).elements[0], load_scene(name).elements[0]
        body, start = own.rolling, element.start  # type: ignore[attr-defined]
        assert element.name == own.name
        pairs = ((start.p_WB, body.p0), (start.v_WB, body.v0), (start.w_WB, body.w0))
        for values, expected in pairs:
            np.testing.assert_allclose(values[0, 0], expected, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(element.mechanism.gravity, body.gravity, rtol=1e-15)  # type: ignore[attr-defined]


def test_a_ball_becomes_a_body_a_sphere_a_wall_and_a_pair(tmp_path: Path) -> None:
    """Names are those of the tables; kinetic friction that is lower has the static one beside it."""
    mechanism: Mechanism = read(tmp_path, ("mu_kinetic = 0.5", "mu_kinetic = 0.3")).mechanism
    (body,), (pair,), (sphere, wall) = mechanism.bodies, mechanism.pairs, mechanism.geometries
    assert (body.name, sphere.name, sphere.kind, wall.name, wall.kind) == ("ball", "ball", "sphere", "wall", "bore")
    assert body.inertia[0][0] == pytest.approx(0.4 * 0.1 * 0.02**2)
    assert (pair.friction, pair.static) == (0.3, 0.5)
    assert wall.axis == pytest.approx((math.sin(0.4), 0.0, math.cos(0.4)))


def test_resistance_is_against_the_motion_of_a_ball_unless_its_file_says_turning(tmp_path: Path) -> None:
    """The default of a contact of a ball is the article's law, and the other one is read."""
    turning = ("mu_static = 0.5", 'mu_static = 0.5\nagainst = "turning"')
    assert [read(tmp_path, *changes).mechanism.pairs[0].against for changes in ((), (turning,))] == [
        "motion",
        "turning",
    ]


def test_a_ball_that_never_slips_has_no_kinetic_friction(tmp_path: Path) -> None:
    """Static friction without a bound holds whatever the kinetic one is."""
    element = read(tmp_path, ("mu_static = 0.5", "mu_static = inf"))
    assert math.isinf(element.mechanism.pairs[0].friction)


def test_a_ball_and_a_wall_of_one_name_stay_apart(tmp_path: Path) -> None:
    """The wall gets another name among bodies and shapes, as names of balls and of surfaces may be the same."""
    changes = ('name = "wall"', 'name = "ball"'), ('surface = "wall"', 'surface = "ball"')
    assert [shape.name for shape in read(tmp_path, *changes).mechanism.geometries] == ["ball", "ball_wall"]


def test_a_start_beyond_half_a_turn_keeps_its_turns(tmp_path: Path) -> None:
    """An angle of 4 rad at the start is told as 4 rad."""
    assert read(tmp_path).local.coordinates == (4.0, 0.1)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (('surface = "wall"', 'surface = "wal"'), "contacts.0.surface"),
        (("radius = 0.02", "radius = 0.4"), "contacts.0"),
        (("mu_kinetic = 0.5", "mu_kinetic = 0.0"), "contacts.0: mu_kinetic"),
        (("[4.0,", '["$length",'), "initial.0.coordinates"),
        (('[[initial]]\nbody = "ball"', '[[initial]]\nbody = "bal"'), "initial.0.body"),
        (("mu_static = 0.5", "mu_statc = 0.5"), "contacts.0.mu_statc"),
        (("spin = 3.0", "spin = 3.0\ntangential_spin = [1.0, 2.0]\ngap = -1.0"), "initial.0.gap"),
        (("mu_static = 0.5", 'mu_static = 0.5\nagainst = "rolling"'), "contacts.0.against"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path: Path, change: tuple[str, str], place: str) -> None:
    """The message names the table of the file and its key, not the body or pair that it would become."""
    with pytest.raises(InputError) as error:
        read(tmp_path, change)
    assert f"scene.toml: {place}" in str(error.value)


def test_a_slip_at_the_start_needs_a_bound(tmp_path: Path) -> None:
    """A ball that never slips cannot start slipping, unless it starts off the wall."""
    changes = ("mu_static = 0.5\nmu_kinetic = 0.5\n", ""), ("spin = 3.0", "spin = 3.0\ntangential_spin = [1.0, 2.0]")
    with pytest.raises(InputError, match="needs a number for mu_static"):
        read(tmp_path, *changes)
    assert read(tmp_path, *changes, ("spin = 3.0", "gap = 0.1\nspin = 3.0")).local.flies  # type: ignore[union-attr]
