"""MuJoCo against the truth: accuracy, order, what was built, and what must not happen."""

from __future__ import annotations

import dataclasses
import functools

import mujoco
import numpy as np
import pytest

from proofroll.conformance.motion import order_is_as_declared
from proofroll.conformance.subject import Subject, scenes
from proofroll.core.certificate import certify, first_difference
from proofroll.core.engine_abilities import declared_order
from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.engines.mujoco import mjspec
from proofroll.engines.mujoco.settings import ORDER_OF_TURNING
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import load_scene
from proofroll.running.identity import used
from proofroll.running.simulation import build, simulate

SCENES = scenes()
CYLINDER = "sphere_in_cylinder"
Mujoco = load_engine("mujoco")
PRESETS = Mujoco.presets
MODELS = [("chart", preset) for preset in PRESETS["chart"]]


@functools.cache
def moved(scene: str, engine: str, until: float, **parameters: float):
    """The trajectory, computed once for all tests."""
    return simulate(load_scene(scene, **parameters), engine, until=until, every=0.05)


def error(scene: str, engine: str, variable: str, *, until: float = 1.0, signed: bool = False, **parameters: float):
    """Largest difference from the truth, or the difference at each sample."""
    run, true = (moved(scene, name, until, **parameters) for name in (f"mujoco[{engine}]", "truth"))
    assert run.status == "done", run.message
    difference = (run[variable] - true[variable]).to_numpy()
    return difference if signed else float(np.max(np.abs(difference)))


def numbers(sample: MechanismSample) -> np.ndarray:
    """Everything of a ball in a sample as one row."""
    parts = [sample.p_WB, sample.v_WB, sample.w_WB, sample.q_WB, sample.contact_force]
    return np.concatenate([np.ravel(part) for part in parts])


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("model", "scene", "order"),
    [
        (("chart", "default"), SCENES["cylinder"], ORDER_OF_TURNING),
        (("joints", "matched"), SCENES["heavy_top"], ORDER_OF_TURNING),
        (("joints", "matched"), SCENES["double_pendulum"], 4),
    ],
)
def test_order_hangs_on_the_scene(model: tuple[str, str], scene: Scene, order: int) -> None:
    """RK4 shows the order that is declared: its own, and before 4.0 less by quaternions; a resistance lowers it."""
    settings = PRESETS[model[0]][model[1]]
    assert declared_order(Mujoco, settings, scene) == order
    assert declared_order(Mujoco, PRESETS["chart"]["default"], SCENES["cylinder-resisting"]) == 2
    order_is_as_declared(Subject(Mujoco, settings, scene))


# z's range is 0.12 m. Each bound is about 1.5 times what MuJoCo 4.0 gives, so that a change of the method is seen.
@pytest.mark.nightly
@pytest.mark.drill_of("formulation=geoms,preset=tuned,dt=5e-4")
@pytest.mark.parametrize("engine", ["formulation=chart,dt=5e-4", "formulation=geoms,preset=tuned,dt=5e-4"])
def test_reactions_are_the_truths(engine: str) -> None:
    """N, F2 and F3 as MuJoCo computed them agree with the truth within 0.15 % of the normal force (41 N)."""
    # F3 of the chart carries b = 1/dt times the slip that is left, an error of first order: 6 mN at this step.
    for variable in ("N", "F2", "F3"):
        assert error(CYLINDER, engine, variable, **ROLLING) < 0.06
    # The weight's share is 1.45 N: this bound sees a doubled inertia, which would change it by 0.8 N.
    assert error(CYLINDER, engine, "F3", **ROLLING) < 0.01


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.drill_of(
    "formulation=geoms,preset=tuned-parameters1-0.0002", "formulation=geoms,preset=tuned-parameters2-0.0002"
)
@pytest.mark.parametrize(
    ("engine", "parameters", "bound"),
    [
        ("formulation=chart", {"speed": 6.0, "rolling_resistance": 5e-4}, 3e-4),
        ("formulation=geoms,preset=tuned", {"speed": -4.0, "rolling_resistance": 5e-4}, 2e-4),
        ("formulation=geoms,preset=tuned", {"axial_speed": 0.3, "radial_spin": 5.0, "rolling_resistance": 5e-4}, 2e-4),
    ],
)
def test_other_motions_in_the_cylinder(engine: str, parameters: dict[str, float], bound: float) -> None:
    """Fast, backwards and spinning starts are as accurate as the plain one."""
    assert error(CYLINDER, engine, "z", **parameters) < bound


@pytest.mark.drill
def test_default_contact_is_wrong_at_every_step() -> None:
    """With MuJoCo's default contact the ball on joints is off by centimetres at every step."""
    for dt in (2e-3, 5e-4):
        assert 0.01 < error(CYLINDER, f"formulation=chart,preset=default,dt={dt:g}", "z", until=2.0) < 0.04


