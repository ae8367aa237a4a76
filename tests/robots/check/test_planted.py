"""Files in which one thing is planted that an engine treats otherwise: it is found, and named."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from robot_templates import inertial, mjcf, spherical, urdf
from scipy.spatial.transform import Rotation

from proofroll.core.plugins import parse_engine
from proofroll.robots.check.check import check
from proofroll.robots.check.importer_row import importer_row
from proofroll.robots.check.layers import RobotTruth
from proofroll.robots.check.records import ImporterRow
from proofroll.robots.check.two_files import reading_of
from proofroll.robots.files import reading
from proofroll.robots.files.meaning import CheckSettings
from proofroll.robots.files.mjcf.compiler import compiled_robot
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.urdf import BASE_JOINT, read_urdf
from proofroll.robots.model import Robot
from proofroll.robots.protocol import Request
from proofroll.robots.states import random_states
from proofroll.running.process import Worker

Workers = Callable[[str], Worker]
DAMPED, RUBBING = '<dynamics damping="0.7"/>', '<dynamics friction="0.4"/>'
BOTH = '<dynamics damping="0.7" friction="0.4"/>'
# Solvers of rows that MuJoCo's options name, and friction that a flag switches off.
ROWS = ("", 'solver="PGS" iterations="1"', 'cone="elliptic" tolerance="1"')
NO_FRICTION = '<option><flag frictionloss="disable"/></option>'
TENDON = """<tendon><fixed name="t" stiffness="900" damping="5" frictionloss="2" limited="true" range="9 10">
<joint joint="k1" coef="1"/><joint joint="k2" coef="-2"/></fixed></tendon><actuator>"""
FOLLOWS = '<mimic joint="j1" multiplier="0.5" offset="0.1"/>'
FOLLOWING = urdf(
    kinds=("revolute", "prismatic", "revolute"), third=FOLLOWS + '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
)
BOX = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
TURNED = inertial(rpy="0.3 0.2 1.1")
FLAT = inertial(ixx="0.01", iyy="0.01", izz="0.9")
TINY = (
    inertial(mass="1e-9", ixx="1e-12", iyy="1e-12", izz="1e-12", ixy="0").replace("0.002", "0").replace("-0.001", "0")
)
TWO = '<joint name="k2" axis="1 0 0" pos="0.02 0 0.1"/><joint name="k3" axis="0 1 0" pos="0 0.05 0"/>'
LEAF = '<body name="leaf" pos="0.5 0 0"><joint name="k9" axis="1 0 0"/><geom type="sphere" size="0.1"/></body>'
FRAMED = ("pinocchio", {"frames_ignored"})
OTHER = '<body name="other" pos="1 0 0"><joint name="far" type="slide" axis="0 0 1"/><geom size="0.1"/></body>'
LOOSE = '<body name="loose"><freejoint/><geom size="0.1 0.2 0.3" type="box"/></body>'
FLYING = """<mujoco model="f"><worldbody><body name="b" pos="0.2 0.3 1" euler="90 20 0"><freejoint name="f"/>
<geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 0.3"/></body></worldbody></mujoco>"""
FLOOR = '<worldbody><geom type="plane" size="0 0 0.05"/></worldbody><actuator>'
POINTED = """<robot name="r"><link name="a"/><link name="b">
<inertial><mass value="1"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""
FREE = '<joint name="free" type="free" damping="0.5"/>'
WORLD_ROOT = urdf().replace(
    "</robot>",
    '<link name="world"/><joint name="to" type="fixed"><parent link="world"/><child link="base"/>'
    '<origin xyz="0 0 0.3" rpy="0.4 0 0"/></joint></robot>',
)
HIDDEN = 'contype="0" conaffinity="0"'
_OWN = '<inertial pos="0.1 0.02 0" mass="1.5" {}/>'
_SLIM = 'diaginertia="0.01 0.02 0.021"'


def held_by(body: str, *, root: str = "", outside: str = "", inertial: str = _OWN.format(_SLIM)) -> str:
    """An MJCF with one hinge, whose body also has what is given; attributes of the body around it, other sections."""
    return f"""<mujoco model="m">{outside}<worldbody><body name="base" {root}><body name="a" pos="0 0 1">
    <joint name="h" axis="0 1 0" class="k"/>{body}{inertial}</body></body></worldbody></mujoco>"""


CLASS_K = '<default><default class="k"><joint {}/><geom {}/></default></default>'
PLAIN_CLASS = CLASS_K.format("", "")
CORNER = '<asset><mesh name="t" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/></asset>'
MESHED = '<geom type="mesh" mesh="t" mass="0.1" pos="0.1 0.2 0.3" euler="10 20 30"/>'
RODS = '<geom class="k" type="capsule" size="0.05 0.2"/><geom type="box" size="0.1 0.2 0.3" pos="0 0.1 0" mass="2"/>'
GROUPS = '<geom type="box" size=".1 .2 .3"/><geom type="box" size=".1 .2 .1" pos=".3 0 0" group="3"/>'
HAND = f'<body name="b" pos="0.3 0 0" euler="20 30 40"><joint name="k2" axis="0 0.6 0.8"/>{_OWN.format(_SLIM)}</body>'
LONG = HAND.replace('euler="20 30 40"', 'axisangle="1 1 0 40"')
LIMB = 'type="box" size="0.1 0.2 0.3" pos="0 0.1 0"'
BALL = 'type="sphere" size="0.05"'
BOUNDED = held_by(f"{{}}{HAND}", outside='<compiler boundmass="0.01" boundinertia="1e-4"/>' + PLAIN_CLASS, inertial="")
ARMED = """<mujoco model="m"><worldbody><body name="a" pos="0 0 1"><joint name="f" type="free" armature="0.1"/>
<geom type="box" size="0.1 0.2 0.3" pos="0.1 0.2 0.3"/><body name="b" pos="0.4 0 0">
<joint name="k" axis="0 1 0"/><geom type="box" size="0.1 0.2 0.1"/></body></body></worldbody></mujoco>"""

BALLS = held_by(HAND, outside=PLAIN_CLASS).replace('axis="0 1 0"', 'type="ball" pos="0.1 0 0.2" damping="0.3"')
BALLS = BALLS.replace('axis="0 0.6 0.8"', 'type="ball"')
BALLS_URDF = urdf(kinds=("spherical", "prismatic", "spherical"), first=DAMPED).replace("-1.5", "0")

# What a file holds, the engine that reads it, and the causes that must be named.
REAL: list[tuple[str, str, str, set[str]]] = [
    *[(f"plain arm in {name}", urdf(), name, set()) for name in ("mujoco", "pinocchio", "exudyn")],
    *[(f"plain MJCF in {name}", mjcf(), name, set()) for name in ("mujoco", "pinocchio", "exudyn")],
    ("tool with inertia", urdf(tool=inertial(mass="0.7")), "mujoco", set()),
    ("inertial turned", urdf(tip=TURNED), "mujoco", set()),
    ("inertial turned", urdf(tip=TURNED), "pinocchio", set()),
    ("axis not unit", urdf().replace('xyz="0 0.6 0.8"', 'xyz="0 3 4"'), "mujoco", set()),
    ("axis not unit", urdf().replace('xyz="0 0.6 0.8"', 'xyz="0 3 4"'), "pinocchio", set()),
    ("damping", urdf(first=DAMPED), "pinocchio", {"damping_left_out"}),
    ("damping", urdf(first=DAMPED), "mujoco", set()),
    ("damping", urdf(first=DAMPED), "exudyn", set()),
    ("friction", urdf(second=RUBBING), "pinocchio", {"friction_left_out"}),
    ("friction", urdf(second=RUBBING), "mujoco", set()),
    ("friction", urdf(second=RUBBING), "exudyn", {"friction_left_out"}),
    *[("friction", mjcf(joint='frictionloss="3"', option=rows), "mujoco", set()) for rows in ROWS],
    ("friction switched off", mjcf(joint='frictionloss="3"').replace("<option />", NO_FRICTION), "mujoco", set()),
    ("friction of a tied joint", FOLLOWING.replace("</joint>", RUBBING + "</joint>"), "mujoco", set()),
    ("friction beside a tendon", mjcf(joint='frictionloss="3"').replace("<actuator>", TENDON), "mujoco", set()),
    ("damping and friction", urdf(third=BOTH), "pinocchio", {"damping_left_out", "friction_left_out"}),
    ("mimic", FOLLOWING, "pinocchio", {"mimic_ignored"}),
    ("mimic", FOLLOWING, "mujoco", set()),
    ("mimic, reduced", FOLLOWING, "pinocchio[mimic=true]", set()),
    ("shape without inertial", urdf(tool=BOX), "mujoco", {"shapes_weighed"}),
    ("shape without inertial", urdf(tool=BOX), "pinocchio", set()),
    ("impossible inertia", urdf(tip=FLAT), "mujoco[balanceinertia=true]", {"inertia_balanced"}),
    ("impossible inertia", urdf(tip=FLAT), "pinocchio", set()),
    ("tiny tip", urdf(tip=TINY), "mujoco[boundmass=true]", {"mass_bounded"}),
    ("armature", mjcf(joint='armature="0.2"'), "exudyn", {"armature_left_out"}),
    ("armature", mjcf(joint='armature="0.2"'), "pinocchio", set()),
    ("spring", mjcf(joint='stiffness="3" springref="20"'), "pinocchio", {"springs_left_out"}),
    ("spring", mjcf(joint='stiffness="3" springref="20"'), "mujoco", set()),
    ("total mass", mjcf(compiler='settotalmass="7"'), "pinocchio", {"total_mass_ignored"}),
    ("gravity", mjcf(option='gravity="0 1 -3"'), "pinocchio", {"default_gravity"}),
    ("two trees", mjcf(extra=OTHER), "pinocchio", {"first_tree_only"}),
    ("a frame", mjcf().replace("</body></body>", f"<frame euler='0 0 30'>{LEAF}</frame></body></body>"), *FRAMED),
    ("two worlds", mjcf().replace("<actuator>", FLOOR), "pinocchio", {"tree_read_again"}),
    (
        "two worlds",
        mjcf(second=TWO).replace("<actuator>", FLOOR.replace("<actuator>", FLOOR)),
        "pinocchio",
        {"tree_read_again"},
    ),
    (
        "two worlds",
        FLYING.replace("</mujoco>", f"{FLOOR}</actuator></mujoco>").replace("90 20 0", "0 0 0"),
        "pinocchio",
        {"tree_read_again"},
    ),
    *[
        ("two worlds, geared", text.replace("<actuator>", FLOOR), "pinocchio", {"tree_read_again"})
        for text in (mjcf(joint='armature="0.2"'), mjcf(second=TWO.replace("<joint", '<joint armature="0.2"')))
    ],
    ("two worlds", mjcf().replace("<actuator>", FLOOR), "mujoco", set()),
    ("two worlds", mjcf().replace("<actuator>", FLOOR), "exudyn", set()),
    ("hidden shape", mjcf(shape=HIDDEN), "pinocchio", {"noncolliding_shapes_weightless"}),
    (
        "shapes that hit something and weigh nothing",
        held_by(f'<geom {HIDDEN} {BALL}/><geom {BALL} density="0"/>{HAND}', outside=PLAIN_CLASS, inertial=""),
        "pinocchio",
        {"noncolliding_shapes_weightless"},
    ),
    ("bounds", BOUNDED.format(""), "pinocchio", {"bounds_ignored"}),
    ("bounds", BOUNDED.format(f'<geom {BALL} mass="0.001"/>'), "pinocchio", {"bounds_ignored"}),
    ("bounds", BOUNDED.format('<inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/>'), "pinocchio", set()),
    (
        "posed base",
        held_by("", outside=PLAIN_CLASS, root='pos="0 0 .3" quat="1 0 1 0"'),
        "pinocchio",
        {"root_pose_dropped"},
    ),
    (
        "mass of a class",
        held_by(RODS, outside=CLASS_K.format("", 'mass="1"'), inertial=""),
        "pinocchio",
        {"class_mass_ignored"},
    ),
    ("density of a class", held_by(RODS, outside=CLASS_K.format("", 'density="500"'), inertial=""), "pinocchio", set()),
    ("pose of a class", held_by("", outside=CLASS_K.format('pos="0 0 .1"', "")), "pinocchio", {"class_pose_ignored"}),
    (
        "shape's pose of a class",
        held_by(RODS, outside=CLASS_K.format("", 'pos="0 0 .1"'), inertial=""),
        "pinocchio",
        {"class_pose_ignored"},
    ),
    ("mesh", held_by(MESHED, outside=PLAIN_CLASS + CORNER, inertial=""), "pinocchio", {"meshes_weigh_one_kilogram"}),
    (
        "mesh beside a shape of a class",
        held_by(MESHED + RODS, outside=CLASS_K.format("", 'mass="1"') + CORNER, inertial=""),
        "pinocchio",
        {"meshes_weigh_one_kilogram", "class_mass_ignored"},
    ),
    (
        "mesh beside one that hits nothing",
        held_by(MESHED + MESHED.replace("<geom", f"<geom {HIDDEN}"), outside=PLAIN_CLASS + CORNER, inertial=""),
        "pinocchio",
        {"meshes_weigh_one_kilogram", "noncolliding_shapes_weightless"},
    ),
    (
        "mesh of a class",
        held_by('<geom class="k" mesh="t"/>', outside=CLASS_K.format("", 'type="mesh" mass="2"') + CORNER, inertial=""),
        "pinocchio",
        {"meshes_weigh_one_kilogram"},
    ),
    ("mesh", held_by(MESHED, outside=PLAIN_CLASS + CORNER), "pinocchio", set()),
    (
        "capitals",
        held_by(HAND, outside='<compiler eulerseq="XYZ"/>' + PLAIN_CLASS),
        "pinocchio",
        {"euler_sequence_in_small_letters"},
    ),
    ("small letters", held_by(HAND, outside='<compiler eulerseq="zyx"/>' + PLAIN_CLASS), "pinocchio", set()),
    (
        "groups",
        held_by(GROUPS, outside='<compiler inertiagrouprange="0 2"/>' + PLAIN_CLASS, inertial=""),
        "pinocchio",
        {"inertia_groups_ignored"},
    ),
    (
        "balanced",
        held_by(
            "",
            outside='<compiler balanceinertia="true"/>' + PLAIN_CLASS,
            inertial=_OWN.format('euler="10 20 30" diaginertia="0.01 0.02 0.041"'),
        ),
        "pinocchio",
        {"balance_ignored"},
    ),
    (
        "long axis",
        held_by("", outside=PLAIN_CLASS, inertial=_OWN.format('axisangle="1 1 0 40" ' + _SLIM)),
        "pinocchio",
        {"axisangle_not_normalised"},
    ),
    *[
        ("long axis of a pose", text, "pinocchio", {"axisangle_not_normalised", *more})
        for text, more in (
            (held_by(LONG, outside=PLAIN_CLASS), ()),
            (held_by(LONG, outside=PLAIN_CLASS + '<option gravity="0 1 -3"/>'), ["default_gravity"]),
            (held_by(LONG.replace('<joint name="k2" axis="0 0.6 0.8"/>', ""), outside=PLAIN_CLASS), ()),
            (held_by(f'<geom axisangle="0 2 1 30" {LIMB}/>', outside=PLAIN_CLASS, inertial=""), ()),
            (
                held_by(
                    f'<geom class="k" {LIMB}/>', outside=CLASS_K.format('damping="0.7"', 'mass="1"') + "", inertial=LONG
                ),
                ["class_mass_ignored", "damping_left_out"],
            ),
        )
    ],
    ("armature of a free joint", ARMED, "pinocchio", {"armature_of_free_joints_turns"}),
    ("armature of a free joint", ARMED, "mujoco", set()),
    (
        "base, class and letters",
        held_by(
            HAND,
            outside='<compiler eulerseq="XYZ"/>' + CLASS_K.format('pos="0 0 .1"', ""),
            root='pos="0 0 .3" euler="10 20 30"',
        ),
        "pinocchio",
        {"root_pose_dropped", "class_pose_ignored", "euler_sequence_in_small_letters"},
    ),
    *[("ball joints", text, name, set()) for text in (BALLS, BALLS_URDF) for name in ("mujoco", "exudyn")],
    ("two joints", mjcf(second=TWO), "pinocchio", set()),
    ("two joints", mjcf(second=TWO), "mujoco", set()),
    ("free body", mjcf(extra=LOOSE), "mujoco", set()),
    ("no moment about its axis", POINTED, "exudyn", set()),
    ("damped free body", mjcf(extra=LOOSE.replace("<freejoint/>", FREE)), "exudyn", set()),
    ("damped free body", mjcf(extra=LOOSE.replace("<freejoint/>", FREE)), "mujoco", set()),
    *[("huge damping", mjcf(joint='damping="1e11"'), name, set()) for name in ("mujoco", "exudyn")],
    ("root called world", urdf().replace('"base"', '"world"'), "mujoco", set()),
    ("fixed to world", WORLD_ROOT, "mujoco", set()),
    ("turned free body", FLYING, "mujoco", set()),
    ("turned free body", FLYING, "pinocchio", {"free_body_offset"}),
    ("free body", FLYING.replace("90 20 0", "0 0 0"), "pinocchio", set()),
]


def _examined(path: Path, base: str) -> tuple[RobotFile, Robot | None]:
    file = open_robot(path, base)
    return file, read_urdf(file) if file.kind == "urdf" else None


def _request(written: Path, file: RobotFile, truth: RobotTruth, options: dict[str, bool]) -> Request:
    robot = truth.robot
    children = {joint.name: joint.child for joint in robot.moving}
    what = (written, file.kind, file.base, BASE_JOINT, options, children)
    return Request(*what, truth.states, truth.torques, robot.gravity, robot)


# A URDF says nothing about its base: both are tried, in turns.
CASES = [
    pytest.param(text, engine, expected, base, id=f"{what}-{engine}-{base}")
    for place, (what, text, engine, expected) in enumerate(REAL)
    for base in [("fixed", "free")[place % 2] if text.startswith("<robot") else "fixed"]
]


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize(("text", "engine", "expected", "base"), CASES)
def test_real_engines(
    text: str, engine: str, expected: set[str], base: str, robot_workers: Workers, tmp_path: Path
) -> None:
    """An installed engine's own importer holds the file, or every difference is named with a proof."""
    kind = "urdf" if text.startswith("<robot") else "mjcf"
    spec = parse_engine(engine)
    pytest.importorskip(spec.name)
    path = tmp_path / f"robot.{'urdf' if kind == 'urdf' else 'xml'}"
    path.write_text(text)
    file, robot = _examined(path, base)
    place = tmp_path / "given"
    place.mkdir()
    written = reading.write(file, place)
    if robot is None:
        robot, _ = compiled_robot(robot_workers("mujoco"), file, written, 60)
    truth = RobotTruth.of(robot, random_states(robot, 5, 1))
    request = _request(written, file, truth, reading.options_of(spec.options, spec.name))

    def ask(path: Path) -> reading.ReaderAnswer:
        asked = dataclasses.replace(request, path=path)
        return reading.ask(robot_workers(spec.name), spec.name, asked, place, 60)

    row = importer_row(file, truth, 1e-14, spec, ask(written), ask=ask)
    assert row.message is None
    assert row.unexplained is None, row.layers
    assert {cause.id for cause in row.causes} == expected
    assert row.status == ("explained" if expected else "holds")
    for cause in row.causes:
        assert cause.after < cause.before


