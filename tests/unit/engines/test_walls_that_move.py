"""Contacts with driven bodies: a table that turns, a bore that shakes, a belt; motions and forces of their drives."""

from __future__ import annotations

import math

import numpy as np
import pytest

import proofroll
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene

RADIUS, MASS = 0.025, 0.5
BALL = Body("ball", MASS, inertia=(0.4 * MASS * RADIUS**2,) * 3)
SPHERE = Geometry("sphere", "ball", "sphere", radius=RADIUS)
ENGINES = [
    "mujoco[formulation=geoms,preset=tuned]",
    "exudyn[formulation=spheres]",
    "pinocchio[formulation=impulses]",
]


def _scene(joint: Joint, wall: Geometry, place: tuple[float, ...], v0: tuple[float, ...], friction: float) -> Scene:
    """A ball at a place with a velocity on a wall of a body that a joint drives."""
    free = Joint("free", "free", "world", "ball", q0=(*place, 1, 0, 0, 0), v0=v0)
    driven = Body(joint.child, 1.0, inertia=(1.0, 1.0, 1.0))
    mechanism = Mechanism(
        (BALL, driven),
        (free, joint),
        geometries=(SPHERE, wall),
        pairs=(Pair("contact", ("sphere", wall.name), friction),),
    )
    return Scene("driven", "", (MechanismElement(mechanism),))


SCENES = {
    # a ball at rest in the world, on a table that turns at 3 rad/s under it
    "turntable": _scene(
        Joint("axle", "revolute", "world", "table", motion=Formula("3*t")),
        Geometry("top", "table", "plane"),
        (0.3, 0.0, RADIUS),
        (0.0, 0.0, 0.0, 0.9 / RADIUS, 0.0, 0.0),
        math.inf,
    ),
    # a ball at rest at the bottom of a lying bore that shakes across its axis: it slips, and then rolls
    "shaken bore": _scene(
        Joint("shake", "prismatic", "world", "tube", axis=(1.0, 0.0, 0.0), motion=Formula("0.005*sin(20*t)")),
        Geometry("inside", "tube", "bore", radius=0.225, axis=(0.0, 1.0, 0.0)),
        (0.0, 0.0, -0.2),
        (0.0,) * 6,
        0.3,
    ),
}


@pytest.mark.parametrize("engine", ENGINES)
def test_a_table_turns_under_a_ball(engine: str) -> None:
    """A ball whose spin is the table's speed there stays in its place, without friction."""
    run = proofroll.simulate(SCENES["turntable"], engine, until=0.1, every=0.1)
    # 1e-7 m is some times what the softest contact leaves
    np.testing.assert_allclose(run["p_WB"].sel(body="ball").to_numpy()[-1], (0.3, 0.0, RADIUS), atol=1e-7)
    np.testing.assert_allclose(run["w_WB"].to_numpy()[-1], [[0.9 / RADIUS, 0, 0], [0, 0, 3.0]], atol=1e-4)
    assert float(np.abs(run["drive.axle"].to_numpy()).max()) < 5e-3


@pytest.mark.one_in(3)
@pytest.mark.nightly_of(
    "mujoco[formulation=geoms,preset=tuned]-shaken bore-0.0001-0.1", "projection-turntable-1e-07-0.005"
)
@pytest.mark.drill
@pytest.mark.parametrize(("name", "place", "push"), [("turntable", 1e-7, 5e-3), ("shaken bore", 1e-4, 0.1)])
@pytest.mark.parametrize("engine", [*ENGINES, "projection"])
def test_a_ball_on_a_driven_wall_moves_as_the_truth_says(engine: str, name: str, place: float, push: float) -> None:
    """Path, and forces of contact and drive, are off by no more than first order; the model passes its certificate.

    ``place`` [m] and ``push`` [N, N m]: some times what the worst engine leaves at 1e-3 s.
    """
    scene = SCENES[name]
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.2, every=0.05), scene)
    errors = {item.judgement.observable: item.judgement.error for item in found.compared}
    assert errors["positions"] < place
    (drive,) = (error for observable, error in errors.items() if observable.startswith("drive."))
    assert max(drive, errors["contact_forces"]) < push


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.drill_of("projection")
@pytest.mark.parametrize("engine", [ENGINES[0], "pinocchio[formulation=impulses,dt=2e-3]", "projection"])
def test_a_parcel_is_carried_along_by_a_belt(engine: str) -> None:
    """It gains mu g until it has the belt's speed; the drive pulls with mu m g, and then with nothing."""
    mu, m, g, speed = 0.3, 2.0, 9.81, 0.8
    joints = (
        Joint("run", "prismatic", "world", "belt", axis=(1.0, 0.0, 0.0), motion=Formula(f"{speed}*t")),
        Joint("free", "free", "world", "parcel", q0=(0, 0, 0.1, 1, 0, 0, 0)),
    )
    shapes = (Geometry("top", "belt", "plane"), Geometry("sides", "parcel", "box", size=(0.3, 0.3, 0.2)))
    bodies = (Body("belt", 5.0), Body("parcel", m, inertia=(0.02,) * 3))
    mechanism = Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("carry", ("sides", "top"), mu),))
    run = proofroll.simulate(Scene("belt", "", (MechanismElement(mechanism),)), engine, until=0.4, every=0.1)
    t, carried = run["time"].to_numpy(), speed / (mu * g)
    x = np.where(t < carried, mu * g * t**2 / 2, speed * t - speed * carried / 2)
    np.testing.assert_allclose(run["p_WB"].sel(body="parcel").to_numpy()[:, 0], x, atol=1e-3)  # half a step at 0.8 m/s
    pull = np.where(t < carried, mu * m * g, 0.0)
    np.testing.assert_allclose(run["drive.run"].to_numpy()[1:], pull[1:], atol=1e-5)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("preset", ["matched", "tuned"])