def test_default_contact_is_mujocos() -> None:
    """Where the settings leave the contact to MuJoCo, its own numbers are in the model, whatever the file says."""
    bare = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    contact = build(load_scene(CYLINDER), "mujoco[preset=default]")._evaluated().contact[0]
    np.testing.assert_array_equal(contact.solref, bare.geom_solref[0])
    np.testing.assert_array_equal(contact.solimp, bare.geom_solimp[0])


ROLLING = {"rolling_resistance": 5e-4}


@pytest.mark.parametrize(("formulation", "preset"), MODELS)
def test_what_is_read_back_is_the_engines(formulation: str, preset: str) -> None:
    """Numbers changed in MuJoCo's model, or in the law of the torque, after the build fail the certificate."""
    scene = load_scene(CYLINDER, **ROLLING)
    built = build(scene, f"mujoco[formulation={formulation},preset={preset}]")
    built._model.geom_friction[:, 0] = 0.5
    built._formulation.resistance = dataclasses.replace(built._formulation.resistance, f=1e-4)
    failed = {line.quantity for line in certify(built, scene) if not line.holds}
    assert {"inverse friction", "rolling resistance"} <= failed


@pytest.mark.parametrize("parameters", [{"gravity": 0.0}, {"speed": 0.8}])
@pytest.mark.parametrize(("formulation", "preset"), MODELS)
def test_resistance_is_read_back_before_there_is_a_load(
    formulation: str, preset: str, parameters: dict[str, float]
) -> None:
    """Where no torque acts at time 0, f is that of the law of the torque, and a dropped f is seen."""
    scene = load_scene(CYLINDER, **ROLLING, **parameters)
    spec = f"mujoco[formulation={formulation},preset={preset}]"
    assert first_difference(certify(build(scene, spec), scene)) is None
    dropped = certify(build(load_scene(CYLINDER, **parameters), spec), scene)
    assert "rolling resistance" in {line.quantity for line in dropped if not line.holds}


def test_numbers_in_the_file_are_the_scenes() -> None:
    """The MJCF file, opened alone, is the model that the adapter builds from the scene's defaults."""
    loaded = load_scene(CYLINDER)
    alone = mujoco.MjModel.from_xml_path(str(loaded.folder / "mujoco_chart.xml"))
    engine = build(loaded, "mujoco[formulation=chart,preset=matched]")
    ours = engine._model
    compared = 0
    for owner, other in ((alone, ours), (alone.opt, ours.opt)):
        for name in dir(owner):
            value = getattr(owner, name)
            if not name.startswith("_") and isinstance(value, (int, float, np.ndarray)):
                # files have ten digits or more, and the two compute the same from them
                np.testing.assert_allclose(value, getattr(other, name), rtol=1e-9, atol=1e-11, err_msg=name)
                compared += 1
    assert compared > 200
    # The adapter starts at the depth that carries the load, at most 1e-7 m, and with the spin that rolls there.
    np.testing.assert_allclose(alone.key_qpos[0], engine._data.qpos, atol=1e-7)
    np.testing.assert_allclose(alone.key_qvel[0], engine._data.qvel, rtol=1e-6, atol=1e-4)


def test_callbacks_of_others_are_forgotten_and_ours_do_not_stay() -> None:
    """Callbacks are global in MuJoCo: one that somebody left changes nothing, and after a run there is none."""

    def end() -> np.ndarray:
        engine = build(load_scene(CYLINDER, **ROLLING), "mujoco[formulation=chart]")
        engine.advance(0.05)
        return numbers(engine.sample())

    expected = end()
    mujoco.set_mjcb_control(lambda _, data: data.qfrc_applied.fill(1.0))
    np.testing.assert_array_equal(end(), expected)
    assert mujoco.get_mjcb_contactfilter() is mujoco.get_mjcb_passive() is mujoco.get_mjcb_control() is None


@pytest.mark.parametrize("engine", ["impedance=0.505", "impedance=1e-4"])
def test_soft_contact_starts_as_the_scene_says(engine: str) -> None:
    """Up to the least impedance that is allowed the start converges, and lies as deep as is declared."""
    scene = load_scene(CYLINDER, **ROLLING)
    assert first_difference(certify(build(scene, f"mujoco[{engine}]"), scene)) is None


def test_file_of_another_surface_is_refused(tmp_path) -> None:
    """A chart whose joints are not the surface's motions is refused, not run."""
    cylinder = load_scene(CYLINDER)
    text = (
        (cylinder.folder / "mujoco_chart.xml").read_text().replace('name="u1" type="hinge"', 'name="u1" type="slide"')
    )
    (tmp_path / "mujoco_chart.xml").write_text(text)
    cylinder = dataclasses.replace(cylinder, folder=tmp_path)
    with pytest.raises(Refused, match="u1"):
        build(cylinder, "mujoco")
    with pytest.raises(Refused, match=r'files = \["mujoco_chart.xml"\]'):
        build(dataclasses.replace(cylinder, files=()), "mujoco")
    (tmp_path / "mujoco_chart.xml").write_text("<mujoco><worldbody><bo")
    with pytest.raises(Refused, match="cannot read"):
        build(cylinder, "mujoco")


