from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.errors import Diverged
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.running.simulation import build, simulate

pytest.importorskip("exudyn")

FORMULATIONS = ("carrier", "rolling_disc")
UNTIL = 0.5


def cylinder(**parameters: float) -> Scene:
    """The cylinder scene at V0 = 4 m/s."""
    return load_scene("sphere_in_cylinder", **{"speed": 4, **parameters})


def test_carrier_weighs_nothing() -> None:
    """The carrier has no mass and no inertia, so nothing has to be made small."""
    model = build(cylinder(), "exudyn", formulation="carrier")
    carrier = model.system.GetObject(model.carrier)
    assert carrier["mass"] == 0
    assert not np.any(carrier["inertia"])


@pytest.mark.parametrize("formulation", ["carrier", "rolling_disc"])
def test_too_large_a_step_diverges(formulation: str) -> None:
    """A ball that turns by 1.6 rad per step with the engine's default damping ends in one sentence, not in numbers."""
    engine = build(cylinder(), "exudyn", formulation=formulation, preset="default", dt=0.01)
    with pytest.raises(Diverged, match=r"Newton's method did not converge; use a smaller dt") as raised:
        engine.advance(1.0)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_default_preset_is_the_engines_default(formulation: str) -> None:
    """The preset `default` leaves integrator, damping and Newton options as a new SimulationSettings has them."""
    import exudyn

    own = exudyn.SimulationSettings().timeIntegration
    model = build(cylinder(), "exudyn", formulation=formulation, preset="default")
    built = model.integration.options.timeIntegration
    for group, names in (
        ("newton", ("relativeTolerance", "absoluteTolerance", "useModifiedNewton", "modifiedNewtonJacUpdatePerStep")),
        ("generalizedAlpha", ("spectralRadius", "useNewmark", "useIndex2Constraints")),
    ):
        for name in names:
            assert getattr(getattr(built, group), name) == getattr(getattr(own, group), name), name


def test_another_integrator_over_a_preset() -> None:
    """The damping of a preset goes with its integrator, and comes with the engine's own value with the other one."""
    Exudyn = load_engine("exudyn")

    tuned = {"formulation": "carrier", "preset": "tuned"}
    undamped = resolve_settings(Exudyn, {**tuned, "integrator": "trapezoidal_index2"})
    assert undamped.spectral_radius is None
    assert resolve_settings(Exudyn, dataclasses.asdict(undamped)) == undamped
    assert resolve_settings(Exudyn, {**tuned, "spectral_radius": "0.6"}).spectral_radius == 0.6
    damped = build(cylinder(), "exudyn", integrator="generalized_alpha")
    assert damped.integration.options.timeIntegration.generalizedAlpha.spectralRadius == 0.9


def test_timeout_of_the_engine_is_noticed() -> None:
    """Exudyn reports success when its own timeout stops it; here it is a divergence with a sentence."""
    import exudyn

    engine = build(cylinder(), "exudyn", formulation="carrier", dt=1e-4)
    exudyn.special.solver.timeout = 1e-4
    try:
        with pytest.raises(Diverged, match="timeout"):
            engine.advance(1.0)
    finally:
        exudyn.special.solver.timeout = -1


def test_error_in_a_callback_is_a_sentence() -> None:
    """An exception inside a function that Exudyn calls ends the run with one line that names it."""
    engine = build(cylinder(), "exudyn", formulation="rolling_disc", dt=1e-3)

    def broken(*_: Any) -> None:
        raise ArithmeticError("no normal here")

    engine.system.SetPreNewtonResidualUserFunction(broken)
    with pytest.raises(Diverged, match="no normal here") as raised:
        engine.advance(0.1)
    assert "\n" not in str(raised.value)


def test_silent(capfd: pytest.CaptureFixture[str]) -> None:
    """Nothing is printed, not even by Exudyn's own code and not when it fails."""
    for formulation in FORMULATIONS:
        build(cylinder(), "exudyn", formulation=formulation, dt=1e-3).advance(0.01)
    out, err = capfd.readouterr()
    assert out + err == ""


@pytest.mark.one_in(2)
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("size", [1e-6, 1e6])
def test_size_does_not_matter(formulation: str, size: float) -> None:
    """With all lengths scaled, and the speed as the root of that, the height scales along: nothing has a size."""

    def height(factor: float) -> float:
        lengths = {"radius": 0.025 * factor, "cylinder_radius": 0.225 * factor, "speed": 4 * factor**0.5}
        clock = factor**0.5
        run = simulate(
            load_scene("sphere_in_cylinder", **lengths), "exudyn", formulation=formulation, dt=1e-3 * clock,
            until=0.05 * clock, every=0.05 * clock,
        )  # fmt: skip
        return float(run["z"][-1]) / factor

    assert height(size) == pytest.approx(height(1.0), rel=1e-4)
