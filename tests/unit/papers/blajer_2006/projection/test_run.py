"""The projection method as an engine: accuracy, order, drift, singularity, settings and protocol."""

from __future__ import annotations

import numpy as np
import pytest
from placed_balls import compared
from true_runs import true_run

import proofroll
from proofroll.core.errors import Diverged, InputError
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.projection.orientation import EulerAngles
from proofroll.running.simulation import build, simulate

Projection = load_engine("projection")

CYLINDER = {"name": "sphere_in_cylinder"}
EXACT = ["projection[formulation=euler]", "projection[formulation=rotating_frame]"]
CLASSICAL = ["projection[formulation=euler,preset=default]", "projection[formulation=rotating_frame,preset=default]"]


def load(name, **parameters):
    """A scene by name."""
    return proofroll.load_scene(name, **parameters)


def errors(scene, engine, until=2.0, every=0.1, **settings):
    """Largest difference from the truth in each variable."""
    found = simulate(scene, engine, until=until, every=every, **settings)
    assert found.status == "done", found.message
    true = true_run(scene, until, every)
    return {name: float(np.max(np.abs(found[name] - true[name]))) for name in compared(true, found)}


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("engine", EXACT)
@pytest.mark.parametrize(
    "scene",
    [
        {**CYLINDER, "speed": -4, "rolling_resistance": 5e-4},
        {**CYLINDER, "speed": 2, "axial_speed": 0.3, "radial_spin": 5},
    ],
    ids=["backwards", "axial"],
)
def test_matched_holds_on_every_scene(engine, scene):
    """Other initial motions are as accurate."""
    difference = errors(load(**scene), engine, until=0.5)
    surface = rolling_ball(load(**scene)).surface
    assert max(difference[name] for name in surface.coordinates) < 1e-12
    assert max(difference[name] for name in ("N", "F2", "F3")) < 2e-11


@pytest.mark.nightly
def test_default_costs_accuracy_only_because_of_the_angles():
    """With rk4 at 1 ms the Euler angles, which turn at 160 rad/s, cost six digits of z; without them none are lost."""
    scene = load("sphere_in_cylinder", speed=4)
    with_angles, without = (errors(scene, engine)["z"] for engine in CLASSICAL)
    # Errors of a scheme at its step, which no processor changes.
    assert 1e-5 < with_angles < 5e-4  # measured 1.4e-4 m
    assert without < 5e-10  # measured 1.4e-10 m


@pytest.mark.drill
def test_elimination_removes_the_drift():
    """The slip stays at round-off with elimination; without it a coarse step lets it drift to mm/s."""
    scene = load("sphere_in_cylinder", speed=4, rolling_resistance=5e-4)
    kept = errors(scene, CLASSICAL[0], until=0.5)
    drifting = errors(scene, CLASSICAL[0], until=0.5, elimination=False)
    assert max(kept["slip2"], kept["slip3"]) < 1e-13
    assert max(drifting["slip2"], drifting["slip3"]) > 1e-4
    assert drifting["z"] > 3 * kept["z"]


@pytest.mark.nightly
def test_papers_range_of_nutation(monkeypatch):
    """In the paper's run with rolling resistance θ stays within 0.86 … 2.26 rad until the ball would slip."""
    theta = []
    monkeypatch.setattr(EulerAngles, "check", lambda self, t, angles, r, step: theta.append(angles[1]))  # noqa: ARG005 -- a spy
    build(load("sphere_in_cylinder", speed=4, rolling_resistance=5e-4), EXACT[0]).advance(1.72)
    assert (min(theta), max(theta)) == pytest.approx((0.86, 2.26), abs=0.005)


@pytest.mark.parametrize("settings", [{}, {"preset": "default"}, {"preset": "default", "dt": 1e-4}])
def test_singularity_is_reported_where_the_axes_are_not_renewed(settings):
    """A ball started steeply turns its body axis into the vertical: with singularity=stop euler says so and ends."""
    scene = load("sphere_in_cylinder", speed=4, axial_speed=4)
    engine = build(scene, EXACT[0], singularity="stop", **settings)
    with pytest.raises(Diverged, match=r"θ reached .* rad at t = 0\.01\d* s, near .*; leave singularity=stop out"):
        engine.advance(0.1)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("settings", "accuracy"), [({"preset": "default", "dt": 1e-4}, 1e-4), ({}, 1e-11)])
def test_the_axes_are_renewed_at_the_singularity(settings, accuracy):
    """A ball started steeply passes the singularity, comes where it should, and the run says what was done."""
    scene = load("sphere_in_cylinder", speed=4, axial_speed=4, asks=("orientation",))
    found = simulate(scene, EXACT[0], until=0.2, every=0.05, **settings)
    other = simulate(scene, EXACT[1], until=0.2, every=0.05)
    for name in ("p_WB", "v_WB", "w_WB", "N", "F2", "F3", "q_WB"):
        wanted = other[name].to_numpy()
        if name == "q_WB":  # q and -q are one orientation
            wanted = wanted * np.sign(np.sum(wanted * found[name].to_numpy(), axis=-1, keepdims=True))
        size = np.max(np.abs(other["N" if name[0] == "F" else name].to_numpy()))
        np.testing.assert_allclose(found[name], wanted, rtol=0, atol=accuracy * size, err_msg=name)
    assert "near the Euler-angle singularity the body's axes were chosen anew" in found.attrs["message"]
    assert "anew" not in other.attrs["message"]


def test_a_formulation_without_singularity_refuses_to_stop_at_one():
    """singularity=stop with rotating_frame would do nothing, so it is an error."""
    with pytest.raises(InputError, match=r"projection: singularity = 'stop': rotating_frame has no angles"):
        resolve_settings(Projection, {"formulation": "rotating_frame", "singularity": "stop"})


def test_overflow_is_reported_as_divergence():
    """A step far too large ends in one sentence, not in a traceback or warnings."""
    scene = load("sphere_in_cylinder", speed=400, radial_spin=3e4)
    engine = build(scene, CLASSICAL[1], dt=0.5)
    with pytest.raises(Diverged, match=r"t = "):
        engine.advance(1000.0)


def test_dense_samples_do_not_shrink_the_adaptive_step():
    """A sample a nanosecond after another costs one step, and the step size is what it was before."""
    engine = build(load("sphere_in_cylinder", speed=4), EXACT[0])
    engine.advance(0.1)
    solver = engine._motion._solver
    wanted, evaluations = solver.h_abs, solver.nfev
    engine.advance(0.1 + 1e-9)
    assert solver.h_abs >= wanted
    assert solver.nfev - evaluations < 20