def test_contact_too_soft_to_start_is_refused() -> None:
    """Where the settled depth would exceed the ball's radius the engine refuses instead of starting inside out."""
    with pytest.raises(Refused, match="soft"):
        build(load_scene(CYLINDER, speed=60.0), "mujoco[dt=1e-2,impedance=0.01]")


@pytest.mark.parametrize("value", [np.nan, 1e12])
def test_blow_up_is_reported_and_not_reset(value: float, tmp_path, monkeypatch, capfd) -> None:
    """MuJoCo would silently return to the initial state; the adapter says when and why, and nothing is printed."""
    monkeypatch.chdir(tmp_path)
    engine = build(load_scene(CYLINDER), "mujoco")
    engine._data.qvel[:] = value
    with pytest.raises(Diverged, match=r"before 0\.01 s"):
        engine.advance(0.01)
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_a_ball_below_the_least_inertia_is_refused() -> None:
    """MuJoCo takes no inertia below 1e-15 kg m²; a grain of dust is refused with its words, not with a crash."""
    dust = load_scene("sphere_in_cylinder", radius=2.5e-8, cylinder_radius=2.25e-7, speed=4e-3)
    with pytest.raises(Refused, match="mass and inertia"):
        Mujoco.build(dust, Mujoco.presets["chart"]["matched"])


@pytest.mark.parametrize("name", ["double_pendulum", "heavy_top"])
def test_a_mechanism_as_a_spec_and_as_a_file(name):
    """Spec and file hold the scene's names and every digit of its model, and start where it does."""
    scene = load_scene(name, mass=1 / 3) if name == "heavy_top" else load_scene(name)
    spec = mjspec(scene, dt=1 / 3000)
    own, run = spec.compile(), Mujoco.build(scene, PRESETS["joints"]["default"])
    assert [joint.name for joint in spec.joints] == [joint.name for joint in scene.elements[0].mechanism.joints]
    read = mujoco.MjModel.from_xml_string(Mujoco.model_file(scene, PRESETS["joints"]["default"]))
    for field in ("body_mass", "body_inertia", "body_ipos", "body_pos", "jnt_pos", "key_qpos", "key_qvel"):
        assert np.array_equal(getattr(read, field), getattr(own, field)), field
    assert own.opt.timestep == 1 / 3000
    assert np.array_equal(own.key_qpos[0], run._data.qpos)
    with pytest.raises(InputError, match="steps"):
        mjspec(scene, steps=3)
    with pytest.raises(InputError, match="choose one of chart, joints, geoms"):
        mjspec(scene, formulation="none")
    assert len(mjspec(load_scene("sled"), formulation="geoms").geoms) > len(mjspec(load_scene("pendulum")).geoms)


def test_a_spec_of_what_export_takes():
    """A ball on a surface and bodies that touch have a spec, too; ``portable`` keeps MuJoCo's automatic reset."""
    flag = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    for name in (CYLINDER, "sled"):
        scene = load_scene(name)
        model = mjspec(scene).compile()
        assert model.nkey == 1
        assert model.opt.disableflags & flag
        assert not mjspec(scene, portable=True).compile().opt.disableflags & flag


def test_a_spec_holds_a_constant_drive(tmp_path):
    """From its keyframe, the model alone moves as the run with a constant torque of a joint does."""
    text = (data_folder("models") / "pendulum" / "scene.toml").read_text(encoding="utf-8")
    (tmp_path / "scene.toml").write_text(text.replace('v0 = "$speed"', 'v0 = "$speed"\ntorque = 2.5'), encoding="utf-8")
    scene = load_scene(str(tmp_path))
    run, model = Mujoco.build(scene, PRESETS["joints"]["default"]), mjspec(scene, preset="default").compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    run.advance(0.1)
    mujoco.mj_step(model, data, nstep=round(0.1 / model.opt.timestep))
    assert np.allclose(data.qpos, run._data.qpos, rtol=0, atol=1e-13)
    assert model.nu == 1


def test_six_digits_are_said(monkeypatch):
    """A MuJoCo without the function that sets digits writes a model whose first line says how many it has."""
    monkeypatch.setattr("proofroll.engines.mujoco.running._DIGITS", "_gone")
    text = Mujoco.model_file(load_scene("heavy_top", mass=1 / 3), PRESETS["joints"]["default"])
    assert text.startswith("<!-- 6 digits: MuJoCo")
    assert mujoco.MjModel.from_xml_string(text).nbody == 2


def test_a_mechanism_lists_no_settings_of_contact():
    """Settings of a run are those of its formulation; what is resolved from them again is the same."""
    settings = PRESETS["joints"]["matched"]
    told = used(settings)
    assert not {"cone", "friction", "start", "curvature", "condim"} & set(told)
    assert {"integrator", "time_constant"} <= set(told)
    assert resolve_settings(Mujoco, told) == settings
    assert "cone" in used(PRESETS["geoms"]["matched"])
    assert "condim" in used(PRESETS["chart"]["matched"])
