"""Pinocchio's own solver of contact with friction, run on the real engine."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
import xarray as xr
from placed_balls import compared, placed, scene_with

from proofroll.core.certificate import certify
from proofroll.core.errors import Diverged, Refused
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate

pin = pytest.importorskip("pinocchio")

RESISTANCE = 5e-4
SOLVERS = ("pgs", "admm")


def leaning_cylinder(tilt: float, **parameters: float) -> Scene:
    """The cylinder with its axis, and gravity along it, leaning by ``tilt`` [rad]."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    gravity = Gravity(9.81, (-math.sin(tilt), 0.0, -math.cos(tilt)))
    return scene_with(scene, surface=dataclasses.replace(placed(scene).surface, tilt=tilt), gravity=gravity)


@cache
def _moved(engine: str, until: float, **parameters: float) -> xr.Dataset:
    """A run, made once for all tests."""
    return simulate(load_scene("sphere_in_cylinder", **parameters), engine, until=until, every=0.1)


def errors(engine: str, until: float = 0.5, **parameters: float) -> dict[str, float]:
    """Largest difference from the truth with unbounded friction, after time 0."""
    true, run = (_moved(name, until, **parameters) for name in ("truth", engine))
    assert run.status == "done", run.message
    return {str(name): float(np.abs(run[name] - true[name])[1:].max()) for name in compared(true, run)}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("resistance", [0.0, RESISTANCE])
def test_accuracy(solver: str, resistance: float) -> None:
    """With leapfrog, path, forces, energy and gap are right to a few times what was measured at 1 ms.

    That is the error of the scheme, which no processor changes.
    """
    found = errors(f"pinocchio[formulation=contact,solver={solver}]", rolling_resistance=resistance)
    assert found["z"] < 5e-5
    assert found["gamma"] < 1.5e-3
    assert max(found["N"], found["F2"], found["F3"]) < 1e-2
    assert found["energy"] < 2e-4
    assert max(found["slip2"], found["slip3"]) < 1e-5
    assert found["gap"] < 1e-7


def test_plane_at_the_start_of_the_step() -> None:
    """With the obvious scheme the ball sinks in by V² dt² / 2c and is a centimetre off: that is its order."""
    found = errors("pinocchio[formulation=contact,preset=default]")
    assert found["gap"] == pytest.approx(4.0**2 * 1e-6 / (2 * 0.2), rel=0.05)
    assert 5e-3 < found["z"] < 2e-2


@pytest.mark.parametrize("preset", ["default", "matched"])
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize(
    "parameters", [{}, {"speed": -4, "axial_speed": 0.3, "radial_spin": 5, "rolling_resistance": RESISTANCE}]
)
def test_certificate(parameters: dict[str, float], solver: str, preset: str) -> None:
    """Each solver builds what the scene says."""
    built = load_scene("sphere_in_cylinder", **parameters)
    engine = build(built, f"pinocchio[formulation=contact,preset={preset},solver={solver}]")
    lines = certify(engine, built)
    assert [line.quantity for line in lines if not line.holds] == []
    assert len(lines) == 18  # nothing is left out
    softened = [line.quantity for line in lines if line.because]
    numbers = ["1 / static friction", "1 / kinetic friction"]
    assert softened == [*numbers, "acceleration", "angular acceleration", "N", "F2", "F3"]
    if preset == "matched":  # what it grants itself: a force that is wrong by a hundred-millionth is found
        assert all(line.tolerance < 2e-9 for line in lines if line.quantity not in numbers)


@pytest.mark.parametrize("dt", [1e-2, 1e-3, 1e-4])
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("preset", ["default", "matched"])
@pytest.mark.parametrize("tilt", [0.3, -0.8])
def test_certificate_on_a_leaning_cylinder(preset: str, solver: str, dt: float, tilt: float) -> None:
    """The tolerances are wide enough at any step, wherever the axis points."""
    scene = leaning_cylinder(tilt, rolling_resistance=RESISTANCE)
    engine = build(scene, f"pinocchio[formulation=contact,preset={preset},solver={solver},dt={dt}]")
    assert [line.quantity for line in certify(engine, scene) if not line.holds] == []


def test_only_the_missing_bend_is_forgiven() -> None:
    """The obvious scheme does not press at time 0; leapfrog must give the forces to round-off."""
    for preset, forgiven in (("default", 1.0), ("matched", 0.0)):
        built = build(load_scene("sphere_in_cylinder"), f"pinocchio[formulation=contact,preset={preset}]").built()
        assert built.regularised["N"].tolerance == pytest.approx(forgiven, abs=1e-2 if forgiven else 2e-9)
        assert ("plane" in built.regularised["N"].because) == bool(forgiven)
    # In the cylinder F2 is missing only by rolling resistance, which follows N: 5/7 (f/a) N (Blajer 2006).
    scene = load_scene("sphere_in_cylinder", rolling_resistance=RESISTANCE)
    built = build(scene, "pinocchio[formulation=contact,preset=default]").built()
    assert built.regularised["F2"].tolerance == pytest.approx(5 / 7 * 0.02, rel=0.01)


def test_number_for_unbounded_friction() -> None:
    """Where friction has no bound, the number that the solver's cone holds is read back, and forgiven as what it is."""
    for solver, mu in (("pgs", 1e6), ("admm", 1e2)):
        built = build(load_scene("sphere_in_cylinder"), f"pinocchio[formulation=contact,solver={solver}]").built()
        assert built.mu_static == built.mu_kinetic == mu
        assert built.regularised["1 / static friction"].tolerance == 1 / mu


def test_solvers_agree() -> None:
    """PGS and ADMM find the same impulses: their paths differ by what the tolerance leaves."""
    pgs, admm = (
        _moved(f"pinocchio[formulation=contact,solver={name}]", 0.5, rolling_resistance=RESISTANCE) for name in SOLVERS
    )
    np.testing.assert_allclose(admm.p_WB, pgs.p_WB, rtol=0, atol=1e-6)


def test_too_little_friction_for_unbounded() -> None:
    """Where ADMM's number for unbounded friction is not enough, the engine refuses instead of slipping."""
    scene = load_scene("sphere_in_cylinder", speed=0.1)
    with pytest.raises(Refused, match=r"more friction|did not reach"):
        build(scene, "pinocchio[formulation=contact,solver=admm]")
    assert simulate(scene, "pinocchio[formulation=contact,solver=pgs]", until=0.1).status == "done"


def test_solver_that_gives_up_is_said() -> None:
    """A solver that does not converge ends the run with a sentence."""
    engine = build(load_scene("sphere_in_cylinder"), "pinocchio[formulation=contact,solver=admm]")
    engine.contact.options.max_iterations = 3
    with pytest.raises(Diverged, match="solver_tolerance"):
        engine.advance(0.01)


def test_model_is_only_what_the_scene_requires() -> None:
    """One ball, one contact, no torque without rolling resistance."""
    run = build(load_scene("sphere_in_cylinder"), "pinocchio[formulation=contact]")
    assert run.contact.model.nv == 6
    assert len(run.contact.models) == 1
    assert run.built().rolling_resistance == 0.0
