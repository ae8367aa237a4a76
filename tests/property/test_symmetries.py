"""What must follow when the whole problem is rotated, mirrored, rescaled, shifted, reversed or split in two."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from ball_scenes import rolled
from hypothesis import given
from hypothesis import strategies as st
from placed_balls import of_ball, placed, run_of, scene_with

from proofroll.core.certificate import certify, first_difference
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.audits import energy_balance
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.running.simulation import build, simulate

Changes = Mapping[str, float]

UNTIL = 0.06
# Route and engine are integrated with relative local errors of 1e-13 or less over some hundred steps.
CLOSE = 1e-10

MOTIONS = st.fixed_dictionaries(
    {
        "speed": st.floats(1.5, 6.0),
        "axial_speed": st.floats(-2.0, 2.0),
        "radial_spin": st.floats(-30.0, 30.0),
        "rolling_resistance": st.sampled_from([0.0, 2e-4, 1e-3]),
    }
)


def solve(way: str, scene: Scene, until: float, samples: int = 3) -> xr.Dataset:
    """The scene's trajectory by the route of first slips or by an engine."""
    if way == "first route":
        body = rolling_ball(scene)
        motion = rolled(body, np.linspace(0, until, samples))
        parts = motion.p_WB, motion.v_WB, motion.w_WB
        return run_of(scene, np.linspace(0, until, samples), *parts, force=motion.force)
    return simulate(scene, way, until=until, every=until / (samples - 1))


@pytest.fixture(params=["first route", "projection[formulation=rotating_frame]"])
def way(request: pytest.FixtureRequest) -> Any:
    """The route of first slips, and the engine that is part of the project; its Euler angles: ``test_extremes``."""
    return request.param


def moved(scene: Scene, coordinates: tuple[float, float]) -> Scene:
    """The same scene with the ball starting somewhere else on the surface."""
    start = dataclasses.replace(placed(scene).start, coordinates=coordinates)
    return scene_with(scene, start=start)


# Size of each quantity, by which a difference is judged.
SIZES = {"gamma": 1.0, "z": 0.1, "gamma_rate": 10.0, "z_rate": 1.0, "N": 50.0, "F2": 5.0, "F3": 5.0, "energy": 5.0}
SIZES |= {"omega1": 50.0, "omega2": 50.0, "omega3": 100.0}


