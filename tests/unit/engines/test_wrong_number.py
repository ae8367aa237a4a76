"""A ball that an engine builds with one number wrong fails its certificate, by the number and by what it does."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cache

import pytest
from placed_balls import gravity_of, placed, scene_with

from proofroll.core.certificate import certify
from proofroll.core.errors import Missing
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build

RESISTED = {"rolling_resistance": 5e-4}
CYLINDER = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0} | RESISTED
SCENES: Mapping[str, Scene] = {
    "cylinder": load_scene("sphere_in_cylinder", **CYLINDER),
    "cylinder, backwards": load_scene(
        "sphere_in_cylinder", **RESISTED, speed=-2.0, axial_speed=-0.5, radius=0.05, mass=2.0, gravity=1.6
    ),
}
# What is changed: parameters as multiples, and the line that names it.
CHANGES: Mapping[str, tuple[Mapping[str, float], str]] = {
    "inertia": ({"inertia_ratio": 2.0}, "inertia"),
    "gravity": ({"gravity": 1.1}, "gravity"),
    "f doubled": ({"rolling_resistance": 2.0}, "rolling resistance"),
    "f dropped": ({"rolling_resistance": 0.0}, "rolling resistance"),
}
# Formulations that tell no acceleration at time 0, or one that a soft contact changes by more than these numbers do.
SOFTENED = ("spheres", "impulses", "geoms")
NEEDED = {MechanismCapability.UNBOUNDED_FRICTION, MechanismCapability.TURNING_FRICTION}


def models() -> list[object]:
    """Engine, formulation and its first preset of each that builds balls.

    Presets differ in how a ball moves on, not in how it is built and read back; that their certificates hold is a check
    of conformance.
    """
    found: list[object] = []
    for name in ("exudyn", "pinocchio", "mujoco"):
        try:
            engine = load_engine(name)
        except Missing as reason:
            found.append(pytest.param(name, id=name, marks=pytest.mark.skip(reason=str(reason))))
            continue
        for formulation, presets in engine.presets.items():
            if engine.provides[formulation] >= NEEDED:
                preset = (
                    "matched" if name == "mujoco" else next(iter(presets))
                )  # MuJoCo's default cone takes no such friction
                found.append(f"{name}[formulation={formulation},preset={preset}]")
    return found


def multiplied(scene: Scene, parameters: Mapping[str, float]) -> Scene:
    """The scene with some of its numbers multiplied."""
    ball, contact, gravity = placed(scene).ball, placed(scene).contact, gravity_of(scene)
    for name, factor in parameters.items():
        if name == "gravity":
            gravity = dataclasses.replace(gravity, magnitude=factor * gravity.magnitude)
        elif name == "inertia_ratio":
            ball = dataclasses.replace(ball, inertia_ratio=factor * ball.inertia_ratio)
        else:
            contact = dataclasses.replace(contact, **{name: factor * getattr(contact, name)})
    return scene_with(scene, ball=ball, contact=contact, gravity=gravity)


@cache
def failing_when_sound(engine: str, name: str) -> list[str]:
    """Lines of the certificate that fail where nothing is wrong."""
    return [line.quantity for line in certify(build(SCENES[name], engine), SCENES[name]) if not line.holds]


@pytest.mark.one_in(4)
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("engine", models())
def test_the_certificate_notices(engine: str, name: str, change: str) -> None:
    """On each scene that the model represents it holds, and with the number wrong fails by it and by the motion."""
    scene, (parameters, quantity) = SCENES[name], CHANGES[change]
    assert failing_when_sound(engine, name) == []
    failing = {line.quantity for line in certify(build(multiplied(scene, parameters), engine), scene) if not line.holds}
    assert quantity in failing
    if not any(name in engine for name in SOFTENED):
        assert {"acceleration", "angular acceleration"} <= failing
