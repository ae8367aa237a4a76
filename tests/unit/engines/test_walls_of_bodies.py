"""A ball written as a body with a sphere on a wall, in the general contact formulations of the engines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from balls_on_walls import MASS, MOMENT, RADIUS, SHARE, WALLS, on_wall

import proofroll
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene

GRAVITY = 9.81


def ball_in_bore(*, friction: float = math.inf, speed: float = 4.0) -> Mechanism:
    """A ball that rolls round in a vertical bore, in which its centre has a circle of 0.2 m."""
    joint = Joint("free", "free", "world", "ball", q0=(0.2, 0, 0, 1, 0, 0, 0), v0=(0, speed, 0, 0, 0, -speed / RADIUS))
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=RADIUS),
        Geometry("wall", "world", "bore", radius=0.2 + RADIUS),
    )
    pairs = (Pair("contact", ("sphere", "wall"), friction),)
    return Mechanism((Body("ball", MASS, inertia=(MOMENT,) * 3),), (joint,), geometries=shapes, pairs=pairs)


def place_in_bore(t: float, speed: float = 4.0) -> np.ndarray:
    """Centre of that ball [m] where it never slips: round at a constant rate, up and down as an oscillator."""
    rate = speed / 0.2
    drop = GRAVITY / (SHARE * rate**2) * (1 - math.cos(math.sqrt(SHARE / (1 + SHARE)) * rate * t))
    return np.array([0.2 * math.cos(rate * t), 0.2 * math.sin(rate * t), -drop])


def leaning_wheel(friction: float) -> Mechanism:
    """A thin wheel that rolls and leans on a plane."""
    joint = Joint("f", "free", "world", "wheel", q0=(0, 0, 0.3, 1, 0, 0, 0), v0=(1.5, -0.3, 0, 1, 5, 0))
    shapes = (Geometry("ground", "world", "plane"), Geometry("rim", "wheel", "circle", radius=0.3, normal=(0, 1, 0)))
    pairs = (Pair("touch", ("rim", "ground"), friction),)
    return Mechanism((Body("wheel", 2.0, inertia=(0.12, 0.06, 0.12)),), (joint,), geometries=shapes, pairs=pairs)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("friction", [math.inf, 100.0, 5.0])
@pytest.mark.parametrize(
    ("preset", "order", "errors"),
    [("default", 1, (5e-4, 1.5e-3)), ("matched", 1, (5e-4, 1.5e-3)), ("tuned", 2, (4e-5, 2e-4))],
)
def test_impulses_hold_a_ball_by_any_friction(
    friction: float, preset: str, order: int, errors: tuple[float, float]
) -> None:
    """A cone wider than rolling needs, however wide, leaves the path at the order of its steps."""
    pinocchio = load_engine("pinocchio")
    off = []
    for dt in (1e-3, 5e-4):
        run = pinocchio.build(ball_in_bore(friction=friction), replace(pinocchio.presets["impulses"][preset], dt=dt))
        run.advance(0.2)
        off.append(float(np.linalg.norm(run.sample().p_WB[0] - place_in_bore(0.2))))
    assert errors[0] < off[0] < errors[1]  # m, of first order about 1 m/s times the step
    assert 0.9 * 2**order < off[0] / off[1] < 1.25 * 2**order


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("friction", [math.inf, 100.0])
def test_impulses_hold_a_wheel_by_any_friction(friction: float) -> None:
    """A wheel whose contact gives way unequally rolls with any friction as with one that is just enough."""
    pinocchio = load_engine("pinocchio")
    wide, enough = (
        pinocchio.build(leaning_wheel(mu), pinocchio.presets["impulses"]["matched"]) for mu in (friction, 0.5)
    )
    for run in (wide, enough):
        run.advance(0.3)
    # both are found to 1e-8 of impulses that add up to some m/s
    np.testing.assert_allclose(wide.sample().p_WB, enough.sample().p_WB, rtol=0, atol=1e-7)


@pytest.mark.parametrize(("preset", "errors"), [("matched", (1.9e-3, 6.1e-4)), ("tuned", (5.3e-5, 1.33e-5))])
def test_a_plane_in_mujoco_stands_for_a_bore(preset: str, errors: tuple[float, float]) -> None:
    """A ball that rolls round is off by the first order of steps, and with J̇v by the second, velocities included."""
    mujoco = load_engine("mujoco")
    for dt, error in zip((1e-3, 5e-4), errors, strict=True):
        run = mujoco.build(ball_in_bore(), replace(mujoco.presets["geoms"][preset], dt=dt))
        run.advance(0.2)
        sample, little = run.sample(), 1e-6
        assert float(np.linalg.norm(sample.p_WB[0] - place_in_bore(0.2))) == pytest.approx(error, rel=0.05)
        v = (place_in_bore(0.2 + little) - place_in_bore(0.2 - little)) / (2 * little)
        # over the wall it is off by 20 to 40 /s times the place
        assert float(np.linalg.norm(sample.v_WB[0] - v)) < 50 * error


def test_a_plane_in_mujoco_presses_in_every_step() -> None:
    """With J̇v the wall holds a ball from the first step on: no step is without a force, and no gap opens."""
    mujoco = load_engine("mujoco")
    run = mujoco.build(ball_in_bore(), mujoco.presets["geoms"]["tuned"])
    press = MASS * 4.0**2 / 0.2
    for step in range(1, 40):
        run.advance(step * 1e-3)
        sample = run.sample()
        inward = -sample.p_WB[0] * (1, 1, 0) / 0.2
        assert sample.contact_force[0] @ inward == pytest.approx(press, rel=2e-3)  # (Ω dt)² is 4e-4
        assert abs(np.hypot(*sample.p_WB[0, :2]) - 0.2) < 1e-7


@pytest.mark.parametrize("dt", [1e-3, pytest.param(1e-4, marks=pytest.mark.drill)])
def test_a_hollow_sphere_in_exudyn_stands_for_a_bore(dt: float) -> None:
    """A ball that rolls round is off by the second order of steps, and by its creep and the wall's indentation."""
    exudyn = load_engine("exudyn")
    run = exudyn.build(ball_in_bore(), replace(exudyn.presets["spheres"]["matched"], dt=dt))
    run.advance(0.2)
    assert float(np.linalg.norm(run.sample().p_WB[0] - place_in_bore(0.2))) < 100 * dt**2 + 5e-6