def assert_same(found: xr.Dataset, expected: xr.Dataset, shifts: Changes = {}, factors: Changes = {}) -> None:  # noqa: B006 -- read only
    """All quantities are those expected, after each one's factor and shift."""
    for name, size in SIZES.items():
        factor = factors.get(name, 1.0)
        wanted = expected[name].to_numpy() * factor + shifts.get(name, 0.0)
        assert found[name].to_numpy() == pytest.approx(wanted, abs=CLOSE * size * max(1.0, abs(factor))), name


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS, gamma=st.floats(-3.0, 3.0))
def test_rotation_about_the_axis(way: str, motion: dict[str, float], gamma: float) -> None:
    """A ball that starts elsewhere around the cylinder does the same there."""
    scene = load_scene("sphere_in_cylinder", **motion)
    assert_same(solve(way, moved(scene, (gamma, 0.0)), UNTIL), solve(way, scene, UNTIL), {"gamma": gamma})


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS, height=st.floats(-2.0, 2.0))
def test_shift_along_the_axis(way: str, motion: dict[str, float], height: float) -> None:
    """A ball that starts higher does the same higher up, with more potential energy."""
    scene = load_scene("sphere_in_cylinder", **motion)
    lifted = solve(way, moved(scene, (0.0, height)), UNTIL)
    assert_same(lifted, solve(way, scene, UNTIL), {"z": height, "energy": 0.517 * 9.81 * height})


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS)
def test_mirror(way: str, motion: dict[str, float]) -> None:
    """In a mirror through the axis the ball goes round the other way, and what is an axial vector turns over."""
    scene = load_scene("sphere_in_cylinder", **motion)
    mirrored = motion | {"speed": -motion["speed"], "radial_spin": -motion["radial_spin"]}
    reflected = solve(way, load_scene("sphere_in_cylinder", **mirrored), UNTIL)
    signs = dict.fromkeys(("gamma", "gamma_rate", "F2", "omega1", "omega3"), -1)
    assert_same(reflected, solve(way, scene, UNTIL), factors=signs)


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS, length=st.floats(0.1, 10), mass=st.floats(0.1, 10), time=st.floats(0.3, 3))
def test_units(way: str, motion: dict[str, float], length: float, mass: float, time: float) -> None:
    """In other units of length, mass and time every answer is the same quantity in those units."""
    scene = load_scene("sphere_in_cylinder", **motion)
    dimensions = {
        "radius": length, "cylinder_radius": length, "mass": mass, "gravity": length / time**2,
        "speed": length / time, "axial_speed": length / time, "radial_spin": 1 / time, "rolling_resistance": length,
    }  # fmt: skip
    rescaled = {name: scene.parameters[name] * factor for name, factor in dimensions.items()}
    force = mass * length / time**2
    factors = {"z": length, "gamma_rate": 1 / time, "z_rate": length / time, "energy": force * length}
    factors |= dict.fromkeys(("omega1", "omega2", "omega3"), 1 / time) | dict.fromkeys(("N", "F2", "F3"), force)
    found = solve(way, load_scene("sphere_in_cylinder", **rescaled), UNTIL * time)
    assert_same(found, solve(way, scene, UNTIL), factors=factors)


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS)
def test_one_run_in_two(way: str, motion: dict[str, float]) -> None:
    """A run that starts from the state in the middle of another ends where the other ends."""
    scene = load_scene("sphere_in_cylinder", **motion)
    whole = solve(way, scene, 2 * UNTIL)
    middle = {name: float(whole[name][1]) for name in SIZES}
    start = dataclasses.replace(
        placed(scene).start,
        coordinates=(middle["gamma"], middle["z"]),
        velocity=(0.2 * middle["gamma_rate"], middle["z_rate"]),
        spin=middle["omega1"],
    )
    rest = solve(way, scene_with(scene, start=start), UNTIL)
    assert_same(rest.isel(time=[-1]), whole.isel(time=[-1]))


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS)
def test_reversal(way: str, motion: dict[str, float]) -> None:
    """Without resistance a ball whose velocities are reversed goes back to where it came from."""
    scene = load_scene("sphere_in_cylinder", **(motion | {"rolling_resistance": 0.0}))
    there = solve(way, scene, UNTIL)
    end = {name: float(there[name][-1]) for name in SIZES}
    start = dataclasses.replace(
        placed(scene).start,
        coordinates=(end["gamma"], end["z"]),
        velocity=(-0.2 * end["gamma_rate"], -end["z_rate"]),
        spin=-end["omega1"],
    )
    back = solve(way, scene_with(scene, start=start), UNTIL)
    signs = dict.fromkeys(("gamma_rate", "z_rate", "omega1", "omega2", "omega3"), -1)
    assert_same(back.isel(time=[-1]), there.isel(time=[0]), factors=signs)


@pytest.mark.drill
@pytest.mark.one_in(2)
@given(motion=MOTIONS)
def test_energy_is_accounted_for(way: str, motion: dict[str, float]) -> None:
    """What the energy loses is what the resistance takes; without resistance it loses nothing."""
    scene = load_scene("sphere_in_cylinder", **motion)
    dataset = solve(way, scene, 0.3, samples=31)
    kinetic = float(dataset["energy"][0])
    # a spline of degree 7 through 31 samples integrates the power to about 1e-9 of the work
    bound = 1e-9 if motion["rolling_resistance"] else 1e-11
    assert np.max(np.abs(energy_balance(scene.elements[0].on_wall, of_ball(dataset)))) < bound * kinetic


@pytest.mark.drill
@given(motion=MOTIONS, radius=st.floats(0.005, 0.2), mass=st.floats(1e-3, 1e3), gravity=st.floats(0, 50))
def test_certificate_of_random_scenes(motion: dict[str, float], radius: float, mass: float, gravity: float) -> None:
    """Whatever the numbers of a scene, the engine builds it, to round-off."""
    scene = load_scene("sphere_in_cylinder", **motion, radius=radius, mass=mass, gravity=gravity)
    for formulation in ("euler", "rotating_frame"):
        assert first_difference(certify(build(scene, "projection", formulation=formulation), scene)) is None