@pytest.mark.drill
def test_round_off_of_what_cancels_is_no_difference(tmp_path: Path) -> None:
    """Moments of a round body without mass that turns cancel in the file's reading; what is left accuses no engine."""
    pytest.importorskip("pinocchio")
    path = tmp_path / "ball.urdf"
    link = '<inertial><mass value="0"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>'
    path.write_text(f'<robot name="r"><link name="a">{link}</link></robot>')
    (row,) = check(path, ["pinocchio"], CheckSettings(base="free")).engines
    assert row.status == "holds", row.layers


def test_round_off_of_gravity_is_no_bar(tmp_path: Path) -> None:
    """A wheel on whose axis gravity has no torque leaves the bar of the truth at round-off, and defects are seen."""
    pytest.importorskip("pinocchio")
    path = tmp_path / "wheel.urdf"
    turned = 'rpy="0.3 0.2 1.1"'
    wheel = spherical("1.3", "0.04", com="0.1332 0.1776 0.296")
    joint = '<parent link="base"/><child link="wheel"/><axis xyz="0.36 0.48 0.8"/><dynamics damping="0.2"/>'
    path.write_text(
        f'<robot name="r"><link name="base"/><link name="wheel">{wheel}</link>'
        f'<joint name="j" type="continuous"><origin xyz="1 2 3" {turned}/>{joint}</joint></robot>'
    )
    content = check(path, ["pinocchio"])
    assert content.truth.difference < 1e-12
    assert [cause.id for cause in content.engines[0].causes] == ["damping_left_out"]


