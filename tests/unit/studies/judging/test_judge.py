"""Judging a trajectory: samples on an impact, and how often its dataset is indexed."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import proofroll


@pytest.mark.drill
def test_the_cost_of_judging_does_not_grow_with_the_number_of_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judging a run indexes its dataset a few times, not once or more for each of its variables.

    An index makes coordinates anew, which takes longer than all comparisons of a curve of a hundred samples.
    """
    run = proofroll.simulate("pendulum", until=0.1, every=0.01)
    assert len(run.data_vars) > 20
    proofroll.judge(run, "pendulum")
    indexed = 0
    get = xr.Dataset.__getitem__

    def counted(self: Any, key: Any) -> Any:
        nonlocal indexed
        indexed += 1
        return get(self, key)

    monkeypatch.setattr(xr.Dataset, "__getitem__", counted)
    assert proofroll.judge(run, "pendulum").compared
    assert indexed < 10


@pytest.mark.nightly_of("False")
@pytest.mark.drill
@pytest.mark.parametrize("of_a_run", [True, False])
def test_a_sample_on_an_impact_may_be_of_either_side(*, of_a_run: bool) -> None:
    """Velocities have two values there, so that none is wrong; at the next sample one is, and so is 100 times one."""
    run = proofroll.simulate("two_spheres", until=0.2, every=0.02).copy(deep=True)
    if not of_a_run:
        run = run[["v_WB"]].drop_attrs(deep=False)
    allowed = {"v_WB": "1e-6 m/s"}
    (hit,) = np.flatnonzero(np.isclose(run["time"], 0.1))
    for side in (hit - 1, hit + 1):
        run["v_WB"][hit] = run["v_WB"][side].to_numpy()
        assert proofroll.judge(run, "two_spheres", allowed, because="round-off").agrees
    run["v_WB"][hit] = 100 * run["v_WB"][hit - 1].to_numpy()
    assert not proofroll.judge(run, "two_spheres", allowed, because="round-off").agrees
    run["v_WB"][hit] = run["v_WB"][hit + 1].to_numpy()
    run["v_WB"][hit + 1] = run["v_WB"][hit - 1].to_numpy()
    assert not proofroll.judge(run, "two_spheres", allowed, because="round-off").agrees


@pytest.mark.drill
def test_a_place_at_an_impact_has_one_value() -> None:
    """A run that is at another place at a sample on an impact alone differs there."""
    run = proofroll.simulate("two_spheres", until=0.2, every=0.02).copy(deep=True)
    allowed = {"p_WB": "1e-3 m"}
    assert proofroll.judge(run, "two_spheres", allowed, because="a round number").agrees
    (hit,) = np.flatnonzero(np.isclose(run["time"], 0.1))
    run["p_WB"][hit] += 0.01
    assert not proofroll.judge(run, "two_spheres", allowed, because="a round number").agrees


@pytest.mark.drill
def test_samples_that_nearly_all_lie_on_impacts_are_judged() -> None:
    """With no other samples a wrong run would agree."""
    run = proofroll.simulate("two_spheres", until=0.1, every=0.1).copy(deep=True)
    run["p_WB"][1] += 1.0
    assert not proofroll.judge(run, "two_spheres", {"p_WB": "1e-3 m"}, because="no way").agrees


@pytest.mark.drill
def test_a_force_is_judged_where_the_truth_determines_it() -> None:
    """Across the plane to which a joint confines a rod, joint and foot share the force; along it nothing is free."""
    run = proofroll.simulate("falling_rod", "projection", until=0.1, every=0.01).copy(deep=True)
    found = proofroll.judge(run, "falling_rod")
    assert found.agrees, found
    assert "contact_forces" in {item.judgement.observable for item in found.compared}
    assert found.unjudged["parts of contact_forces"] == "the truth does not determine it"
    run["contact_forces"][5:, 0, 1] += 10.0
    assert proofroll.judge(run, "falling_rod").agrees
    run["contact_forces"][5:, 0, 0] *= 1.3
    assert not proofroll.judge(run, "falling_rod").agrees


@pytest.mark.nightly
def test_a_sled_whose_friction_is_thrice_and_reversed_differs() -> None:
    """Forces are judged up to the rest in which three feet share them, also where a motion alone has a tolerance."""
    run = proofroll.simulate("sled", "projection", until=0.7, every=0.02).copy(deep=True)
    assert proofroll.judge(run, "sled").agrees
    assert proofroll.judge(run, "sled", {"positions": "1e-3 m"}).agrees
    run["contact_forces"][..., :2] *= -3.0
    for tolerance in (None, {"positions": "1e-3 m"}):
        found = proofroll.judge(run, "sled", tolerance)
        assert next(item.judgement.observable for item in found.compared if not item.agrees) == "contact_forces"


@pytest.mark.drill
def test_a_given_force_is_judged_where_the_truth_determines_it() -> None:
    """A column of a person's own, which a truth has at some times only, is judged at these."""
    run = proofroll.simulate("falling_rod", until=0.1, every=0.01)
    across = run["force.contact.y"].to_numpy()
    assert np.isnan(across).all()
    own = {"time": run["time"].to_numpy(), "force.contact.x": run["force.contact.x"].to_numpy()}
    assert proofroll.judge(own, "falling_rod").agrees


@pytest.mark.drill
def test_a_sample_on_a_bounce_may_be_of_either_side() -> None:
    """Velocities of a ball on a wall have two values there, too; one far from both is wrong."""
    scene = proofroll.load_scene("bouncing_ball", height=0.1, restitution=0.5)
    falls = np.sqrt(2 * 0.1 / 9.81)
    times = falls / 3 * np.arange(6)
    velocities = np.zeros((6, 3))
    velocities[:, 2] = [*(-9.81 * times[:3]), 0.0, *(0.5 * 9.81 * falls - 9.81 * (times[4:] - falls))]
    for down, agrees in ((-9.81 * falls, True), (0.5 * 9.81 * falls, True), (5 * 9.81 * falls, False)):
        velocities[3, 2] = down
        run = {"time": times, "v_WB": velocities[:, None]}
        assert proofroll.judge(run, scene, {"v_WB": "1e-6 m/s"}, because="round-off").agrees is agrees


@pytest.mark.drill
def test_a_number_that_is_not_finite_is_named_with_its_time() -> None:
    """Of a coordinate without a number at 0.2 s and behind, the line names the first time."""
    run = proofroll.simulate("pendulum", "projection", until=0.4, every=0.1)
    angles = run["q.pivot"].to_numpy().copy()
    angles[2:] = np.nan
    judged = proofroll.judge({"time": run["time"].to_numpy(), "q.pivot": angles}, "pendulum")
    assert not judged.agrees
    assert "q.pivot is not finite in 3 of 5 rows, first at 0.2 s; " in str(judged)
