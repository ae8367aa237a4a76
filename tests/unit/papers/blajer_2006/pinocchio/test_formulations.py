"""The Pinocchio adapter, run on the real engine."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from placed_balls import compared, leaning_cylinder, placed, scene_with
from true_runs import true_run

from proofroll.core.certificate import Standing, certify
from proofroll.core.errors import Diverged
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate

pin = pytest.importorskip("pinocchio")

PRESETS = ("default", "matched", "tuned")
RESISTANCE = 5e-4  # 0.02 a, the paper's value


def cylinder(**parameters: float) -> Scene:
    """The paper's case, with some parameters set."""
    return load_scene("sphere_in_cylinder", **parameters)


SCENES = {
    "cylinder": cylinder(),
    "cylinder, resistance": cylinder(rolling_resistance=RESISTANCE),
    "cylinder, slow": cylinder(speed=2),
    "cylinder, backwards, climbing, spinning": cylinder(
        speed=-4, axial_speed=0.3, radial_spin=5, rolling_resistance=RESISTANCE
    ),
    "leaning cylinder": leaning_cylinder(0.3, rolling_resistance=RESISTANCE),
}


def largest_errors(scene: Scene, engine: str, until: float, every: float) -> dict[str, float]:
    """Largest absolute difference from the truth, per variable."""
    true, run = true_run(scene, until, every), simulate(scene, engine, until=until, every=every)
    assert run.status == "done", run.message
    return {str(name): float(np.abs(run[name] - true[name]).max()) for name in compared(true, run)}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES.keys())
def test_certificate(scene: Scene, preset: str) -> None:
    """It builds exactly what the scene says, for every start, and says all there is to say but for its gap."""
    engine = build(scene, "pinocchio", formulation="composite", preset=preset)
    lines = certify(engine, scene)
    assert [line.quantity for line in lines if not line.holds] == []
    told = {line.quantity for line in lines if line.standing is not Standing.NOT_REPORTED}
    assert {"mass", "inertia", "gravity", "places of contact", "forces of contact"} <= told
    assert "gaps" not in told  # joints have no gap of their own
    assert not engine.built().regularised  # nothing is softened


@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", [name for name in SCENES if name != "cylinder"])
def test_accuracy_everywhere(name: str) -> None:
    """The same code is as accurate for every start and every tilt."""
    errors = largest_errors(SCENES[name], "pinocchio[formulation=composite,preset=tuned]", until=0.5, every=0.1)
    assert errors["p_WB"] < 1e-12
    assert errors["w_WB"] < 1e-10
    assert max(errors["N"], errors["F2"], errors["F3"]) < 1e-11


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("integrator", "orientation", "dt"),
    [
        ("semi_implicit_euler", True, 2e-3),
        ("rk4", True, 2e-3),
        ("rk4", False, 5e-3),
        ("rk4_dexpinv", True, 1e-3),
    ],
)
def test_declared_order(integrator: str, orientation: bool, dt: float) -> None:
    """The measured order is the declared one: rk4 with pin.integrate is of order 2 as long as it turns the ball."""
    options = {"formulation": "composite", "integrator": integrator, "orientation": orientation, "preset": "default"}
    scene, until = cylinder(), 0.2
    true = true_run(scene, until, until / 2)
    errors = []
    for step in (dt, dt / 2):
        run = simulate(scene, "pinocchio", until=until, every=until / 2, dt=step, **options)
        errors.append(float(np.abs(run.p_WB - true.p_WB).max()))
    declared = build(scene, "pinocchio", dt=dt, **options).motion._settings.order
    assert np.log2(errors[0] / errors[1]) == pytest.approx(declared, abs=0.35)


def test_projection_is_mass_orthogonal() -> None:
    """What the projection takes from the velocities is an impulse of the rows: orthogonal to every rolling motion."""
    mechanism = build(cylinder(), "pinocchio", formulation="composite").mechanism
    data = mechanism.model.createData()
    v = mechanism.v0 + np.array([1e-3, 2e-3, 0.3, 0.1, -0.2])
    q, corrected = mechanism.project(data, mechanism.q0, v)
    rows = mechanism.rows(data, q, corrected).rows
    rolling = np.linalg.svd(rows)[2][2:]
    assert np.abs(rows @ corrected).max() < 1e-14
    assert np.abs(rolling @ data.M @ (corrected - v)).max() < 1e-15


def test_joint_transmits_what_the_multipliers_say() -> None:
    """In composite the spherical joint's wrench has no couple, and its friction is that of the multipliers."""
    mechanism = build(cylinder(axial_speed=0.3, radial_spin=5), "pinocchio").mechanism
    data = mechanism.model.createData()
    _, force = mechanism.reaction(data, mechanism.q0, mechanism.v0)
    wrench = data.oMi[mechanism.ball].act(data.f[mechanism.ball])
    np.testing.assert_allclose(wrench.linear, force, rtol=0, atol=1e-13 * np.linalg.norm(force))


@pytest.mark.drill
def test_orientation_is_absent_where_it_is_not_integrated() -> None:
    """Without the orientation the sample says nothing about it, rather than something wrong."""
    for options in ("preset=matched", "preset=tuned", "preset=default,orientation=false"):
        assert "q_WB" not in simulate(cylinder(), f"pinocchio[{options}]", until=0.01)


@pytest.mark.drill
def test_accuracy_does_not_depend_on_sampling() -> None:
    """Samples further apart than the steps, or closer, are as accurate: each is the end of a step."""
    for until, every in ((1.0, 1.0), (0.1, 1e-3)):
        assert largest_errors(cylinder(), "pinocchio[preset=tuned]", until=until, every=every)["z"] < 5e-13


def test_singular_rows_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Equations that cannot be solved end the run with a sentence, not with a traceback."""
    engine = build(
        cylinder(rolling_resistance=RESISTANCE), "pinocchio[preset=default,orientation=true,integrator=rk4_dexpinv]"
    )

    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(np.linalg, "solve", singular)
    with pytest.raises(Diverged, match="singular"):
        engine.advance(0.01)


def test_resistance_is_read_at_rest() -> None:
    """Rolling resistance is read back where the ball rests, too, though its moment has no direction there."""
    moving = cylinder(rolling_resistance=RESISTANCE)
    scene = scene_with(moving, start=dataclasses.replace(placed(moving).start, velocity=(0.0, 0.0)))
    assert build(scene, "pinocchio").built().contact_rolling[0] == pytest.approx(RESISTANCE, rel=1e-14)
