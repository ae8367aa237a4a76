"""Robot files as scenes: the same mechanics as the file's, judged by the truth in every engine that can, or refused."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_gallery import locate
from robot_templates import inertial, mjcf, spherical, urdf
from typer.testing import CliRunner

from proofroll import judge, load_scene, simulate
from proofroll.cli import app
from proofroll.core.errors import InputError, Refused
from proofroll.core.events import events_of
from proofroll.core.limits import TIME_LIMIT
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.robots.check.two_formulations import world_jacobians
from proofroll.robots.files.meaning import meaning
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.reading import write
from proofroll.robots.scene import RobotScenes
from proofroll.robots.states import random_states
from proofroll.truth.bodies import maximal_taylor

EVERY_KIND = """<mujoco model="mobile"><worldbody>
<body name="lone" pos="2 0 0" euler="0 30 0"><joint name="k0" type="ball" pos="0.1 0 0"/>
<geom type="box" pos="0.1 0.2 0" size="0.1 0.2 0.3"/></body>
<body name="carrier" pos="0 0 1"><freejoint name="root"/><geom type="box" pos="0.1 0 0" size="0.3 0.2 0.1"/>
<body name="bracket" pos="0.2 0.1 0" euler="10 0 20"><geom type="sphere" size="0.1"/>
<body name="upper" pos="0.1 0.2 0.3" euler="10 20 30">
<joint name="k1" type="hinge" axis="0 0.6 0.8" armature="0.3" damping="0.2" stiffness="4" springref="20"/>
<geom type="capsule" fromto="0 0 0 0.1 0.2 0.4" size="0.05"/>
<body name="lower" pos="0.1 0.2 0.4" euler="-20 5 40">
<joint name="k2" type="slide" axis="1 0 1" armature="0.4" damping="1"/>
<geom type="box" pos="0.05 0 0.1" size="0.05 0.07 0.11"/></body></body></body></body></worldbody></mujoco>"""
FILES = {
    "arm.urdf": (urdf(tool=inertial(mass="0.4"), first='<dynamics damping="0.3"/>'), {"speed": 2.0, "seed": 3}),
    "floating.urdf": (urdf(), {"free_base": 1, "seed": 1}),
    "moving.xml": (EVERY_KIND, {}),
}


@pytest.fixture
def robot(tmp_path: Path):
    """Writes a robot file."""

    def written(name: str, text: str) -> str:
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return written


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("name", FILES)
def test_a_robot_moves_as_its_file_says(robot, name):
    """Accelerations of the scene at its start are those of the file's robot by world Jacobians, damping included."""
    text, parameters = FILES[name]
    path = robot(name, text)
    mechanism = load_scene(path, **parameters).elements[0].mechanism
    found = JointCoordinates(mechanism).solve(*mechanism.start()).acceleration
    file = open_robot(Path(path), "free" if parameters.get("free_base") else "fixed")
    whole = meaning(file, write(file, Path(path).parent), TIME_LIMIT)[0]
    state = random_states(whole, 1, int(parameters.get("seed", 0)))
    speed = parameters.get("speed", 1)
    state = dataclasses.replace(state, velocity={name: speed * v for name, v in state.velocity.items()})
    dynamics, v = world_jacobians(whole, state), state.stacked(state.velocity, whole)[0]
    columns = [joint for joint in whole.moving for _ in range(joint.dofs)]
    springs = [
        joint.stiffness * (state.angle[joint.name][0] - joint.rest) if joint.stiffness else 0.0 for joint in columns
    ]
    forces = -dynamics.h[0] - np.array([joint.damping for joint in columns]) * v - springs
    acceleration = np.linalg.solve(dynamics.M[0], forces)
    for joint, at in zip(mechanism.joints, mechanism.v_slices, strict=True):
        want = acceleration[whole.columns[joint.name]]
        if joint.kind == "free":  # there in the world's axes, here in the child's, which turn
            R, w = state.rotation[joint.name][0], state.velocity[joint.name][0][3:]
            want = np.concatenate([R.T @ (want[:3] - np.cross(w, state.velocity[joint.name][0][:3])), R.T @ want[3:]])
        assert found[at] == pytest.approx(want, rel=1e-9, abs=1e-9)


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("arm.urdf")
@pytest.mark.drill
@pytest.mark.parametrize("name", FILES)
def test_engines_follow_the_truth_of_a_robot(robot, name, monkeypatch):
    """MuJoCo, Pinocchio and Exudyn's constrained bodies move each robot as both routes of the truth, or refuse it.

    The arm's second route is by Taylor series; as symbols, the equations of the others would only take seconds more.
    """
    if name != "arm.urdf":
        monkeypatch.setattr(maximal_taylor, "heyoka", None)
    text, parameters = FILES[name]
    scene = load_scene(robot(name, text), **parameters)
    true = truth(scene, np.linspace(0, 0.2, 3))
    assert true.positions.attrs["error_bar"] < 1e-12
    for engine, tolerance in (("mujoco", 1e-8), ("pinocchio", 1e-8), ("exudyn", 1e-3)):
        run = simulate(scene, engine, until=0.2, every=0.1)
        for quantity in ("positions", "forces", "torques", "attitudes"):
            scale = float(np.nanmax(np.abs(true[quantity])))
            if quantity in run and not np.isnan(run[quantity]).any():
                assert float(np.abs(run[quantity] - true[quantity]).max()) < tolerance * max(scale, 1), (
                    engine,
                    quantity,
                )


