"""A robot file under a controller's file: one scene, in every command, with the file's own limits and servos."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from robot_templates import inertial, mjcf, urdf
from typer.testing import CliRunner

from proofroll import load_scene, simulate
from proofroll.cli import app, options
from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.policy import Observation
from proofroll.files.scene_sources import with_control
from proofroll.robots.probe import make
from proofroll.studies.comparison.default_comparison import default_comparison

CONTROL = """
rate = 50
pose = {j1 = 0.3, j3 = -0.4}
[[gains]]
joints = "*"
kp = 20
kd = 1
[[gains]]
joints = "j3"
kp = 8
kd = 0.4
limit = 2
armature = 0.02
"""
POLICY = """
[policy]
call = "policy_beside:make"
scale = 0.5
"""
START = """
[start]
base = [0, 0, 1, 0.9689124217106447, 0.24740395925452294, 0, 0]
base_velocity = [0.2, 0, 0, 0, 0, 1]
q = {j2 = 0.1}
v = {j3 = -0.5}
"""
MODULE = """
def make(joints):
    return lambda seen: [0.4 * seen.gravity_B[1] - 0.2 * q + 0.1 * w for q, w in zip(seen.q, seen.v)]
"""


@pytest.fixture
def written(tmp_path: Path) -> Any:
    """Writes a robot file, its controller and a policy beside it; returns their paths."""

    def write(control: str, robot: str = urdf(), ending: str = "urdf") -> tuple[str, str]:
        files = {f"arm.{ending}": robot, "walk.toml": control, "policy_beside.py": MODULE}
        for name, text in files.items():
            (tmp_path / name).write_text(text, encoding="utf-8")
        return str(tmp_path / f"arm.{ending}"), str(tmp_path / "walk.toml")

    return write


def _mechanism(files: tuple[str, str], **parameters: float) -> Mechanism:
    found: Mechanism = load_scene(with_control(files[0], Path(files[1])), **parameters).elements[0].mechanism  # type: ignore[attr-defined]
    return found


def test_a_controller_becomes_part_of_the_scene(written: Any) -> None:
    """Gains, pose, start and armature are the controller's; efforts without a limit have that of the robot file."""
    mechanism = _mechanism(written(CONTROL + POLICY + START))
    servos = {item.name: item for item in mechanism.actuators}
    assert {name: (item.kp, item.kd, item.limit) for name, item in servos.items()} == {
        "j1": (20, 1, 10),
        "j2": (20, 1, 10),
        "j3": (8, 0.4, 2),
    }
    joints = {joint.name: joint for joint in mechanism.joints}
    assert joints["j3"].armature == 0.02
    assert [joints[name].q0[0] for name in ("j1", "j2", "j3")] == [0.3, 0.1, -0.4]
    assert joints["j3"].v0 == (-0.5,)
    control = mechanism.control
    assert control is not None
    assert (control.rate, control.actuators, control.pose) == (50, ("j1", "j2", "j3"), (0.3, 0.0, -0.4))
    start = load_scene("+".join(written(CONTROL + POLICY + START))).elements[0].start  # type: ignore[attr-defined]
    assert start.p_WB[0, 0] == pytest.approx([0, 0, 1])
    assert start.v_WB[0, 0] == pytest.approx([0.2, 0, 0])
    # the spin is about the body's own axis, turned by 2 asin(0.2474) about x
    assert start.w_WB[0, 0] == pytest.approx([0, -0.479425538604203, 0.8775825618903728])


def test_patterns_mean_the_joints_that_a_file_drives(written: Any) -> None:
    """Where a URDF has transmissions, patterns mean their joints, and a joint that is named is driven, too."""
    ends = "".join(
        f'<transmission name="t{joint}"><joint name="{joint}"/><actuator name="m{joint}"/></transmission>'
        for joint in ("j1",)
    )
    mechanism = _mechanism(written(CONTROL, urdf(extra=ends)))
    assert [item.joint for item in mechanism.actuators] == ["j1", "j3"]


def test_parameters_repair_a_file_before_it_is_compared(written: Any) -> None:
    """What a parameter leaves out of a robot file is no reason to refuse the file with that parameter."""
    broken = urdf(tool=inertial(ixx="1e-6", iyy="1e-6", izz="1e-6", mass="0.1"))
    robot, control = written(CONTROL, broken)
    name = with_control(robot, Path(control))
    with pytest.raises(InputError, match="possible=0"):
        load_scene(name)
    assert default_comparison(name, {"possible": 0}, engines=["mujoco"]).vary == {"possible": [0]}