def test_pinocchio_tells_the_friction_of_a_driven_table_at_the_start(preset: str) -> None:
    """Forces at the start belong to the motion's place at the start, also where steps take all at their middle."""
    scene, grid = load_scene("turntable"), {"until": 0.02, "every": 0.01}
    run = proofroll.simulate(scene, f"pinocchio[formulation=impulses,preset={preset}]", **grid)
    right = proofroll.simulate(scene, "truth", **grid)
    for force in ("F2", "F3"):
        assert abs(run[force].values - right[force].values).max() < 2e-3  # N


@pytest.mark.nightly
def test_exudyns_triangle_of_a_turning_plane_does_not_press_by_round_off() -> None:
    """It is small and stays under the ball; Newton's method did not converge with corners a kilometre off."""
    scene, grid = load_scene("turntable"), {"until": 0.1, "every": 0.05}
    run = proofroll.simulate(scene, "exudyn[formulation=spheres,dt=1e-3]", **grid)
    right = proofroll.simulate(scene, "truth", **grid)
    assert run.attrs["status"] == "done"
    assert abs(run["p_WB"].values - right["p_WB"].values).max() < 1e-4  # m
    assert abs(run["N"].values - right["N"].values).max() < 1e-9  # N; 1e-7 with corners a kilometre off


@pytest.mark.drill
def test_exudyns_triangle_of_a_moving_plane_follows_a_sphere_that_goes_far() -> None:
    """A ball that slides by twenty of its radii over a plane that a motion lifts stays on it."""
    joints = (
        Joint("lift", "prismatic", "world", "floor", axis=(0.0, 0.0, 1.0), motion=Formula("0.1*t")),
        Joint("free", "free", "world", "ball", q0=(0, 0, 0.02, 1, 0, 0, 0), v0=(4.0, 0, 0.1, 0, 0, 0)),
    )
    shapes = (Geometry("top", "floor", "plane"), Geometry("round", "ball", "sphere", radius=0.02))
    bodies = (Body("floor", 5.0), Body("ball", 0.1, inertia=(2e-5,) * 3))
    mechanism = Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("touch", ("round", "top"), 0.0),))
    scene = Scene("lift", "", (MechanismElement(mechanism),))
    run = proofroll.simulate(scene, "exudyn[formulation=spheres,dt=1e-3]", until=0.1, every=0.05)
    place = run["p_WB"].sel(body="ball").to_numpy()[-1]
    np.testing.assert_allclose(place, [0.4, 0.0, 0.03], atol=1e-6)  # m; it fell by 25 mm beside the triangle


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.drill_of("0.1")
@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_the_projection_solver_rolls_a_ball_on_a_driven_table(tilt: float) -> None:
    """Path, forces and slip on a plane that a motion turns are the truth's to round-off."""
    scene, grid = load_scene("turntable", tilt=tilt), {"until": 0.1, "every": 0.05}
    run, right = (proofroll.simulate(scene, engine, **grid) for engine in ("projection", "truth"))
    for field in ("p_WB", "v_WB", "F2", "F3", "N"):
        assert abs(run[field].values - right[field].values).max() < 2e-13  # 2e-14 is seen