@pytest.mark.nightly
def test_a_joint_that_follows_another_is_coupled_to_it(robot):
    """A mimic of a URDF is a coupling that the truth and engines obey; couplings=0 leaves it out."""
    mimic = robot("mimic.urdf", urdf(third='<mimic joint="j1" multiplier="0.5" offset="0.1"/>'))
    scene = load_scene(mimic)
    true = truth(scene, np.array([0.0, 0.1, 0.2]))
    assert np.abs(true["q.j3"] - 0.5 * true["q.j1"] - 0.1).max() < 1e-12
    assert true["coupling.j3"].attrs["error_bar"] < 1e-9
    for engine, distance, share in (("mujoco", 1e-5, 1e-2), ("projection", 1e-7, 1e-4)):
        run = simulate(scene, engine, until=0.2, every=0.1)
        assert float(np.abs(run["positions"] - true["positions"]).max()) < distance
        off = float(np.abs(run["coupling.j3"] - true["coupling.j3"]).max())
        assert off < share * float(np.abs(true["coupling.j3"]).max())
    assert "couplings of joints" not in load_scene(mimic, couplings=0).requires


@pytest.mark.drill
def test_what_no_scene_has_is_refused_by_name(robot):
    """A mimic of no ratio, dry friction, a massless moving link, an impossible inertia, a tendon: one line names it."""
    times = np.array([0.0, 0.1])
    mimic = robot("mimic.urdf", urdf(third='<mimic joint="j1" multiplier="0"/>'))
    with pytest.raises(Refused, match=r"joint j3 following j1 \(mimic\) \(couplings=0 leaves it out\)"):
        truth(load_scene(mimic), times)
    assert "j3" in {joint.name for joint in load_scene(mimic, couplings=0).elements[0].mechanism.joints}
    rough = robot("rough.urdf", urdf(second='<dynamics friction="2"/>'))
    with pytest.raises(Refused, match="needs dry friction in joints"):
        simulate(load_scene(rough), "pinocchio[formulation=null_space]", until=0.1)
    assert load_scene(rough, friction=0).requires < load_scene(rough).requires
    tendon = mjcf(extra="").replace(
        "<actuator>", '<tendon><fixed name="cord" stiffness="3"><joint joint="k1" coef="1"/></fixed></tendon><actuator>'
    )
    with pytest.raises(Refused, match="the tendon fixed cord"):
        truth(load_scene(robot("tendon.xml", tendon)), times)
    for name, text, said in (
        ("massless.urdf", urdf(tip=""), r"bodies.tip.mass.*can move here"),
        (
            "broken.urdf",
            urdf(tip=spherical("1", "0.1").replace('izz="0.1"', 'izz="0.9"')),
            "link tip> inertia.*triangle.*possible=0",
        ),
        ("carried.urdf", urdf(tool=inertial(ixx="-0.01")), "link tool> inertia.*not positive definite.*correct it"),
        ("still.urdf", urdf(kinds=("fixed", "fixed", "fixed")), "nothing in it moves; try --set free_base=1"),
    ):
        with pytest.raises(InputError, match=said):
            load_scene(robot(name, text))
    assert load_scene(robot("carried.urdf", urdf(tool=inertial(ixx="-0.01"))), possible=0)


