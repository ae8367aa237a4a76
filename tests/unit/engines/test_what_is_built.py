"""What a scene does not require is not in the model that an engine builds: looked for in the engine's own objects."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from true_runs import true_run

from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build, simulate

RESISTANCE = 5e-4
NEEDS = {
    "nothing": ({}, frozenset()),
    "resistance": ({"rolling_resistance": RESISTANCE}, {MechanismCapability.TURNING_FRICTION}),
}
OURS = ("projection", "reduced", "exudyn", "pinocchio", "mujoco")
TURNING = frozenset({MechanismCapability.ORIENTATION})


def scene(*asks: str, **parameters: float) -> Scene:
    """The ball in the cylinder."""
    return load_scene("sphere_in_cylinder", asks=asks, **parameters)


@pytest.mark.parametrize(
    ("engine", "always"),
    [
        ("projection[formulation=euler]", TURNING),
        ("projection[formulation=rotating_frame]", frozenset()),
        ("pinocchio[formulation=composite]", frozenset()),
        ("pinocchio[formulation=composite,preset=default]", TURNING),
        ("exudyn[formulation=carrier]", TURNING),
        ("mujoco[formulation=chart]", TURNING),
    ],
)
@pytest.mark.parametrize("need", NEEDS)
def test_terms_follow_the_scene(engine: str, always: frozenset[MechanismCapability], need: str) -> None:
    """Each term is told exactly where the scene requires it, but for an orientation that is always there."""
    parameters, terms = NEEDS[need]
    assert build(scene(**parameters), engine).built().terms == always | terms


@pytest.mark.parametrize("f", [0.0, RESISTANCE])
def test_projection(f: float) -> None:
    """The state is as long as the formulation needs, rows are those of rolling, and there is no moment without f."""
    for formulation, asks, length in (
        ("rotating_frame", (), 7),  # two coordinates, five velocities
        ("rotating_frame", ("orientation",), 11),  # a quaternion
        ("euler", (), 10),  # three angles
    ):
        engine = build(scene(*asks, rolling_resistance=f), "projection", formulation=formulation)
        assert len(engine._motion.x) == length
        kin = engine._ball.kinematics(engine._motion.x)
        assert bool(np.any(engine._ball.resistance(kin, 1.0))) == (f > 0)


@pytest.mark.nightly
def test_the_orientation_in_the_rotating_frame_is_a_quadrature() -> None:
    """Asked for, the orientation turns with the spin, is that of the Euler angles, and leaves the motion alone."""
    with_it, angles, without = (
        simulate(scene(*asks), "projection", formulation=formulation, until=0.2)
        for asks, formulation in ((("orientation",), "rotating_frame"), ((), "euler"), ((), "rotating_frame"))
    )
    assert "q_WB" not in without
    turned, expected = (Rotation.from_quat(run.q_WB.to_numpy(), scalar_first=True) for run in (with_it, angles))
    assert np.max((turned * expected.inv()).magnitude()) < 1e-10
    np.testing.assert_allclose(with_it.z, without.z, rtol=0, atol=1e-13)


def test_pinocchio() -> None:
    """No joint and no mass but those needed, no torque without f, an orientation that stays unless asked for."""
    engine = build(scene(), "pinocchio", formulation="composite")
    mechanism, motion = engine.mechanism, engine.motion
    assert (mechanism.model.njoints, mechanism.model.nv) == (4, 5)
    assert [float(inertia.mass) for inertia in mechanism.model.inertias if inertia.mass > 0] == [0.517]
    assert not mechanism.rows(mechanism.model.createData(), mechanism.q0, mechanism.v0).resistance.any()
    engine.advance(0.01)
    np.testing.assert_array_equal(motion.q[-4:], mechanism.q0[-4:])
    asked = build(scene("orientation"), "pinocchio", formulation="composite")
    asked.advance(0.01)
    assert np.max(np.abs(asked.motion.q[-4:] - asked.mechanism.q0[-4:])) > 0.1


def test_pinocchio_is_told_to_leave_out_what_is_asked() -> None:
    """A setting that contradicts what is asked is refused with both."""
    with pytest.raises(Refused, match="needs the orientation of a ball that rolls, which orientation=false leaves out"):
        build(scene("orientation"), "pinocchio[orientation=false]")


@pytest.mark.parametrize(("f", "torque"), [(0.0, set()), (RESISTANCE, {"TorqueVector"})])
@pytest.mark.parametrize("formulation", ["carrier", "rolling_disc"])
def test_exudyn(formulation: str, f: float, torque: set[str]) -> None:
    """Among Exudyn's loads there is a torque, with a user function, only where the scene has rolling resistance."""
    system = build(scene(rolling_resistance=f), "exudyn", formulation=formulation).system
    found = [system.GetLoad(number) for number in range(system.systemData.NumberOfLoads())]
    assert {load["loadType"] for load in found} == {"MassProportional"} | torque
    assert sum(bool(load.get("loadVectorUserFunction")) for load in found) == (f > 0)