def test_a_robot_without_a_base_is_held_at_its_root(written: Any) -> None:
    """Without a start of its base a URDF is fixed to the world."""
    assert {joint.kind for joint in _mechanism(written(CONTROL)).joints} == {"revolute", "prismatic"}


@pytest.mark.nightly
def test_servos_of_an_mjcf_follow_the_controller(written: Any) -> None:
    """Joints without gains keep the servo of an MJCF, through its gear, with its limit."""
    actuator = '<position name="m" joint="k2" kp="20" kv="2" gear="3" forcerange="-4 4"/>'
    files = written("rate = 50\n[targets]\nk2 = '= sin(9*t)'\n", mjcf(actuator=actuator), "xml")
    mechanism = _mechanism(files)
    (servo,) = mechanism.actuators
    assert (servo.joint, servo.kp, servo.kd, servo.limit) == ("k2", 180, 18, 12)
    run = simulate(files[0], "mujoco", until=0.1, control=files[1])
    truth = simulate(files[0], until=0.1, control=Path(files[1]))
    assert float(np.abs(run["p_WB"].values - truth["p_WB"].values).max()) < 1e-5


@pytest.mark.parametrize(
    ("control", "says"),
    [
        (CONTROL + "[ground]\nfeet = {foot = 0.1}\n", "walk.toml: ground.feet = 'foot': the robot has no such link"),
        (CONTROL.replace("j1 = 0.3", "j9 = 0.3"), "walk.toml: pose = 'j9': the robot has no such joint"),
        (POLICY, "walk.toml: policy.call = 'policy_beside:make': it needs instants"),
        ("rate = 50" + POLICY, "walk.toml: policy.call = 'policy_beside:make': it has nothing to drive"),
        (CONTROL + POLICY.replace("beside", "missing"), "there is no module policy_missing beside the controller's"),
    ],
)  # fmt: skip
def test_a_controller_that_does_not_fit_is_one_line(written: Any, control: str, says: str) -> None:
    """What a controller cannot have is one line with its file."""
    with pytest.raises(InputError) as caught:
        _mechanism(written(control))
    assert says in str(caught.value)


def test_another_policy_is_another_scene(written: Any, tmp_path: Path) -> None:
    """A policy that changes is read anew, imports its neighbours, and stored results of the old one do not count."""
    robot, control = written(CONTROL + POLICY)
    name = with_control(robot, Path(control))
    before = load_scene(name)
    (tmp_path / "neighbour_of_policy.py").write_text("ACTION = 0.7\n", encoding="utf-8")
    text = "from neighbour_of_policy import ACTION\ndef make(joints):\n    return lambda seen: [ACTION] * len(joints)\n"
    (tmp_path / "policy_beside.py").write_text(text, encoding="utf-8")
    after = load_scene(name)
    assert before.digest != after.digest
    commands = after.elements[0].commands()  # type: ignore[attr-defined]
    start = after.elements[0].start  # type: ignore[attr-defined]
    assert commands.values(0.0, start).tolist() == pytest.approx([0.65, 0.35, -0.05])