def test_what_an_mjcf_disables_or_has_beyond_a_scene(robot):
    """Flags take gravity and springs away; a ball joint's spring is refused by name, one that is not linear at once."""
    text = """<mujoco><option><flag gravity="disable" spring="disable"/></option><worldbody><body gravcomp="1">
    <joint name="k1" type="KIND" stiffness="9" damping="1"/><geom size="1" pos="1 1 1"/></body>
    </worldbody></mujoco>"""
    mechanism = load_scene(robot("flags.xml", text.replace("KIND", "hinge"))).elements[0].mechanism
    hinge = mechanism.joints[0]
    assert (mechanism.gravity, hinge.stiffness, hinge.damping) == ((0, 0, 0), 0, 1)
    ball = robot("ball.xml", text.replace("KIND", "ball").replace('spring="disable"', ""))
    with pytest.raises(Refused, match=r"the stiffness of the spherical joint k1 \(stiffness=0 leaves all out\)"):
        simulate(load_scene(ball), "mujoco", until=0.1)
    assert load_scene(ball, stiffness=0).elements[0].mechanism.joints[0].damping == 1
    with pytest.raises(InputError, match="not linear"):
        load_scene(robot("cubic.xml", text.replace("KIND", "hinge").replace('"9"', '"9 2"')))


@pytest.mark.nightly
def test_stops_are_there_when_asked_for(robot):
    """With limits=1 an engine must provide stops; without, the same motion goes through them."""
    path = robot("arm.urdf", urdf())
    assert load_scene(path, limits=1).requires - load_scene(path).requires == {"stops of joints"}
    with pytest.raises(Refused, match="stops of joints"):
        simulate(load_scene(path, limits=1), "pinocchio[formulation=null_space]", until=0.1)
    struck = truth(load_scene(path, limits=1, speed=3), np.linspace(0, 1, 3))
    assert [(event.kind, event.name) for event in events_of(struck)] == [("impact", "j2")]  # it leaves at once
    assert "ill_posed" not in struck.attrs


@pytest.mark.nightly
def test_commands_take_a_robot_file_for_a_scene(robot, tmp_path, monkeypatch):
    """Run, compare, report and stability start from the file alone; engines that are asked are held to the truth."""
    monkeypatch.setattr("proofroll.studies.comparison.default_comparison._UNTIL", 0.2)
    path = robot("arm.urdf", urdf(kinds=("revolute", "fixed", "fixed")))
    out = ["--out", str(tmp_path / "out"), "--json"]
    run = CliRunner().invoke(app, ["run", path, "--engine", "mujoco", "--until", "0.1", "--json"])
    assert run.exit_code == 0, run.output
    assert json.loads(run.stdout)["status"] == "done"
    compared = CliRunner().invoke(app, ["compare", path, "--engine", "mujoco", *out])
    assert compared.exit_code == 0, compared.output
    assert {row["verdict"] for row in json.loads(compared.stdout)["rows"]} == {"agrees"}
    reported = CliRunner().invoke(app, ["report", path, "--engine", "mujoco", *out])
    assert [len(case["bodies"]) for case in json.loads(reported.stdout)["replay"]] == [2], reported.output
    from proofroll.studies.stability.claims import file_for

    assert {"speed", "gravity", "horizon"} <= {axis.name for axis in file_for(path).axes}


