from __future__ import annotations

import dataclasses
import importlib
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from placed_balls import placed, scene_with

from proofroll.core.errors import InputError, Refused
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.elements.balls.surfaces import Cylinder, Plane
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.contacts.on_wall import slip_velocity
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.model import ROLLS


def test_paper_ball() -> None:
    """The defaults of the sphere in the cylinder are the steel ball of the paper."""
    scene = load_scene("sphere_in_cylinder")
    ball = rolling_ball(scene).ball
    assert (ball.radius, ball.mass) == (0.025, 0.517)
    assert ball.inertia == pytest.approx(0.4 * 0.517 * 0.025**2, rel=1e-15)
    assert rolling_ball(scene).wall.radius == 0.225
    assert rolling_ball(scene).surface.radius == pytest.approx(0.2, rel=1e-15)
    assert rolling_ball(scene).gravity.tolist() == [0, 0, -9.81]


def test_start_of_the_sphere_in_the_cylinder() -> None:
    """At time 0 the centre is at (c, 0, 0), moves along y, and spins about -z by cγ̇/a."""
    body = rolling_ball(load_scene("sphere_in_cylinder"))
    assert body.p0 == pytest.approx([0.2, 0, 0], abs=1e-15)
    assert body.v0 == pytest.approx([0, 4, 0], abs=1e-15)
    assert body.w0 == pytest.approx([0, 0, -160], abs=1e-12)
    assert body.udot0 == pytest.approx([20, 0], abs=1e-12)


def test_start_has_no_slip_and_the_given_spin(scene: Scene) -> None:
    """The initial angular velocity makes the contact point rest and has the given component along e1."""
    body = rolling_ball(scene)
    e1 = body.surface.normal(body.p0)
    assert slip_velocity(body.ball.radius, e1, body.v0, body.w0) == pytest.approx(0.0, abs=1e-14)
    assert body.w0 @ e1 == pytest.approx(placed(scene).start.spin, abs=1e-13)
    assert body.surface.gap(body.p0) == pytest.approx(0.0, abs=1e-16)


def test_udot_gives_the_velocity(scene: Scene) -> None:
    """The initial rates of the coordinates give the initial velocity."""
    body = rolling_ball(scene)
    assert body.surface.tangents(body.u0) @ body.udot0 == pytest.approx(body.v0, abs=1e-14)


def test_gravity_direction_has_any_length() -> None:
    """Only the direction of gravity's direction counts."""
    scene = load_scene("sphere_in_cylinder")
    longer = scene_with(scene, gravity=Gravity(9.81, (0.0, 0.0, -7.0)))
    assert rolling_ball(longer).gravity == pytest.approx(rolling_ball(scene).gravity, rel=1e-15)


@pytest.mark.parametrize(
    ("scene_name", "parameters", "needs"),
    [
        ("sphere_in_cylinder", {}, ROLLS - {MechanismCapability.TURNING_FRICTION}),
        ("sphere_in_cylinder", {"mu_static": math.inf}, ROLLS - {MechanismCapability.TURNING_FRICTION}),
        (
            "sphere_in_cylinder",
            {"rolling_resistance": 1e-9},
            ROLLS,
        ),
    ],
)
def test_requires_no_more_than_the_scene_needs(
    scene_name: str, parameters: dict[str, float], needs: frozenset[str]
) -> None:
    """A scene requires exactly what its numbers make necessary."""
    assert load_scene(scene_name, **parameters).requires == needs


def test_inertia_ratio_reaches_the_inertia() -> None:
    """A thin shell has two thirds of m a²."""
    assert Ball("shell", 0.1, 3.0, inertia_ratio=2 / 3).inertia == pytest.approx(0.02, rel=1e-15)


@pytest.mark.drill
def test_digest_follows_the_motion_alone() -> None:
    """The digest changes with every number that changes the motion, and with nothing else."""
    scene = load_scene("sphere_in_cylinder")
    assert dataclasses.replace(scene, title="other").digest == scene.digest
    assert load_scene("sphere_in_cylinder", speed=4.0).digest == scene.digest
    changed = [
        load_scene("sphere_in_cylinder", **{name: value}).digest
        for name, value in {
            "radius": 0.026, "cylinder_radius": 0.226, "mass": 0.518, "gravity": 9.8, "speed": np.nextafter(4.0, 5.0),
            "axial_speed": 0.1, "radial_spin": 0.1, "rolling_resistance": 1e-5, "mu_static": 0.35,
        }.items()
    ]  # fmt: skip
    assert len({scene.digest, *changed}) == 1 + len(changed)


def test_scenes_are_frozen() -> None:
    """Nobody can change a scene that somebody else holds."""
    scene = load_scene("sphere_in_cylinder")
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.title = "other"  # type: ignore[misc]  # that is the point


