"""Settings as lines of a user's own model."""

from __future__ import annotations

from typing import Any

import exudyn
import mujoco
import numpy as np
import pinocchio as pin
import pytest

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.engines.exudyn.integration import simulation_settings

BALL = "<worldbody><body><freejoint/><geom size='1'/></body></worldbody>"


def told(engine: str, **options: Any) -> tuple[Any, str]:
    """Complete settings, and their lines."""
    adapter = load_engine(engine)
    settings = resolve_settings(adapter, options)
    return settings, "\n".join(adapter.lines(settings))


@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
@pytest.mark.parametrize("formulation", ["joints", "geoms"])
def test_lines_of_mjcf_make_the_options_of_the_settings(formulation: str, preset: str) -> None:
    """A user's own model with the lines has the step, the integrator, the cone and the softness of the settings."""
    settings, lines = told("mujoco", formulation=formulation, preset=preset, dt=1 / 871)
    model = mujoco.MjModel.from_xml_string(f"<mujoco>{lines}{BALL}</mujoco>")
    assert model.opt.timestep == settings.dt
    assert mujoco.mjtIntegrator(model.opt.integrator).name == f"mjINT_{settings.integrator.upper()}"
    assert ("cone_correction" in lines) == settings.cone_correction
    if formulation == "geoms":
        assert mujoco.mjtCone(model.opt.cone).name == f"mjCONE_{settings.cone.upper()}"
        assert model.geom_solref[0, 0] == pytest.approx(settings.contact_time)
        assert model.geom_solimp[0, :2] == pytest.approx(settings.impedances)
    elif settings.time_constant is not None:
        assert f'<equality solref="{settings.contact_time:g}"' in lines


def test_lines_of_mjcf_have_the_solver() -> None:
    """Options of the solver that are not MuJoCo's defaults stand in the lines."""
    asked = {"solver": "PGS", "iterations": 7, "noslip_iterations": 3, "impratio": 10.0, "eulerdamp": False}
    _, lines = told("mujoco", formulation="geoms", preset="default", integrator="Euler", **asked)
    option = mujoco.MjModel.from_xml_string(f"<mujoco>{lines}{BALL}</mujoco>").opt
    assert mujoco.mjtSolver(option.solver) == mujoco.mjtSolver.mjSOL_PGS
    assert (option.iterations, option.noslip_iterations, option.impratio) == (7, 3, 10.0)
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_EULERDAMP


def test_lines_for_exudyn_make_the_settings_of_a_run() -> None:
    """Set in new simulation settings, all but files and the length of a run are those of the adapter."""
    adapter = load_engine("exudyn")
    for formulation, presets in adapter.presets.items():
        for preset in presets:
            settings, lines = told("exudyn", formulation=formulation, preset=preset)
            made = exudyn.SimulationSettings()
            made.timeIntegration.endTime = 1.0
            exec(lines, {"simulationSettings": made, "exu": exudyn})
            wanted = simulation_settings(settings, dependent=formulation == "redundant")
            assert made.timeIntegration.numberOfSteps == round(1 / settings.dt)
            for part in ("newton", "generalizedAlpha"):
                left, right = (getattr(item.timeIntegration, part).GetDictionary() for item in (made, wanted))
                assert left == right
            assert made.linearSolver.GetDictionary() == wanted.linearSolver.GetDictionary()
            for name in ("adaptiveStep", "solverType"):
                assert getattr(made.timeIntegration, name) == getattr(wanted.timeIntegration, name)


@pytest.mark.parametrize("preset", ["default", "tuned"])
def test_lines_for_pinocchio_give_an_acceleration(preset: str) -> None:
    """They run as they stand on a chain that hangs at a point, whose end then stays where it is."""
    model = pin.buildSampleModelManipulator()
    q, v = np.full(model.nq, 0.3), np.zeros(model.nv)
    constraints = pin.StdVec_RigidConstraintModel()
    end, place = model.njoints - 1, pin.SE3.Identity()
    constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, end, place, pin.LOCAL))
    names: dict[str, Any] = {"pin": pin, "model": model, "constraints": constraints, "q": q, "v": v}
    settings, lines = told("pinocchio", formulation="constraint_dynamics", preset=preset)
    exec(lines, names | {"tau": np.zeros(model.nv)}, names)
    data = model.createData()
    pin.forwardKinematics(model, data, q, v, names["a"])
    moved = pin.getAcceleration(model, data, end).linear
    assert np.linalg.norm(names["a"]) > 1
    assert np.abs(moved).max() < 1e-6
    assert (f"{settings.dt!r} s" if settings.dt else repr(settings.rtol)) in lines


@pytest.mark.parametrize(
    ("engine", "formulation"), [("mujoco", "chart"), ("pinocchio", "impulses"), ("pinocchio", "null_space")]
)
def test_models_of_proofroll_have_no_lines(engine: str, formulation: str) -> None:
    """What no user's model has is refused with the reason."""
    with pytest.raises(Refused, match=r"proofroll's"):
        told(engine, formulation=formulation)