@pytest.mark.parametrize("f", [0.0, RESISTANCE])
def test_mujoco(f: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Contacts have three dimensions; without f there is no torque, no memory for it and no passive callback."""
    given: list[object] = []
    install = mujoco.set_mjcb_passive
    monkeypatch.setattr(mujoco, "set_mjcb_passive", lambda callback: (given.append(callback), install(callback)))
    engine = build(scene(rolling_resistance=f), "mujoco", formulation="chart")
    engine.advance(0.02)
    model, data = engine._model, engine._data
    assert set(model.geom_condim) == {3}
    assert np.all(model.geom_friction[:, 1:] == 0)
    assert bool(np.any(data.xfrc_applied)) == (f > 0)
    assert (model.nuserdata > 0) == (f > 0)
    assert any(callback is not None for callback in given) == (f > 0)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("condim", "coefficients"), [(4, [5e-3]), (6, [5e-3, 1e-4])])
def test_mujoco_contact_of_more_dimensions(condim: int, coefficients: list[float]) -> None:
    """Friction against turning and rolling is in the contact that MuJoCo makes, is told, and ruins the motion."""
    options = f"mujoco[condim={condim}]"
    engine = build(scene(), options)
    contact = engine._evaluated().contact[0]
    assert contact.dim == condim
    assert contact.friction[2 : 2 + len(coefficients)].tolist() == coefficients
    assert (MechanismCapability.TURNING_FRICTION in engine.built().terms) == (condim == 6)
    run, truth = simulate(scene(), options, until=1.0, every=0.1), true_run(scene(), 1.0, 0.1)
    assert run.status == "done"
    assert float(np.max(np.abs(run.z - truth.z))) > 0.02  # of a range of 0.12 m


@pytest.mark.parametrize("name", OURS)
def test_who_builds_without_the_harness_is_refused_too(name: str) -> None:
    """A formulation refuses in `build` itself what it does not provide, for tests call it without the harness."""
    kind = load_engine(name)
    slips, flies, turns = (load_scene(name) for name in ("slide_to_roll", "bouncing_ball", "turntable"))
    tried = 0
    for formulation, presets in kind.presets.items():
        if formulation == "discs":
            continue  # it refuses a shape before anything else
        for one in (slips, flies, turns, scene("orientation")):
            lacking = one.requires - kind.provides[formulation]
            if not lacking:
                continue
            with pytest.raises(Refused, match="needs "):
                kind.build(one, next(iter(presets.values())))
            tried += 1
    assert tried > 1


@pytest.mark.parametrize("name", OURS)
def test_a_formulation_of_a_rolling_ball_says_that_it_has_no_other_bodies(name: str) -> None:
    """Who asks it for a ball on a plane reads what it represents, and not that it lacks what a ball is."""
    kind, said = load_engine(name), 0
    for formulation, presets in kind.presets.items():
        if MechanismCapability.FREE in kind.provides[formulation] or formulation == "tree":
            continue
        with pytest.raises(Refused, match="free bodies, and it represents nothing but a ball that rolls without slip"):
            kind.build(load_scene("slide_to_roll"), next(iter(presets.values())))
        said += 1
    assert said