@pytest.mark.one_in(3)
@pytest.mark.parametrize("kind", list(WALLS))
@pytest.mark.parametrize("setting", ["mujoco geoms matched", "mujoco geoms tuned", "exudyn spheres matched"])
@pytest.mark.parametrize("swapped", [False, True])
def test_walls_are_certified(kind: str, setting: str, swapped: bool) -> None:
    """Gap, normal, place, responses and first accelerations on each wall are the scene's, either way round."""
    mechanism, (engine, formulation, preset) = on_wall(kind, swapped=swapped), setting.split()
    run = load_engine(engine).build(mechanism, load_engine(engine).presets[formulation][preset])
    lines = MechanismElement(mechanism).certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    told = {line.quantity for line in lines if line.difference is not None}
    assert {"gaps", "normals of contact", "places of contact", "friction of contacts"} <= told
    assert engine != "mujoco" or "responses of contacts" in told
    assert setting == "mujoco geoms matched" or "forces of contact" in told


@pytest.mark.parametrize(
    ("kind", "wide", "place"), [("bowl", 0.5, 0.2), ("bowl", 0.5, 0.02), ("shaft", 0.1, 0.1 + 8 * RADIUS)]
)
def test_a_ball_far_from_its_wall_is_certified_in_exudyn(kind: str, wide: float, place: float) -> None:
    """The hollow sphere fits the wall where the ball will touch it, and its gap is the wall's at the start."""
    shapes = Geometry("sphere", "ball", "sphere", radius=RADIUS), Geometry("wall", "world", kind, radius=wide)
    joint = Joint("free", "free", "world", "ball", q0=(place, 0, 0, 1, 0, 0, 0))
    body, pair = Body("ball", MASS, inertia=(MOMENT,) * 3), Pair("contact", ("sphere", "wall"), 0.3)
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,))
    exudyn = load_engine("exudyn")
    run = exudyn.build(mechanism, exudyn.presets["spheres"]["matched"])
    lines = MechanismElement(mechanism).certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []


@pytest.mark.parametrize("setting", ["mujoco geoms matched", "exudyn spheres matched"])
def test_a_ball_at_the_centre_of_a_bowl_falls(setting: str) -> None:
    """Where all points of a wall are as near, no contact acts, and the ball falls freely."""
    engine, formulation, preset = setting.split()
    shapes = (Geometry("sphere", "ball", "sphere", radius=RADIUS), Geometry("wall", "world", "bowl", radius=0.5))
    body = Body("ball", MASS, inertia=(MOMENT,) * 3)
    pairs = (Pair("contact", ("sphere", "wall"), 0.3),)
    mechanism = Mechanism((body,), (Joint("free", "free", "world", "ball"),), geometries=shapes, pairs=pairs)
    run = load_engine(engine).build(mechanism, load_engine(engine).presets[formulation][preset])
    run.advance(0.1)
    assert run.sample().p_WB[0] == pytest.approx([0, 0, -GRAVITY * 0.1**2 / 2], abs=GRAVITY * 0.1 * 1e-3)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("bowl-0.001-4e-06")
@pytest.mark.parametrize(
    ("name", "resistance", "error"),
    [
        ("sphere_in_cylinder", 0.0, 2.5e-3),
        ("bowl", 0.0, 2e-5),
        ("cone", 0.0, 4e-6),
        ("bowl", 1e-3, 4e-6),  # 2e-6 m is seen; of first order it would be 7e-5
    ],
)
def test_pinocchios_midpoint_is_of_second_order_on_curved_walls(name: str, resistance: float, error: float) -> None:
    """Half the step gives a quarter of the error: the wall turns within a step (J̇v), and so does what rolls."""
    scene, grid = load_scene(name, rolling_resistance=resistance), {"until": 0.4, "every": 0.04}
    right = proofroll.simulate(scene, "truth", **grid)["p_WB"].values
    settings = [f"pinocchio[formulation=impulses,preset=tuned,dt={dt}]" for dt in (4e-3, 2e-3)]
    far, near = (abs(proofroll.simulate(scene, setting, **grid)["p_WB"].values - right).max() for setting in settings)
    assert near < error
    assert 3.5 < far / near < 4.5