@pytest.mark.drill
def test_a_package_announces_a_policy(written: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A policy that an installed package announces is called by its name, and acts as that of its module."""
    info = tmp_path / "site" / "striders-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: striders\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.policies]\nstrider = striders_of_test:make\n")
    (tmp_path / "site" / "striders_of_test.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path / "site"))
    by_name = written(CONTROL + POLICY.replace("policy_beside:make", "strider") + START)
    told = simulate(by_name[0], "mujoco", until=0.04, control=by_name[1])
    by_module = written(CONTROL + POLICY + START)
    assert np.array_equal(told["p_WB"], simulate(by_module[0], "mujoco", until=0.04, control=by_module[1])["p_WB"])
    unknown = written(CONTROL + POLICY.replace("policy_beside:make", "stroller"))
    with pytest.raises(InputError, match=r"give module:make, or one of .*strider"):
        _mechanism(unknown)


RANDOM = "import random\ndef make(joints):\n    return lambda seen: [random.random() for _ in joints]\n"
SHORT = "def make(joints):\n    return lambda seen: [0.0]\n"
NAN = "def make(joints):\n    return lambda seen: [float('nan')] * len(joints)\n"


@pytest.mark.parametrize(
    ("module", "says"),
    [
        (RANDOM, "two of them, newly made, answer one observation differently"),
        (SHORT, "its action has shape (1,); it drives 3 joints"),
        (NAN, "the policy's action is not finite at t = 0 s"),
        ("import no_such_package_of_anybody", "it failed (import): ModuleNotFoundError: No module named"),
        ("make = 3", "the module policy_beside has no callable 'make'"),
    ],
)
def test_a_policy_is_tried_before_any_engine(written: Any, tmp_path: Path, module: str, says: str) -> None:
    """A policy that cannot answer, or answers by chance, is refused in one line when the scene is read."""
    files = written(CONTROL + POLICY)
    (tmp_path / "policy_beside.py").write_text(module, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        _mechanism(files)
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_base_that_the_file_holds_has_no_start(written: Any) -> None:
    """The start of a base is refused where the file fixes the root to the world."""
    with pytest.raises(InputError, match=r"start\.base = .*: this robot's root is fixed in its file"):
        _mechanism(written("[start]\nbase = [0, 0, 1, 1, 0, 0, 0]\n", mjcf(), "xml"))


@pytest.mark.nightly
def test_each_command_takes_a_controller(written: Any, tmp_path: Path) -> None:
    """The commands run, replay and compare take --control, and a stored run remembers both files."""
    robot, control = written(CONTROL + POLICY + START)
    runner, out = CliRunner(), tmp_path / "run.nc"
    command = ["run", robot, "--control", control, "--engine", "mujoco", "--out", str(out), "--json"]
    result = runner.invoke(app, command)
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["scene"] == f"{robot}+{control}"
    assert load_scene(f"{robot}+{control}").name == "arm+walk"
    page = tmp_path / "replay.html"
    result = runner.invoke(app, ["replay", str(out), "--out", str(page)])
    assert result.exit_code == 0, result.output
    assert page.stat().st_size > 10_000
    result = runner.invoke(app, ["run", "pendulum", "--control", control, "--engine", "mujoco"])
    assert isinstance(result.exception, InputError)
    assert result.exception.field == "--control"


@pytest.mark.nightly
@pytest.mark.parametrize("rate", [50, 60])
def test_engines_agree_under_a_policy(rate: int, written: Any, tmp_path: Path) -> None:
    """A robot under a policy is compared in all engines, at a rate that no usual step divides, too."""
    robot, control = written((CONTROL + POLICY + START).replace("rate = 50", f"rate = {rate}"))
    command = ["compare", robot, "--control", control, "--out", str(tmp_path), "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    verdicts = [row["verdict"] for row in json.loads(result.stdout)["rows"]]
    assert len(verdicts) >= 4
    assert set(verdicts) == {"agrees"}


def test_the_probe_needs_every_part_of_an_observation() -> None:
    """The probe is the same at every call, and each part of an observation changes its action."""
    random = np.random.default_rng(0)
    parts: dict[str, Any] = {"q": 2, "v": 2, "v_WB_W": 3, "w_WB_B": 3, "gravity_B": 3, "last": 2}
    values = {name: random.normal(size=size) for name, size in parts.items()}
    seen = Observation(time=0.1, p_WB=np.zeros(3), R_WB=np.eye(3), **values)
    usual = make(["a", "b"])(seen)
    assert usual == pytest.approx(make(["a", "b"])(seen), abs=0)
    assert 0.05 < np.abs(usual).max() < 5
    for name, value in values.items():
        other = Observation(**{**vars(seen), name: -value})
        assert np.abs(make(["a", "b"])(other) - usual).max() > 1e-3, name


def test_degrees_in_a_controller_are_doubted(written: Any, capsys: pytest.CaptureFixture[str]) -> None:
    """A pose that is probably in degrees is one warning, and one in radians is none."""
    for pose, said in (("40.0", "joint j1: an angle of 40 rad is 6.4 turns"), ("0.4", "")):
        robot, control = written(f'pose = {{j1 = {pose}}}\n[[gains]]\njoints = "*"\nkp = 5\n')
        options.doubt_numbers(with_control(robot, Path(control)), None)
        assert said in capsys.readouterr().err


def test_a_ground_is_a_parameter_of_the_scene() -> None:
    """--ground sets the parameter, after what --set says, and needs a controller."""
    walk = Path("walk.toml")
    assert options.with_ground(["damping=0"], walk, "plane") == ["damping=0", "ground=2"]
    assert options.with_ground(None, walk, "none") == ["ground=0"]
    assert options.with_ground(None, None, None) is None
    with pytest.raises(InputError, match=r"--ground = 'file': a robot stands under a controller"):
        options.with_ground(None, None, "file")
