from __future__ import annotations

import dataclasses
from collections.abc import Callable
from functools import cache, reduce
from itertools import accumulate

import numpy as np
import pytest
import xarray as xr
from ball_scenes import rolled
from placed_balls import of_ball, run_of, sample_of
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from proofroll.core.columns import Columns
from proofroll.core.dataset import from_samples, observe, off_grid_apart, scales
from proofroll.core.scene import Scene
from proofroll.core.time_grid import off_grid
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.contacts.audits import energy_balance, force_audit, rate_audit
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall
from proofroll.elements.mechanism.run.contacts.stretches import with_sticking
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.mechanics import BallMotion, natural_acceleration

TIMES = np.linspace(0, 0.6, 61)


@pytest.fixture(scope="module")
def case() -> tuple[Scene, xr.Dataset]:
    """A run with resistance, general initial motion and nothing wrong."""
    scene = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=5e-4)
    motion = rolled(rolling_ball(scene), TIMES)
    return scene, run_of(scene, TIMES, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)


def on_wall(scene: Scene) -> BodyOnWall:
    """The ball of a scene on its wall."""
    return scene.elements[0].on_wall  # type: ignore[attr-defined,no-any-return]


def largest(values: np.ndarray) -> float:
    """Largest absolute value."""
    return float(np.max(np.abs(values)))


def test_energy_balance_of_the_truth(case: tuple[Scene, xr.Dataset]) -> None:
    """Energy lost is what the resistance took: the balance vanishes, although the energy does not stay."""
    scene, dataset = case
    lost = float(dataset["energy"][0] - dataset["energy"][-1])
    assert lost > 0.1
    assert largest(energy_balance(on_wall(scene), of_ball(dataset))) < 1e-9 * lost


@pytest.mark.drill
def test_energy_balance_of_a_resisted_slip() -> None:
    """While a ball slips the balance counts the resistance by the law that its contact names, and by no other."""
    scene = load_scene("slide_to_roll", speed=1.0, back_spin=60.0, rolling_resistance=5e-4)
    body, found = on_wall(scene), truth(scene, np.linspace(0, 0.3, 61))
    dataset = of_ball(with_sticking(body, found))
    other = dataclasses.replace(body, contact=dataclasses.replace(body.contact, against="turning"))
    lost = float(dataset["energy"][0] - dataset["energy"][-1])
    assert largest(energy_balance(body, dataset)) < 1e-3 * lost
    assert largest(energy_balance(other, dataset)) > 0.05 * lost


def test_energy_balance_sees_lost_energy(case: tuple[Scene, xr.Dataset]) -> None:
    """Energy that vanishes, and a resistance twice too strong or absent, show in the balance by their size."""
    scene, dataset = case
    leak = dataset.assign(energy=dataset["energy"] - 1e-4 * dataset["time"])
    assert energy_balance(on_wall(scene), of_ball(leak))[-1] == pytest.approx(-1e-4 * (TIMES[-1] - TIMES[1]), rel=1e-4)
    lost = float(dataset["energy"][1] - dataset["energy"][-1])
    other = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=1e-3)
    assert energy_balance(on_wall(other), of_ball(dataset))[-1] == pytest.approx(lost, rel=1e-6)
    without = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0)
    whole = float(dataset["energy"][0] - dataset["energy"][-1])  # nothing takes power there: no force counts
    assert energy_balance(on_wall(without), of_ball(dataset))[-1] == pytest.approx(-whole, rel=1e-6)


def test_energy_balance_does_not_rest_on_forces_at_the_start(case: tuple[Scene, xr.Dataset]) -> None:
    """A soft contact that presses and rubs only after its first step loses no energy by that."""
    scene, dataset = case
    late = dataset.copy(deep=True)
    for name in ("N", "F2", "F3"):
        late[name].to_numpy()[0] = 0.0
    assert largest(energy_balance(on_wall(scene), of_ball(late))) < 1e-9 * float(dataset["energy"][0])


