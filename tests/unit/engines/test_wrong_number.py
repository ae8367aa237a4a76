"""A ball that an engine builds with one number wrong fails its certificate, by the number and by what it does."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cache

import pytest

from proofroll.core.certificate import certify
from proofroll.core.errors import Missing, Refused
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.elements.ball_on_surface.model import BallCapability
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build

RESISTED = {"rolling_resistance": 5e-4}
CYLINDER = {"speed": 3.3, "axial_speed": 0.7, "radial_spin": 12.0} | RESISTED
PLANE = {"tilt": 0.35, "cross_speed": 0.2} | RESISTED
SCENES: Mapping[str, Scene] = {
    "cylinder": load_scene("sphere_in_cylinder", **CYLINDER),
    "cylinder, bounded": load_scene("sphere_in_cylinder", **CYLINDER, mu_static=0.35),
    "cylinder, slipping": load_scene("sphere_in_cylinder", **RESISTED, mu_static=0.01),
    "plane": load_scene("inclined_plane", **PLANE),
    "plane, slipping": load_scene("inclined_plane", **PLANE, mu_static=0.05),
    "plane, kinetic": load_scene("inclined_plane", **PLANE | {"tilt": 0.6}, mu_static=0.1, mu_kinetic=0.07),
}
# What is changed: parameters as multiples, and the line that names it.
CHANGES: Mapping[str, tuple[Mapping[str, float], str]] = {
    "inertia": ({"inertia_ratio": 2.0}, "inertia"),
    "gravity": ({"gravity": 1.1}, "gravity"),
    "f doubled": ({"rolling_resistance": 2.0}, "rolling resistance"),
    "f dropped": ({"rolling_resistance": 0.0}, "rolling resistance"),
    "mu halved": ({"mu_kinetic": 0.5, "mu_static": 0.5}, "static friction"),  # never above it in between
}
DYNAMICS = {"acceleration", "angular acceleration", "N", "F2", "F3"}


def models() -> list[object]:
    """Engine, formulation and its first preset of each that builds balls; Pinocchio's contact with each of its solvers.

    Presets differ in how a ball moves on, not in how it is built and read back; that their certificates hold is a check
    of conformance.
    """
    found: list[object] = []
    for name in ("exudyn", "pinocchio"):
        try:
            engine = load_engine(name)
        except Missing as reason:
            found.append(pytest.param(name, id=name, marks=pytest.mark.skip(reason=str(reason))))
            continue
        for formulation, presets in engine.presets.items():
            if BallCapability.ROLLING in engine.provides[formulation]:
                found.append(f"{name}[formulation={formulation},preset={next(iter(presets))}]")
    admm = [
        f"{each},solver=admm]"
        for each in (str(item).removesuffix("]") for item in found)
        if "pinocchio[formulation=contact" in each
    ]
    return found + admm


def multiplied(scene: Scene, parameters: Mapping[str, float]) -> Scene:
    """The scene with some of its numbers multiplied."""
    ball, contact, gravity = scene.elements[0].ball, scene.elements[0].contact, scene.elements[0].gravity
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


@pytest.mark.parametrize(
    ("name", "change"),
    [(name, change) for name in SCENES for change in CHANGES if change != "mu halved" or "," in name],
)
@pytest.mark.parametrize("engine", models())
def test_the_certificate_notices(engine: str, name: str, change: str) -> None:
    """On each scene that the model represents it holds, and with the number wrong fails by it and by the motion."""
    scene, (parameters, quantity) = SCENES[name], CHANGES[change]
    if math.isfinite(rolling_ball(scene).contact.mu_static) and ("carrier" in engine or "rolling_disc" in engine):
        with pytest.raises(Refused, match="rolls without slip"):  # rows hold the ball both ways: nothing to be halved
            build(scene, engine)
        return
    if name == "plane, kinetic" and "exudyn[formulation=contact" in engine:
        with pytest.raises(Refused, match="one coefficient"):
            build(scene, engine)
        return
    assert failing_when_sound(engine, name) == []
    failing = {line.quantity for line in certify(build(multiplied(scene, parameters), engine), scene) if not line.holds}
    assert quantity in failing
    if change == "mu halved":
        assert "kinetic friction" in failing
    if change == "mu halved" and "bounded" in name:
        return  # a ball that sticks at time 0 does not feel how much friction is left
    if "contact,preset=default" in engine and "pinocchio" in engine:
        # The exception: the wall is a plane there for the length of a step and does not press yet at time 0, so
        # that friction, resistance and what the ball opposes to them act in part only.
        assert failing & DYNAMICS
    else:
        assert {"acceleration", "angular acceleration"} | ({"F2"} if change == "mu halved" else set()) <= failing