def _defect(pattern: str, instead: str) -> Callable[[str], str]:
    """A change of the text of a file."""

    def change(text: str) -> str:
        changed = re.sub(pattern, instead, text, flags=re.DOTALL)
        assert changed != text
        return changed

    return change


_ZERO = _defect(re.escape(FLAT), re.sub(r'(ixx|iyy|izz|ixy|ixz|iyz)="[^"]*"', r'\1="0"', FLAT))
_RADIUS = (3 * 1.3 / 4000 / np.pi) ** (1 / 3)
_WATER = 0.4 * 1.3 * _RADIUS**2
_SPHERE = re.sub(r'(ixy|ixz|iyz)="[^"]*"', r'\1="0"', re.sub(r'(ixx|iyy|izz)="[^"]*"', rf'\1="{_WATER!r}"', FLAT))
_ONE = spherical(mass="1", moment="1", com="0 0 0")
_EMPTY = '<link name="tool"></link>'

_UNSKEWED = ('ixz="0.002" iyz="-0.001"', 'ixz="0" iyz="0"')
# Moments in descending order: the axes of the link are MuJoCo's principal ones, so only the place is wrong.
SORTED = inertial(ixx="0.05", iyy="0.04", izz="0.03", ixy="0").replace(*_UNSKEWED)
_WELD = Rotation.from_euler("xyz", [0.5, 0.4, 0.1])
_COM = np.array([0.1, 0.02, -0.05])
_MISPLACED = " ".join(f"{part:.17g}" for part in _WELD.inv().apply(_COM))


