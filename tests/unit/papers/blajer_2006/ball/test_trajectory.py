from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import xarray as xr
from placed_balls import of_ball, placed, run_of, sample_of, scene_with

from proofroll.core.dataset import from_samples
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.rolling_equations import closed_form


def exact(scene: Scene, times: np.ndarray) -> xr.Dataset:
    """The closed form alone, which costs nothing."""
    motion = closed_form(rolling_ball(scene), times)
    assert motion is not None
    return run_of(scene, times, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)


@pytest.mark.parametrize("every", [0.01, 0.25, 0.7, 1.3])
@pytest.mark.parametrize("speed", [4.0, -6.0])
def test_angle_is_unwrapped(every: float, speed: float) -> None:
    """γ grows without jumps also when the ball goes round up to six times between two samples."""
    scene = load_scene("sphere_in_cylinder", speed=speed)
    times = np.arange(0, 5, every)
    assert exact(scene, times)["gamma"].to_numpy() == pytest.approx(speed / 0.2 * times, abs=1e-9)


def test_angle_starts_on_the_branch_of_the_scene() -> None:
    """An initial γ beyond half a turn stays what it is."""
    scene = load_scene("sphere_in_cylinder")
    start = dataclasses.replace(placed(scene).start, coordinates=(40.0, 0.1))
    found = exact(scene_with(scene, start=start), np.array([0, 0.1]))["gamma"]
    assert found.to_numpy() == pytest.approx([40.0, 42.0], abs=1e-12)


def test_derived_variables(scene: Scene) -> None:
    """Rates, slip, local forces and needed friction follow from the state and the force by their definitions."""
    times = np.linspace(0, 0.1, 5)
    dataset = of_ball(truth(scene, times))
    body = rolling_ball(scene)
    names = body.surface.coordinates
    u = np.stack([dataset[name].to_numpy() for name in names], axis=-1)
    rates = np.stack([dataset[f"{name}_rate"].to_numpy() for name in names], axis=-1)
    assert body.surface.position(u) == pytest.approx(dataset["p_WB"].to_numpy(), abs=1e-12)
    velocity = np.einsum("tij,tj->ti", body.surface.tangents(u), rates)
    assert velocity == pytest.approx(dataset["v_WB"].to_numpy(), abs=1e-12)
    a = body.ball.radius
    along = velocity[:, None, :] @ body.surface.frame(u)
    assert dataset["omega2"].to_numpy() == pytest.approx(along[:, 0, 2] / a, abs=1e-8)
    assert dataset["omega3"].to_numpy() == pytest.approx(-along[:, 0, 1] / a, abs=1e-8)
    friction = np.hypot(dataset["F2"], dataset["F3"]) / dataset["N"]
    assert dataset["needed_friction"].to_numpy() == pytest.approx(friction.to_numpy(), rel=1e-12)
    assert float(dataset["N"].min()) > 0


def test_slip_has_sign_and_size() -> None:
    """A ball that spins too fast slips by the surplus."""
    scene = load_scene("sphere_in_cylinder")
    body = rolling_ball(scene)
    surplus = np.array([0.0, 3.0, 2.0])
    dataset = run_of(scene, np.zeros(1), body.p0[None], body.v0[None], (body.w0 + surplus)[None])
    assert float(dataset["slip2"][0]) == pytest.approx(0.025 * 2, rel=1e-12)
    assert float(dataset["slip3"][0]) == pytest.approx(-0.025 * 3, rel=1e-12)


def test_every_variable_has_units(times: np.ndarray) -> None:
    """No variable is without unit and meaning."""
    dataset = exact(load_scene("sphere_in_cylinder"), times)
    assert dataset["time"].attrs["units"] == "s"
    for name, values in dataset.data_vars.items():
        assert values.attrs["units"], name
        assert values.attrs["long_name"], name
    units = {name: dataset[name].attrs["units"] for name in ("gamma", "gamma_rate", "z_rate", "N", "energy")}
    assert units == {"gamma": "rad", "gamma_rate": "rad/s", "z_rate": "m/s", "N": "N", "energy": "J"}


def test_what_the_engine_cannot_say_is_absent() -> None:
    """Without forces and orientation there are none in the result; with them they are there."""
    scene = load_scene("sphere_in_cylinder")
    times = np.linspace(0, 0.1, 3)
    motion = closed_form(rolling_ball(scene), times)
    assert motion is not None
    states = list(zip(motion.p_WB, motion.v_WB, motion.w_WB, motion.force, strict=True))
    silent = from_samples(scene, times, [sample_of(p, v, w) for p, v, w, _ in states])
    assert not {"N", "F2", "F3", "needed_friction", "q_WB"} & set(silent.data_vars)
    q = np.array([1.0, 0, 0, 0])
    full = from_samples(scene, times, [sample_of(p, v, w, q, f) for p, v, w, f in states])
    assert {"N", "F2", "F3", "needed_friction", "q_WB"} <= set(full.data_vars)
    assert full["q_WB"].dims == ("time", "body", "wxyz")


def test_a_run_that_ended_early_has_fewer_times() -> None:
    """The time axis is as long as the samples."""
    scene = load_scene("sphere_in_cylinder")
    body = rolling_ball(scene)
    dataset = from_samples(scene, np.linspace(0, 1, 11), [sample_of(body.p0, body.v0, body.w0)] * 2)
    assert dataset["time"].to_numpy() == pytest.approx([0, 0.1])