def test_force_audit_of_the_truth(case: tuple[Scene, xr.Dataset]) -> None:
    """Forces recomputed from a right motion are those that were reported, within 1e-6 of the normal force."""
    scene, dataset = case
    audit = force_audit(on_wall(scene), of_ball(dataset))
    assert len(audit) == len(TIMES) - 10
    assert largest(audit) < 1e-6 * float(dataset["N"].max())


@pytest.mark.parametrize("name", ["N", "F2", "F3"])
def test_force_audit_sees_a_wrong_force(case: tuple[Scene, xr.Dataset], name: str) -> None:
    """A force that does not belong to the motion shows by its size, whichever component it is."""
    scene, dataset = case
    wrong = dataset.assign({name: dataset[name] + 0.01})
    assert force_audit(on_wall(scene), of_ball(wrong)) == pytest.approx(0.01, abs=1e-4)
    reversed_sign = dataset.assign({name: -dataset[name]})
    assert largest(force_audit(on_wall(scene), of_ball(reversed_sign))) == pytest.approx(
        2 * largest(dataset[name][5:-5]), rel=1e-3
    )


def test_force_audit_sees_a_wrong_mass(case: tuple[Scene, xr.Dataset]) -> None:
    """Reported forces of a ball twice as heavy do not fit the motion of this one."""
    scene, dataset = case
    heavy = load_scene("sphere_in_cylinder", axial_speed=0.7, radial_spin=12.0, rolling_resistance=5e-4, mass=1.034)
    assert largest(force_audit(on_wall(heavy), of_ball(dataset))) > 0.9 * float(dataset["N"].min())
    assert rolling_ball(scene).ball.mass == 0.517


def test_rate_audit_of_the_truth(case: tuple[Scene, xr.Dataset]) -> None:
    """Velocities of a right motion are the rates of its positions, to what the splines leave."""
    scene, dataset = case
    assert largest(rate_audit(on_wall(scene), of_ball(dataset))) < 1e-8


def test_rate_audit_sees_a_velocity_of_its_own(case: tuple[Scene, xr.Dataset]) -> None:
    """A velocity that is not the rate of the position shows by its size, also where it is constant."""
    scene, dataset = case
    drifting = dataset.assign(v_WB=dataset["v_WB"] + xr.DataArray([0, 0, 0.01], dims="xyz"))
    assert rate_audit(on_wall(scene), of_ball(drifting)) == pytest.approx(0.01, rel=1e-4)


@pytest.mark.drill
def test_rate_audit_sees_an_error_with_the_period_of_the_grid() -> None:
    """What is zero at every sample of the grid, and nowhere else, shows at the samples off it."""
    scene, dataset = off_the_grid()

    def with_beat(size: float) -> xr.Dataset:
        beat = xr.zeros_like(dataset["between.p_WB"])
        beat[..., 2] = size * np.sin(200 * np.pi * dataset["between"])
        return dataset.assign({"between.p_WB": dataset["between.p_WB"] + beat})

    # Near what is seen, 4.5e-8 with every kind of arithmetic that was tried: the error of the interpolation.
    assert largest(rate_audit(on_wall(scene), of_ball(with_beat(0.0)))) < 1e-7
    assert largest(rate_audit(on_wall(scene), of_ball(with_beat(1e-5)))) > 1e-5 / 0.005 / 2


@cache
def off_the_grid() -> tuple[Scene, xr.Dataset]:
    """A scene and a right run with its orientation, sampled on the grid and at a few times off it."""
    scene = load_scene("sphere_in_cylinder", asks=("orientation",))
    between = off_grid(TIMES, None)
    times = np.union1d(TIMES, between)
    motion, true = rolled(rolling_ball(scene), times), truth(scene, times)
    parts = motion.p_WB, motion.v_WB, motion.w_WB
    made = run_of(scene, times, *parts, force=motion.force, q_WB=true["q_WB"].to_numpy())
    return scene, off_grid_apart(scene, Columns.of(made), TIMES, between).dataset()


LIES: dict[str, tuple[str, Callable[[xr.DataArray], xr.DataArray]]] = {
    "w_WB": ("rate_audit", lambda w: 3 * w),
    "q_WB": ("rate_audit", lambda q: q * 0 + [1.0, 0, 0, 0]),
    "F2": ("force_audit", lambda F: 100 * F + 1),
    "v_WB": ("energy_balance", lambda v: 2 * v),
}