def _boxed(text: str) -> str:
    """Every inertia is that of a box: of the collision box with margins, or of margins alone."""

    def change(link: re.Match[str]) -> str:
        mass = float(re.findall('mass value="([^"]*)"', link[0])[0])
        size = re.findall('box size="([^"]*)"', link[0])
        x, y, z = np.array([float(part) for part in size[0].split()] if size else [0.0, 0.0, 0.0]) + 2e-3
        moments = mass / 12 * np.array([y * y + z * z, x * x + z * z, x * x + y * y])
        new = " ".join(f'i{axis}{axis}="{value!r}"' for axis, value in zip("xyz", moments.tolist(), strict=True))
        return re.sub("<inertia .*?/>", f'<inertia {new} ixy="0" ixz="0" iyz="0"/>', link[0], flags=re.DOTALL)

    return re.sub(r"<link name=\S*><inertial.*?</link>", change, text, flags=re.DOTALL)


# What an engine that is not installed here does, as a change of the file: planted in our own second formulation.
SIMULATED: list[tuple[str, str, Callable[[str], str], set[str]]] = [
    (
        "merged link misplaced",
        urdf(tool=SORTED),
        _defect('(<link name="tool">.*?)0.1 0.02 -0.05', rf"\g<1>{_MISPLACED}"),
        {"merged_inertial_misplaced"},
    ),
    ("inertia of boxes", urdf(tip=inertial() + BOX), _boxed, {"inertia_from_collision"}),
    (
        "merged at origins",
        urdf(tip=SORTED, tool=spherical(mass="0.4", moment="0.02")),
        _defect(
            '(<link name="tip">.*?)0.1 0.02 -0.05(.*?<link name="tool">.*?)0.1 0.02 -0.05', r"\g<1>0 0 0\g<2>0 0 0"
        ),
        {"merged_at_link_origins"},
    ),
    ("unit mass", urdf(), _defect(_EMPTY, f'<link name="tool">{_ONE}</link>'), {"unit_mass_without_inertial"}),
    ("rpy ignored", urdf(tip=TURNED), _defect("0.3 0.2 1.1", "0 0 0"), {"inertial_rotation_ignored"}),
    ("water sphere", urdf(tip=FLAT), _defect(re.escape(FLAT), _SPHERE), {"water_sphere"}),
    ("zeroed", urdf(tip=FLAT), _ZERO, {"impossible_inertia_zeroed"}),
    (
        "two causes",
        urdf(tip=FLAT, first=DAMPED),
        lambda text: _ZERO(text).replace(DAMPED, ""),
        {"impossible_inertia_zeroed", "damping_left_out"},
    ),
    ("nothing", urdf(third=BOTH, tip=FLAT), lambda text: text, set()),
]
# What no hypothesis knows must be found, and not be named.
UNKNOWN: list[tuple[str, Callable[[str], str], str]] = [
    ("mass", _defect('mass value="2.1"', 'mass value="2.10001"'), "mass"),
    ("centre of mass", _defect("0 0.1 0.03", "0 0.1 0.03001"), "bodies"),
    ("inertia", _defect('izz="0.05"', 'izz="0.0500001"'), "bodies"),
    ("joint's place", _defect("0 0.2 0.3", "0 0.2 0.3000001"), "kinematics"),
    ("axis", _defect("0 -0.8 0.6", "0 -0.6 0.8"), "kinematics"),
    ("damping", _defect('damping="0.7"', 'damping="0.71"'), "forward dynamics"),
]