def test_two_balls_are_refused_by_name() -> None:
    """What represents one ball on one surface refuses a scene of two, and names what the scene holds."""
    scene = load_scene("sphere_in_cylinder")
    (one,) = scene.elements
    (other,) = scene_with(scene, ball=dataclasses.replace(placed(scene).ball, name="other")).elements
    with pytest.raises(Refused, match=rf"one ball in an upright cylinder.*{one.name}, other"):
        rolling_ball(dataclasses.replace(scene, elements=(one, other)))


def test_elements_have_names_of_their_own() -> None:
    """A scene needs an element, and two of one name, or of names that end alike, are refused, or they would mix."""
    scene = load_scene("sphere_in_cylinder")
    with pytest.raises(InputError, match="two elements have this name"):
        dataclasses.replace(scene, elements=scene.elements * 2)
    (one,) = scene.elements
    (dotted,) = scene_with(scene, ball=dataclasses.replace(placed(scene).ball, name=f"my.{one.name}")).elements
    assert dataclasses.replace(scene, elements=(dotted,)).elements == (dotted,)
    with pytest.raises(InputError, match="name the element without"):
        dataclasses.replace(scene, elements=(one, dotted))
    with pytest.raises(InputError, match="holds no element"):
        dataclasses.replace(scene, elements=())


def test_orientation_is_required_only_if_asked_for() -> None:
    """Asking adds the orientation to what is required and to the digest; a scene that asks nothing keeps its digest."""
    plain, asking = load_scene("sphere_in_cylinder"), load_scene("sphere_in_cylinder", asks=("orientation",))
    assert asking.requires - plain.requires == {MechanismCapability.ORIENTATION}
    assert asking.digest != plain.digest
    # Another digest than this would leave every stored result of the scene behind.
    assert dataclasses.replace(plain, files=()).digest == "b50f7202ef450ab3"


@pytest.mark.parametrize(("asks", "value"), [(("colour",), "colour"), ("orientations", "orientations"), (3, 3)])
def test_what_cannot_be_asked(asks: object, value: object) -> None:
    """Asking for something else gives one line with its name."""
    with pytest.raises(InputError) as caught:
        load_scene("sphere_in_cylinder", asks=asks)
    assert (caught.value.field, caught.value.value) == ("asks", value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Ball("b", 0.0, 1.0), "radius"),
        (lambda: Ball("b", 1.0, math.nan), "mass"),
        (lambda: Ball("b", 1.0, 1.0, -0.4), "inertia_ratio"),
        (lambda: Contact("b", "w", mu_static=-1.0, mu_kinetic=-1.0), "mu_static"),
        (lambda: Contact("b", "w", mu_static=0.3), "mu_kinetic"),
        (lambda: Contact("b", "w", -1e-9), "rolling_resistance"),
        (lambda: Gravity(math.inf), "magnitude"),
        (lambda: Gravity(9.81, (0.0, 0.0, 0.0)), "length of direction"),
        (lambda: InitialMotion("b", velocity=(math.nan, 0.0)), "velocity"),
        (lambda: Cylinder("w", -1.0), "radius"),
        (lambda: Plane("w", math.nan), "tilt"),
    ],
)
def test_parts_refuse_what_they_cannot_be(make: Callable[[], object], field: str) -> None:
    """Whoever makes a part of a scene from a number that makes no sense is told which one it is."""
    with pytest.raises(InputError) as caught:
        make()
    assert caught.value.field == field


def test_code_of_another_package_is_in_the_digest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What another package brings, an element or a part of it, decides a result with all its modules."""
    from proofroll.core.source_code import code_of

    package = tmp_path / "foreign_wall"
    (package / "inside").mkdir(parents=True)
    for folder in (package, package / "inside"):
        (folder / "__init__.py").write_text("")
    (package / "inside" / "wall.py").write_text("@__import__('dataclasses').dataclass\nclass Wall:\n    x: int = 1\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    wall = importlib.import_module("foreign_wall.inside.wall").Wall()
    before = code_of([{"surface": wall}])
    (package / "helper.py").write_text("y = 1")
    assert len(before) == 1
    assert code_of([{"surface": wall}]) != before
    assert code_of(load_scene("sphere_in_cylinder").elements) == []


def test_what_lies_beside_a_scene_and_is_no_model_is_no_matter(tmp_path: Path) -> None:
    """What lies beside a scene changes no digest; a file that the scene names does."""
    folder = tmp_path / "own"
    shutil.copytree(data_folder("models") / "sphere_in_cylinder", folder)
    before = load_scene(str(folder)).digest
    (folder / "run.nc").write_bytes(b"x" * 1000)
    (folder / "other.xml").write_text("<mujoco/>")
    (folder / "out").mkdir()
    assert load_scene(str(folder)).digest == before
    (folder / "mujoco_chart.xml").write_text("<mujoco/>")
    assert load_scene(str(folder)).digest != before
