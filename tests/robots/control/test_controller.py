"""A controller's file: every key is read, and a wrong one is one line that names it."""

from pathlib import Path
from typing import Any

import pytest

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.robots.control.controller import GroundContact, read_controller

FULL = """
rate = 50
held = "target"
delay = 1
order = ["L_HIP", "R_HIP", "L_KNEE", "R_KNEE"]
pose = {L_HIP = "30 deg", R_KNEE = "= -pi/2"}
[[gains]]
joints = "*"
kp = 5
kd = 0.2
limit = 2.7
[[gains]]
joints = ["*_KNEE"]
kp = 8
kd = 0.5
armature = 5e-4
[policy]
call = "package.module:make"
scale = 0.25
[start]
base = [0, 0, 0.32, 1, 0, 0, 0]
base_velocity = [0, 0, 0, 0.1, 0, 0]
q = {L_HIP = 0.1}
v = {L_KNEE = 1}
[ground]
feet = {FOOT = 0.016}
friction = 0.8
"""
JOINTS = ["L_HIP", "L_KNEE", "R_HIP", "R_KNEE"]
KINDS = dict.fromkeys(JOINTS, "revolute") | {"(base)": "free"}


def _written(folder: Path, text: str) -> Path:
    path = folder / "control.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_whole_file_is_read(tmp_path: Path) -> None:
    """Every key of a controller's file arrives, in SI units, with the last fitting gains."""
    controller = read_controller(_written(tmp_path, FULL))
    controller.require_joints(JOINTS, KINDS)
    assert controller.period == 0.02
    assert controller.order == ("L_HIP", "R_HIP", "L_KNEE", "R_KNEE")
    assert controller.poses(JOINTS) == pytest.approx([0.5235987755982988, 0, 0, -1.5707963267948966], rel=1e-15)
    knee, hip = controller.servo("R_KNEE"), controller.servo("L_HIP")
    assert knee is not None
    assert hip is not None
    assert (knee.kp, knee.kd, knee.limit, knee.armature) == (8, 0.5, None, 5e-4)
    assert (hip.kp, hip.kd, hip.limit, hip.armature) == (5, 0.2, 2.7, None)
    assert controller.start.base_velocity == (0, 0, 0, 0.1, 0, 0)
    assert controller.ground == GroundContact({"FOOT": 0.016}, 0.8)


def test_targets_are_formulas_numbers_or_tables(tmp_path: Path) -> None:
    """A target is a number, a formula of t, a table, or a column of a CSV beside the file."""
    gains = "[[gains]]\njoints = '*'\nkp = 1\n"
    text = f"{gains}[targets]\nA = '= 0.7 + 0.3*sin(12*t)'\nB = '90 deg'\nC = {{times = [0, 1], values = [1, 2]}}\n"
    targets = read_controller(_written(tmp_path, text)).targets
    assert targets["A"] == Formula("0.7 + 0.3*sin(12*t)")
    assert targets["B"] == pytest.approx(1.5707963267948966)
    assert targets["C"] == Table((0.0, 1.0), (1.0, 2.0))
    (tmp_path / "walk.csv").write_text("time [s],A [rad],B [rad]\n0,1,2\n0.02,3,4\n", encoding="utf-8")
    targets = read_controller(_written(tmp_path, gains + "[targets]\ntable = 'walk.csv'\n")).targets
    assert targets == {"A": Table((0.0, 0.02), (1.0, 3.0)), "B": Table((0.0, 0.02), (2.0, 4.0))}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (("rate = 50", "rate = 0"), "rate = 0.0: give a positive number of instants per second"),
        (("rate = 50\n", ""), "delay = 1: it needs instants; give the rate in Hz"),
        (("rate = 50", "rte = 50"), "rte = 50: there is no such key here; the keys are rate, held,"),
        (('held = "target"', 'held = "both"'), "held = 'both': choose one of target, effort"),
        (("delay = 1", "delay = -1"), "delay = -1: a delay is a whole number"),
        (("delay = 1", "delay = 0.5"), "delay = 0.5: give a whole number"),
        (("L_HIP = ", "X_HIP = "), "pose = 'X_HIP': the robot has no such joint; choose from L_HIP"),
        (('"*"', '"*_ELBOW"'), "gains.0.joints = '*_ELBOW': no joint of the robot fits; it has L_HIP"),
        (("kp = 5", "kp = -5"), "gains.0.kp = -5.0: must be at least 0"),
        (("kp = 8", "kp = true"), "gains.1.kp = True: this is not a number; give one in N m/rad"),
        (("limit = 2.7", "limit = 0"), "gains.0.limit = 0.0: must be above 0"),
        (("kd = 0.5", "kq = 0.5"), "gains.1.kq = 0.5: there is no such key here; the keys are joints, kp, kd"),
        (('joints = "*"', ""), "gains.0.joints is missing: name the joints"),
        (("call =", "cal ="), "policy.cal = 'package.module:make': there is no such key here; the keys are call"),
        (("[policy]", "[targets]\nL_HIP = 1\n[policy]"), "targets = 'L_HIP': a policy sets all targets"),
        (("0.32, 1, 0, 0, 0", "0.32, 1, 1, 0, 0"), "a quaternion of length 1, scalar first"),
        (("base_velocity = [0, 0, 0, ", "base_velocity = ["), "start.base_velocity = (0.1, 0.0, 0.0): give six"),
        (("{FOOT = 0.016}", '"cubes"'), """ground.feet = 'cubes': give "file","""),
        (("{FOOT = 0.016}", "{}"), """ground.feet = {}: give "file","""),
        (("{FOOT = 0.016}", "{FOOT = -1}"), """ground.feet = {'FOOT': -1.0}: give "file","""),
        (("{FOOT = 0.016}", "{FOOT = nan}"), "ground.feet.FOOT = nan: give a finite number"),
        (("{FOOT = 0.016}", '{FOOT = "3 kg"}'), "ground.feet.FOOT = '3 kg': this number is in m"),
        (("{FOOT = 0.016}", "3"), "ground.feet = 3: give a table"),
        (("friction = 0.8", "friction = -1"), "ground.friction = -1.0: must be at least 0"),
        (("[start]", "[start]\ndrop = -0.01"), "start.drop = -0.01: must be at least 0"),
        ((', "R_KNEE"]', "]"), "order = ['L_HIP', 'R_HIP', 'L_KNEE']: it lacks R_KNEE"),
        ((', "R_KNEE"]', ', "L_HIP"]'), "order = ['L_HIP']: a joint is in the order twice"),
        (("[start]", "start = 3\n[x]"), "there is no such key"),
        (("q = {L_HIP = 0.1}", 'q = {"(base)" = 0.1}'), "start.q = '(base)': a free joint has no single coordinate"),
    ],
)  # fmt: skip
def test_a_wrong_field_is_one_line(tmp_path: Path, change: tuple[str, str], says: str) -> None:
    """A mistake in a controller's file is one line with the file, the field, its value and the remedy."""
    assert change[0] in FULL
    path = _written(tmp_path, FULL.replace(*change))

    def used() -> Any:
        controller = read_controller(path)
        try:
            controller.require_joints(JOINTS, KINDS)
        except InputError as error:
            raise error.of(str(path)) from None

    with pytest.raises(InputError) as caught:
        used()
    assert says in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_radius_has_a_unit(tmp_path: Path) -> None:
    """The radius of a foot may be a text with a unit."""
    text = FULL.replace("{FOOT = 0.016}", '{FOOT = "16 mm"}')
    ground = read_controller(_written(tmp_path, text)).ground
    assert ground is not None
    assert ground.feet == {"FOOT": pytest.approx(0.016)}