def _row(text: str, change: Callable[[str], str], base: str, folder: Path) -> ImporterRow:
    files = []
    for name, content in (("true", text), ("held", change(text))):
        path = folder / f"{name}.urdf"
        path.write_text(content)
        files.append(open_robot(path, base))
    robot, held = (read_urdf(file) for file in files)
    truth = RobotTruth.of(robot, random_states(robot, 5, 1))
    answer = reading.ReaderAnswer("1", "", {}, reading_of(held, truth), "")
    return importer_row(files[0], truth, 1e-14, parse_engine("planted"), answer)


@pytest.mark.parametrize("base", ["fixed", "free"])
@pytest.mark.parametrize(
    ("text", "change", "expected"), [row[1:] for row in SIMULATED], ids=[row[0] for row in SIMULATED]
)
def test_planted_causes(text: str, change: Callable[[str], str], expected: set[str], base: str, tmp_path: Path) -> None:
    """A known cause that is planted is named, whatever the engine is called, and nothing else is."""
    row = _row(text, change, base, tmp_path)
    assert {cause.id for cause in row.causes} == expected
    assert row.unexplained is None
    assert row.status == ("explained" if expected else "holds")


@pytest.mark.parametrize(("change", "layer"), [row[1:] for row in UNKNOWN], ids=[row[0] for row in UNKNOWN])
def test_unknown_causes(change: Callable[[str], str], layer: str, tmp_path: Path) -> None:
    """A difference that no hypothesis knows is found at its layer and called unexplained."""
    row = _row(urdf(tip=FLAT, first=BOTH, third=DAMPED), change, "fixed", tmp_path)
    assert row.status == "differs"
    assert row.unexplained == layer
    assert row.causes == ()