def test_an_element_outside_ascii(robot):
    """A robot file whose elements have names outside ASCII is a scene as any other."""
    path = robot("arm.urdf", urdf(first='<größe wert="1"/>'))
    assert len(load_scene(path).elements[0].mechanism.joints) == 3


@pytest.mark.drill
def test_a_robot_of_the_gallery():
    """The whole ur5 of a package falls in Pinocchio as the truth says."""
    pytest.importorskip("heyoka")
    scene = load_scene(str(locate("ur5")))
    assert len(scene.elements[0].bodies) == 6
    times = np.array([0.0, 0.1])
    run = simulate(scene, "pinocchio", until=0.1, every=0.1)
    assert float(np.abs(run.positions - truth(scene, times).positions).max()) < 1e-9


@pytest.mark.nightly
def test_what_is_advised_is_followed_to_the_end(
    proofroll: Callable[..., tuple[int, str, str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Compare and report of a robot with dry friction end with friction=0, also where couplings=0 has no object."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "rough.urdf"
    path.write_text(urdf(second='<dynamics friction="2"/>', kinds=("fixed", "prismatic", "fixed")))
    given = (str(path), "--engine", "projection", "--set", "friction=0", "--set", "couplings=0")
    code, out, said = proofroll("compare", *given)
    assert code == 0, said
    assert "1 agrees" in out
    code, out, said = proofroll("report", *given)
    assert code == 0, said
    assert "--set friction=0 --set couplings=0" in (tmp_path / "out" / "report.json").read_text()
    code, _, said = proofroll("report", "--set", "friction=0")
    assert code == 2
    assert "studies have their own points" in " ".join(said.split())


def test_what_a_file_has_beyond_the_answer_is_said(robot):
    """Ranges, actuators, laws and couplings that a scene leaves out are named, each with what brings it in."""
    body = '<body gravcomp="1"><joint name="j" damping="1"/><geom size="0.1"/></body>'
    path = robot("arm.xml", f'<mujoco><worldbody>{body}</worldbody><actuator><motor joint="j"/></actuator></mujoco>')
    assert load_scene(path).omitted == ("1 actuator (actuators=1)", "contacts")
    compensated = "gravity compensation of 1 body (gravcomp=1)"
    assert load_scene(path, actuators=1, gravcomp=0).omitted == (compensated, "contacts")
    arm = robot("arm.urdf", urdf(first='<dynamics damping="0.3"/>'))
    assert load_scene(arm).omitted == ("2 joint ranges (limits=1)", "contacts")
    assert load_scene(arm, limits=1, damping=0).omitted == ("damping of joints (damping=1)", "contacts")
    drive = '<transmission name="t"><joint name="j1"/><actuator name="a"/></transmission>'
    spring = '<dynamics damping="0" springStiffness="5" springReference="0.0"/>'
    arm = robot("arm.urdf", urdf(first=spring, extra=drive))
    drives = "1 transmission (--control)"
    assert load_scene(arm, limits=1).omitted == (drives, "springStiffness of 1 joint", "contacts")


@pytest.mark.nightly
def test_commands_say_what_is_not_in_the_answer(robot):
    """Run and compare print a line on what the file has and the answer leaves out."""
    arm = robot("arm.urdf", urdf())
    for arguments in (
        ["run", arm, "--engine", "mujoco", "--until", "0.1"],
        ["compare", arm, "--engine", "mujoco", "--until", "0.1", "--budget", "20"],
    ):
        answered = CliRunner().invoke(app, arguments)
        assert answered.exit_code == 0, answered.output
        assert "Not in the answer: 2 joint ranges (limits=1), contacts." in answered.output


def test_rotors_of_transmissions_are_armatures(tmp_path: Path) -> None:
    """Drake's rotor inertia times its gear ratio squared is a joint's armature, or left out and said."""
    path = tmp_path / "arm.urdf"
    part = '<drake:{} xmlns:drake="http://drake.mit.edu" value="{}"/>'
    actuator = f'<actuator name="a">{part.format("rotor_inertia", "1e-4")}{part.format("gear_ratio", "160")}</actuator>'
    text = urdf(extra=f'<transmission name="t"><joint name="j1"/>{actuator}</transmission>')
    path.write_text(text)
    armatures = {joint.name: joint.armature for joint in load_scene(str(path)).elements[0].mechanism.joints}
    assert armatures == pytest.approx({"j1": 2.56, "j2": 0, "j3": 0}, rel=1e-15)
    assert "armature of joints (armature=1)" in load_scene(str(path), armature=0).omitted
    path.write_text(text.replace('"1e-4"', '"-1e-4"'))
    with pytest.raises(InputError, match=r"<drake:rotor_inertia value> = -0\.0001: it must be at least 0"):
        load_scene(str(path))


@pytest.mark.drill
def test_controls_of_a_keyframe(tmp_path: Path) -> None:
    """A file's keyframe gives controls; what is not taken of it is said, and a wrong number of them refused."""
    path = tmp_path / "arm.xml"
    key = '<keyframe><key/><key ctrl="{}"/></keyframe></mujoco>'
    text = mjcf(actuator='<position name="m" joint="k1" kp="20"/>').replace("</mujoco>", key)
    path.write_text(text.format("0.4"))
    assert "2 keyframes (keyframe=1)" in load_scene(str(path), actuators=1).omitted
    taken = load_scene(str(path), actuators=1, keyframe=2)
    assert taken.elements[0].mechanism.actuators[0].target == 0.4
    assert taken.omitted == ("contacts",)
    path.write_text(text.format("0.4 1"))
    with pytest.raises(InputError, match="this keyframe has 2 controls, and the file 1 actuator"):
        load_scene(str(path), actuators=1, keyframe=2)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("key", ['qpos="{}" qvel="{}"', 'qpos="{}"', ""], ids=["whole", "at rest", "home"])
def test_a_keyframe_is_a_start(tmp_path: Path, key: str) -> None:
    """A robot that starts in a keyframe has poses and velocities of MuJoCo's bodies there, whatever its joints are."""
    mujoco = pytest.importorskip("mujoco")
    random = np.random.default_rng(3)
    loose = '<body name="b" pos="1 2 3" euler="9 8 7"><freejoint name="f"/><geom size="0.1" pos="0.2 0 0"/>{}</body>'
    ball = '<body name="c" pos="0.4 0 0"><joint name="s" type="ball"/><geom size="0.1" pos="0.1 0.3 0"/></body>'
    text = mjcf(joint='ref="20" range="30 60"', extra=loose.format(ball))
    vectors = (" ".join(f"{value:.9g}" for value in random.normal(size=count)) for count in (13, 11))
    text = text.replace("</mujoco>", f"<keyframe><key {key.format(*vectors)}/></keyframe></mujoco>")
    path = tmp_path / "arm.xml"
    path.write_text(text)
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    for scene in (load_scene(str(path), keyframe=1, speed=0.3), _under_control(path, 'start = "1"')):
        sample = simulate(scene, "mujoco", until=2e-3, every=2e-3).isel(time=0)
        for body in ("upper", "lower", "b", "c"):
            velocity = np.zeros(6)
            mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, model.body(body).id, velocity, 0)
            at_body = sample.sel(body=body)
            assert at_body.p_WB.to_numpy() == pytest.approx(data.body(body).xpos, abs=1e-12)
            assert at_body.w_WB.to_numpy() == pytest.approx(velocity[:3], abs=1e-12)
            assert at_body.v_WB.to_numpy() == pytest.approx(velocity[3:], abs=1e-12)


@pytest.mark.drill
def test_compensated_bodies_move_as_in_mujoco(tmp_path: Path) -> None:
    """A force at the centre of mass of each body, also of one that is fixed to another, is MuJoCo's compensation."""
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "arm.xml"
    tool = '<body name="tool" gravcomp="0.3" pos="0 0 0.4"><geom type="box" size="0.1 0.02 0.03" pos="0.1 0 0"/></body>'
    path.write_text(
        '<mujoco><option gravity="1 -2 -9"/><worldbody><body name="upper" gravcomp="1"><joint axis="0 1 0"/>'
        '<geom type="capsule" fromto="0 0 0 0.1 0 0.3" size="0.05"/><body name="lower" pos="0.1 0 0.3" gravcomp="0.5">'
        f'<joint axis="1 0 0"/><geom type="capsule" fromto="0 0 0 0 0.2 0.3" size="0.03"/>{tool}</body></body>'
        "</worldbody></mujoco>"
    )
    scene = load_scene(str(path), seed=2)
    mechanism = scene.elements[0].mechanism
    solution = JointCoordinates(mechanism).solve(*mechanism.start())
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = ([getattr(joint, key)[0] for joint in mechanism.joints] for key in ("q0", "v0"))
    mujoco.mj_forward(model, data)
    assert solution.acceleration == pytest.approx(data.qacc, rel=1e-12)
    ends = [simulate(scene, engine, until=0.1, every=0.1)["p_WB"] for engine in ("mujoco", "exudyn", "pinocchio")]
    for end in ends[1:]:
        assert end.to_numpy() == pytest.approx(ends[0].to_numpy(), abs=1e-7)


def _under_control(robot: Path, text: str) -> Scene:
    """Scene of a robot under a controller whose file has this text."""
    control = robot.with_suffix(".toml")
    control.write_text(text)
    return load_scene(f"{robot}+{control}")


def test_a_wrong_keyframe_is_one_line(tmp_path: Path) -> None:
    """A keyframe that does not fit the joints, or that is not there, is told with what fits."""
    path = tmp_path / "arm.xml"
    path.write_text(mjcf().replace("</mujoco>", '<keyframe><key name="home" qpos="1 2 3"/></keyframe></mujoco>'))
    with pytest.raises(InputError, match="this keyframe has 3 numbers, and the joints of the file 2"):
        load_scene(str(path), keyframe=1)
    with pytest.raises(InputError, match=r"arm\.xml has no such keyframe; choose from 1, home"):
        _under_control(path, 'start = "hom"')


def test_a_random_start_lies_in_the_ranges_of_the_file(tmp_path: Path) -> None:
    """Joints whose range is far from 0, or closes a loop there, start inside it."""
    path = tmp_path / "arm.xml"
    second = '<joint name="k2" axis="1 0 0" range="20 40"/><joint name="far" type="slide" range="3 4"/>'
    text = mjcf(compiler='autolimits="true"', second=second, joint='range="25 50"')
    loop = '<equality><connect body1="lower" body2="world" anchor="0 0 0.1"/></equality></mujoco>'
    for content in (text, text.replace("</mujoco>", loop)):
        path.write_text(content)
        values = {name: row["value"] for name, row in RobotScenes.content(path)["parameters"].items()}
        tables = RobotScenes.tables(path, values | {"limits": 1})
        starts = {joint["name"]: (joint["limits"], joint["q0"][0]) for joint in tables["joints"]}
        assert all(ends[0] <= q <= ends[1] for ends, q in starts.values()), starts


@pytest.mark.drill
def test_a_record_of_a_robot_begins_where_its_first_row_says(arm: Path) -> None:
    """A file gives no start: the truth begins as the first row that has one, else at random, with a sentence on which.

    A later clock, or a rate that lacks, gives no start; a run of proofroll's keeps its own.
    """
    run = simulate(load_scene(str(arm), seed=3), until=0.2, every=0.02)
    names = [str(name) for name in run.data_vars if str(name)[:2] in {"q.", "v."}]
    record = {"time": run["time"].to_numpy()} | {name: run[name].to_numpy() for name in names}
    judged = judge(record, str(arm))
    assert judged.agrees
    assert judged.quiet == "the file gives no start: the truth begins as the first row"
    (rate, *_) = [name for name in names if name.startswith("v.")]
    for changed in ({**record, "time": record["time"] + 0.5}, {k: v for k, v in record.items() if k != rate}):
        at_random = judge(changed, str(arm))
        assert not at_random.agrees
        assert at_random.quiet.startswith("the file gives no start, so a random one was taken; of an open tree")
    assert not judge(run, load_scene(str(arm), seed=3)).quiet