@pytest.mark.parametrize("name", LIES)
def test_audits_see_what_is_wrong_off_the_grid_alone(name: str) -> None:
    """Spin, orientation, force and speed that are right at every sample of the grid are looked at off it, too."""
    (scene, right), (audit, lie) = off_the_grid(), LIES[name]
    assert right.sizes["between"] == 8
    wrong = right.assign({f"between.{name}": lie(right[f"between.{name}"])})
    before, after = (largest(observe(scene, run)[audit]) for run in (right, wrong))
    assert after > 100 * before + 0.1


def test_rate_audit_sees_an_orientation_of_its_own() -> None:
    """An orientation that turns by 1 % less than ω says shows as 1 % of the radius times ω, several turns a second."""
    scene = load_scene("sphere_in_cylinder")
    motion = rolled(rolling_ball(scene), TIMES)
    fine = np.linspace(0, TIMES[-1], 40 * (len(TIMES) - 1) + 1)
    knots = np.linspace(0, TIMES[-1], 4 * len(TIMES) - 3)
    spin = make_interp_spline(knots, rolled(rolling_ball(scene), knots).w_WB, k=5)((fine[1:] + fine[:-1]) / 2)

    def audited(factor: float) -> float:
        turns = Rotation.from_rotvec(factor * np.diff(fine)[:, None] * spin)
        between = reduce(lambda whole, k: turns[k::40] * whole, range(1, 40), turns[::40])
        found = list(accumulate(between, lambda attitude, turn: turn * attitude, initial=Rotation.identity()))
        q = np.array([one.as_quat(scalar_first=True) for one in found])
        run = run_of(scene, TIMES, motion.p_WB, motion.v_WB, motion.w_WB, q_WB=q)
        return largest(rate_audit(on_wall(scene), of_ball(run)))

    turning = 0.025 * largest(np.linalg.norm(motion.w_WB, axis=1))
    assert audited(1.0) < 1e-5 * turning
    assert audited(0.99) == pytest.approx(0.01 * turning, rel=0.02)


def test_absent_forces_at_time_0_are_left_out(case: tuple[Scene, xr.Dataset]) -> None:
    """An engine without a force at time 0 alone has the same audits from the first sample on, and its work counts."""
    scene, whole = case
    motion = rolled(rolling_ball(scene), TIMES)
    samples = [sample_of(p, v, w, force=f) for p, v, w, f in zip(*vars_of(motion), strict=True)]
    samples[0] = dataclasses.replace(samples[0], contact_force=np.full((1, 3), np.nan))
    dataset = from_samples(scene, TIMES, samples)
    assert np.isnan(dataset["N"][0])
    assert dataset["N"].to_numpy()[1:] == pytest.approx(whole["N"].to_numpy()[1:], rel=1e-14)
    lost = float(whole["energy"][0] - whole["energy"][-1])
    balance = energy_balance(on_wall(scene), of_ball(dataset))
    assert len(balance) == len(TIMES) - 1
    assert largest(balance) < 1e-9 * lost
    assert largest(force_audit(on_wall(scene), of_ball(dataset))) < 1e-6 * float(whole["N"].max())
    samples[1] = dataclasses.replace(samples[1], contact_force=np.full((1, 3), np.nan))
    assert "N" not in from_samples(scene, TIMES, samples), "only time 0 may lack a force"


def vars_of(motion: BallMotion) -> tuple[np.ndarray, ...]:
    """Positions, velocities, spins and forces."""
    assert motion.force is not None
    return motion.p_WB, motion.v_WB, motion.w_WB, motion.force


def test_observables(case: tuple[Scene, xr.Dataset]) -> None:
    """Every observable has its unit; what is zero by definition is zero for a right run."""
    scene, dataset = case
    curves = observe(scene, dataset)
    assert {name: scene.observables[name].unit for name in curves} == {
        "gamma": "rad", "z": "m", "N": "N", "F2": "N", "F3": "N", "needed_friction": "1", "gap": "m", "slip": "m/s",
        "energy_balance": "J", "force_audit": "N", "rate_audit": "m/s",
    }  # fmt: skip
    assert largest(curves["gap"]) < 1e-15
    assert largest(curves["slip"]) < 1e-13