LOADED = '<joint name="k2" axis="1 0 0" pos="0.02 0 0.1" armature="0.3"/>'
_MIDDLE = '<body name="middle"><inertial pos="0 0 0" mass="1e-13" diaginertia="1e-14 1e-14 1e-14"/>'
_FIRST, _SECOND = re.findall("<joint .*?/>", TWO)
_LOWER = '<body name="lower" pos="0.1 0.2 0.4" euler="-20 5 40">'
_CLASSES = '<default><joint damping="2"/><default class="bare"/></default>'
IN_MJCF: list[tuple[str, str, str, str, str]] = [
    (
        "defaults_not_inherited",
        mjcf(joint='class="bare"').replace("<worldbody>", _CLASSES + "<worldbody>"),
        'class="bare"/></default>',
        'class="bare"><joint damping="0"/></default></default>',
        "",
    ),
    (
        "armature_of_actuated_joints_only",
        mjcf(joint='armature="0.2"', second=LOADED, actuator='<motor joint="k1"/>'),
        ' armature="0.3"',
        "",
        "",
    ),
    (
        "body_placed_by_last_joint",
        mjcf(second=TWO),
        _LOWER + TWO,
        _MIDDLE + _FIRST + _LOWER + _SECOND,
        "</body>",
    ),
]


