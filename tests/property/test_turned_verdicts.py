"""What is told of a scene holds in a world whose axes are turned and shifted, with its parts renamed and reordered."""

from __future__ import annotations

import dataclasses
import random
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_templates import mjcf, urdf
from scene_answers import answers, differences
from turned_scenes import shuffled, turned_scene

from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.scene.rotations import from_rpy
from proofroll.files.scene_file import load_scene
from proofroll_drill.referee.random_contacts import random_contacts
from proofroll_drill.referee.random_mechanisms import random_mechanism

EVERY = 0.01  # s
NIGHTLY = pytest.mark.nightly
# Scenes of models/ -> last time [s]: those of the quick tests, and those of the night.
QUICK = {"four_bar": 0.1, "stop": 0.3, "friction_hold": 0.1, "falling_rod": 0.1}
NIGHT = dict.fromkeys(
    (
        "pendulum", "slider_crank", "bricard", "double_pendulum", "gear_pair", "heavy_top", "chain", "gyroscope_cart",
        "oscillators", "servo", "arm_pd", "saturated_servo", "arm_rotor", "pendulum_friction", "spring_friction",
        "stiff_damper", "rocking_block", "sled", "sled_on_slope", "eccentric_sphere", "spinning_bounce", "cradle",
        "ladder", "tilted_disc", "free_turntable", "flick", "rattleback", "painleve_rod", "slung_load",
    ),
    0.2,
)  # fmt: skip


def heavier(scene: Scene) -> Scene:
    """The scene with a tenth more of gravity."""
    mechanism = the_mechanism(scene).mechanism
    return _with(scene, gravity=tuple(1.1 * part for part in mechanism.gravity))


def rougher(scene: Scene) -> Scene:
    """The scene with half as much friction again in each contact."""
    pairs = the_mechanism(scene).mechanism.pairs
    return _with(scene, pairs=tuple(dataclasses.replace(pair, friction=1.5 * pair.friction) for pair in pairs))


def massive(scene: Scene) -> Scene:
    """The scene with its heaviest body heavier by 30 per cent."""
    bodies = the_mechanism(scene).mechanism.bodies
    most = max(body.mass for body in bodies)
    changed = (dataclasses.replace(body, mass=1.3 * body.mass) if body.mass == most else body for body in bodies)
    return _with(scene, bodies=tuple(changed))


def _with(scene: Scene, **changes: Any) -> Scene:
    mechanism = dataclasses.replace(the_mechanism(scene).mechanism, **changes)
    return dataclasses.replace(scene, elements=(MechanismElement(mechanism),))


def runs_of(scene: Scene) -> dict[str, Callable[[Scene], Scene] | None]:
    """Engines that run the scene, and one that runs it with a fault that it does not tell."""
    if the_mechanism(scene).mechanism.pairs:
        mujoco, pinocchio = "mujoco[formulation=geoms,preset=tuned]", "pinocchio[formulation=impulses,preset=tuned]"
        return {mujoco: None, pinocchio: None, f"{pinocchio} heavier": heavier, f"{pinocchio} rougher": rougher}
    mujoco, pinocchio = "mujoco[formulation=joints,preset=tuned]", "pinocchio[formulation=null_space,preset=tuned]"
    return {mujoco: None, f"{pinocchio} heavier": heavier, f"{pinocchio} massive": massive}


def assert_told_alike(scene: Scene, until: float, seed: int) -> None:
    """What is told of a scene of a mechanism is told of it elsewhere, too."""
    place = np.random.default_rng(seed)
    rpy, shift = tuple(place.uniform(-3, 3, 3)), tuple(place.uniform(-2, 2, 3))
    other, names = shuffled(turned_scene(scene, rpy, shift), random.Random(seed))
    every = min(EVERY, until / 10)
    told = [answers(each, until, every, runs_of(scene)) for each in (scene, other)]
    rotation = from_rpy(rpy)
    assert differences(told[0], told[1], names, lambda p: p @ rotation.T + np.array(shift)) == []


def _cases(quick: Iterable[Any], night: Iterable[Any]) -> list[Any]:
    """Cases of the drills, and those of the night."""
    tonight = [pytest.param(case, marks=NIGHTLY) for case in night if case not in set(quick)]
    return [*(pytest.param(case, marks=pytest.mark.drill) for case in quick), *tonight]


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("stop", "friction_hold")
@pytest.mark.parametrize("name", _cases(QUICK, NIGHT))
def test_a_scene_is_told_alike_elsewhere(name: str) -> None:
    """Verdicts, events, causes and the end of the truth of a scene of a mechanism are those of it elsewhere."""
    assert_told_alike(load_scene(name), (QUICK | NIGHT)[name], sum(map(ord, name)))


@pytest.mark.nightly
@pytest.mark.parametrize("seed", _cases([30], range(60)))
def test_a_random_mechanism_is_told_alike_elsewhere(seed: int) -> None:
    """The same of random trees and loops of all kinds of joints."""
    _, mechanism = random_mechanism(seed)
    assert_told_alike(Scene("random", "", (MechanismElement(mechanism),)), 0.2, seed)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", _cases([0], range(110)))
def test_a_random_contact_is_told_alike_elsewhere(seed: int) -> None:
    """The same of random bodies that touch."""
    _, mechanism, until = random_contacts(seed)
    assert_told_alike(Scene("random", "", (MechanismElement(mechanism),)), until, seed)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("ending", "text"),
    [pytest.param("urdf", urdf(), marks=pytest.mark.drill), pytest.param("xml", mjcf(), marks=NIGHTLY)],
)
def test_a_robot_is_told_alike_elsewhere(ending: str, text: str, tmp_path: Path) -> None:
    """The same of robot files."""
    file = tmp_path / f"robot.{ending}"
    file.write_text(text)
    assert_told_alike(load_scene(str(file)), 0.1, 7)