def test_observables_without_forces(case: tuple[Scene, xr.Dataset]) -> None:
    """An engine that cannot say forces is not judged by them, nor by a balance that would need them."""
    scene, dataset = case
    silent = dataset.drop_vars(["N", "F2", "F3", "needed_friction"])
    assert set(observe(scene, silent)) == {"gamma", "z", "gap", "slip", "rate_audit"}
    assert "energy_balance" in observe(load_scene("sphere_in_cylinder"), silent)


def test_observables_of_few_samples(case: tuple[Scene, xr.Dataset]) -> None:
    """Too few samples for a spline are no error; what needs the spline is left out."""
    scene, dataset = case
    curves = observe(scene, dataset.isel(time=slice(0, 10)))
    assert "z" in curves
    assert not {"energy_balance", "force_audit", "rate_audit"} & set(curves)


def test_slip_is_the_length_of_the_slip_velocity(case: tuple[Scene, xr.Dataset]) -> None:
    """Slip counts in both directions."""
    scene, dataset = case
    body = rolling_ball(scene)
    p, v, w = (of_ball(dataset)[name].to_numpy() for name in ("p_WB", "v_WB", "w_WB"))
    frame = body.surface.frame(np.stack([dataset[name] for name in body.surface.coordinates], axis=-1))
    slipping = run_of(scene, TIMES, p, v + 0.3 * frame[..., 1] - 0.4 * frame[..., 2], w)
    assert observe(scene, slipping)["slip"] == pytest.approx(0.5, abs=1e-12)


def test_scales(case: tuple[Scene, xr.Dataset]) -> None:
    """Each observable's scale is a size of this case and never zero."""
    scene, dataset = case
    sizes = scales(scene, dataset)
    assert sizes["z"] == pytest.approx(float(np.ptp(dataset["z"].to_numpy())))
    assert sizes["F2"] == sizes["N"] == pytest.approx(float(dataset["N"].max()))
    assert set(observe(scene, dataset)) <= set(sizes)
    resting = load_scene("sphere_in_cylinder", speed=1e-9, gravity=0.0)
    body, still = rolling_ball(resting), np.zeros((3, 3))
    dataset = run_of(resting, TIMES[:3], body.p0 + still, still, still, force=still)
    assert all(size > 0 for size in scales(resting, dataset).values())


def test_scales_have_floors() -> None:
    """A range of round-off is no size: where nothing moves, a scale is a hundredth of what is natural for the ball."""
    scene = load_scene("sphere_in_cylinder")
    body, motion = rolling_ball(scene), rolled(rolling_ball(scene), TIMES)
    dataset = run_of(scene, TIMES, motion.p_WB, motion.v_WB, motion.w_WB, force=motion.force)
    dataset["z"] = 3.5e-17 * np.sin(dataset["time"])
    dataset["N"], dataset["needed_friction"] = 0 * dataset["N"], np.nan * dataset["N"]
    sizes = scales(scene, dataset)
    assert sizes["z"] == pytest.approx(0.01 * body.ball.radius)
    assert sizes["gamma"] == pytest.approx(float(np.ptp(dataset["gamma"].to_numpy())))
    assert sizes["F2"] == pytest.approx(0.01 * body.ball.mass * natural_acceleration(body))
    assert sizes["needed_friction"] == 0.01
    curved = load_scene("sphere_in_cylinder", speed=1e-9, axial_speed=0.0)
    still = dataset.assign(gamma=0 * dataset["time"], z=0 * dataset["time"])
    sizes = scales(curved, still)
    turn = sizes["gamma"] * rolling_ball(curved).surface.length_scales[0]
    assert sizes["z"] == pytest.approx(turn) == pytest.approx(0.01 * rolling_ball(curved).ball.radius)
    assert 0 < sizes["energy_balance"] < 0.01
    assert 0 < sizes["slip"] < 0.01