@pytest.mark.parametrize(("cause", "text", "old", "new", "closing"), IN_MJCF, ids=[row[0] for row in IN_MJCF])
def test_planted_causes_in_mjcf(
    cause: str, text: str, old: str, new: str, closing: str, robot_workers: Workers, tmp_path: Path
) -> None:
    """A known cause that is planted in an MJCF is named, and nothing else is."""
    pytest.importorskip("mujoco")
    assert old in text
    changed = text.replace(old, new).replace("</body></body>", f"</body>{closing}</body>", 1)
    files, robots = [], []
    for name, content in (("true", text), ("held", changed)):
        path = tmp_path / f"{name}.xml"
        path.write_text(content)
        files.append(open_robot(path))
        (tmp_path / f"{name}-given").mkdir()
        written = reading.write(files[-1], tmp_path / f"{name}-given")
        robots.append(compiled_robot(robot_workers("mujoco"), files[-1], written, 60)[0])
    truth = RobotTruth.of(robots[0], random_states(robots[0], 5, 1))
    answer = reading.ReaderAnswer("1", "", {}, reading_of(robots[1], truth), "")
    row = importer_row(files[0], truth, 1e-14, parse_engine("planted"), answer)
    assert [found.id for found in row.causes] == [cause]
    assert row.status == "explained"


def test_free_base_that_was_fixed(tmp_path: Path) -> None:
    """An engine that fixes a free base without mass is found out by its missing joint."""
    path = tmp_path / "robot.urdf"
    path.write_text(urdf().replace(inertial(mass="4"), ""))
    free, fixed = open_robot(path, "free"), open_robot(path, "fixed")
    robot, held = read_urdf(free), read_urdf(fixed)
    truth = RobotTruth.of(robot, random_states(robot, 5, 1))
    answer = reading.ReaderAnswer("1", "", {}, dataclasses.replace(reading_of(held, truth)), "")
    row = importer_row(free, truth, 1e-14, parse_engine("planted"), answer)
    assert [cause.id for cause in row.causes] == ["free_base_is_fixed"]
    assert row.status == "explained"
