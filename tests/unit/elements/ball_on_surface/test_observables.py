from __future__ import annotations

import numpy as np
import pytest
import xarray as xr

from proofroll.core.dataset import observe, scales
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.dataset import variables
from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.ball_on_surface.observables import energy_balance, force_audit
from proofroll.files.scene_file import load_scene
from proofroll.truth.rolling import reduced

TIMES = np.linspace(0, 0.6, 61)


@pytest.fixture(scope="module")
def case() -> tuple[Scene, xr.Dataset]:
    """A run with resistance, general initial motion and nothing wrong."""
    scene = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=5e-4)
    motion = reduced(rolling_ball(scene), TIMES)
    return scene, variables(rolling_ball(scene), TIMES, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)


def largest(values: np.ndarray) -> float:
    """Largest absolute value."""
    return float(np.max(np.abs(values)))


def test_energy_balance_of_the_truth(case: tuple[Scene, xr.Dataset]) -> None:
    """Energy lost is what the resistance took: the balance vanishes, although the energy does not stay."""
    scene, dataset = case
    lost = float(dataset["energy"][0] - dataset["energy"][-1])
    assert lost > 0.1
    assert largest(energy_balance(rolling_ball(scene), dataset)) < 1e-9 * lost


def test_energy_balance_sees_lost_energy(case: tuple[Scene, xr.Dataset]) -> None:
    """Energy that vanishes, and a resistance twice too strong or absent, show in the balance by their size."""
    scene, dataset = case
    leak = dataset.assign(energy=dataset["energy"] - 1e-4 * dataset["time"])
    assert energy_balance(rolling_ball(scene), leak)[-1] == pytest.approx(-1e-4 * TIMES[-1], rel=1e-4)
    lost = float(dataset["energy"][0] - dataset["energy"][-1])
    other = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=1e-3)
    assert energy_balance(rolling_ball(other), dataset)[-1] == pytest.approx(lost, rel=1e-6)
    without = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0)
    assert energy_balance(rolling_ball(without), dataset)[-1] == pytest.approx(-lost, rel=1e-6)


def test_force_audit_of_the_truth(case: tuple[Scene, xr.Dataset]) -> None:
    """Forces recomputed from a right motion are those that were reported, within 1e-6 of the normal force."""
    scene, dataset = case
    audit = force_audit(rolling_ball(scene), dataset)
    assert len(audit) == len(TIMES) - 10
    assert largest(audit) < 1e-6 * float(dataset["N"].max())


@pytest.mark.parametrize("name", ["N", "F2", "F3"])
def test_force_audit_sees_a_wrong_force(case: tuple[Scene, xr.Dataset], name: str) -> None:
    """A force that does not belong to the motion shows by its size, whichever component it is."""
    scene, dataset = case
    wrong = dataset.assign({name: dataset[name] + 0.01})
    assert force_audit(rolling_ball(scene), wrong) == pytest.approx(0.01, abs=1e-4)
    reversed_sign = dataset.assign({name: -dataset[name]})
    assert largest(force_audit(rolling_ball(scene), reversed_sign)) == pytest.approx(
        2 * largest(dataset[name][5:-5]), rel=1e-3
    )


def test_force_audit_sees_a_wrong_mass(case: tuple[Scene, xr.Dataset]) -> None:
    """Reported forces of a ball twice as heavy do not fit the motion of this one."""
    scene, dataset = case
    heavy = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=5e-4, mass=1.034)
    assert largest(force_audit(rolling_ball(heavy), dataset)) > 0.9 * float(dataset["N"].min())
    assert rolling_ball(scene).ball.mass == 0.517


def test_observables(case: tuple[Scene, xr.Dataset]) -> None:
    """Every observable has its unit; what is zero by definition is zero for a right run."""
    scene, dataset = case
    curves = observe(scene, dataset)
    assert {name: curve.unit for name, curve in curves.items()} == {
        "gamma": "rad", "z": "m", "N": "N", "F2": "N", "F3": "N", "needed_friction": "1", "gap": "m", "slip": "m/s",
        "energy_balance": "J", "force_audit": "N",
    }  # fmt: skip
    assert largest(curves["gap"].values) < 1e-15
    assert largest(curves["slip"].values) < 1e-13


def test_observables_without_forces(case: tuple[Scene, xr.Dataset]) -> None:
    """An engine that cannot say forces is not judged by them, nor by a balance that would need them."""
    scene, dataset = case
    silent = dataset.drop_vars(["N", "F2", "F3", "needed_friction"])
    assert set(observe(scene, silent)) == {"gamma", "z", "gap", "slip"}
    free = rolling_ball(load_scene("sphere_in_cylinder"))
    assert "energy_balance" in observables(free, silent)


def test_observables_of_few_samples(case: tuple[Scene, xr.Dataset]) -> None:
    """Too few samples for a spline are no error; what needs the spline is left out."""
    scene, dataset = case
    curves = observe(scene, dataset.isel(time=slice(0, 10)))
    assert "z" in curves
    assert not {"energy_balance", "force_audit"} & set(curves)


def test_slip_is_the_length_of_the_slip_velocity(case: tuple[Scene, xr.Dataset]) -> None:
    """Slip counts in both directions."""
    scene, dataset = case
    slipping = dataset.assign(slip2=dataset["slip2"] + 0.3, slip3=dataset["slip3"] - 0.4)
    assert observe(scene, slipping)["slip"].values == pytest.approx(0.5, abs=1e-12)


def test_scales(case: tuple[Scene, xr.Dataset]) -> None:
    """Each observable's scale is a size of this case and never zero."""
    scene, dataset = case
    sizes = scales(scene, dataset)
    assert sizes["z"] == pytest.approx(float(np.ptp(dataset["z"].to_numpy())))
    assert sizes["F2"] == sizes["N"] == pytest.approx(float(dataset["N"].max()))
    assert set(observe(scene, dataset)) <= set(sizes)
    resting = load_scene("inclined_plane", tilt=0.0, speed=0.0, cross_speed=0.0)
    motion = reduced(rolling_ball(resting), TIMES[:3])
    still = variables(rolling_ball(resting), TIMES[:3], motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    assert all(size > 0 for size in scales(resting, still).values())


def test_scales_have_floors() -> None:
    """A range of round-off is no size: where nothing moves, a scale is a hundredth of what is natural for the ball."""
    scene = load_scene("inclined_plane", tilt=0.35, cross_speed=0.0)
    body, motion = rolling_ball(scene), reduced(rolling_ball(scene), TIMES)
    dataset = variables(rolling_ball(scene), TIMES, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    dataset["across"] = 3.5e-17 * np.sin(dataset["time"])
    dataset["N"], dataset["needed_friction"] = 0 * dataset["N"], np.nan * dataset["N"]
    sizes = scales(body, dataset)
    assert sizes["across"] == pytest.approx(0.01 * body.ball.radius)
    assert sizes["down"] == pytest.approx(float(np.ptp(dataset["down"].to_numpy())))
    assert sizes["F2"] == pytest.approx(0.01 * body.ball.mass * 9.81)
    assert sizes["needed_friction"] == 0.01
    curved = load_scene("sphere_in_cylinder", speed=1e-9, axial_speed=0.0)
    still = dataset.assign(gamma=0 * dataset["time"], z=0 * dataset["time"])
    sizes = scales(curved, still)
    turn = sizes["gamma"] * rolling_ball(curved).surface.length_scales[0]
    assert sizes["z"] == pytest.approx(turn) == pytest.approx(0.01 * rolling_ball(curved).ball.radius)
    assert 0 < sizes["energy_balance"] < 0.01
    assert 0 < sizes["slip"] < 0.01
