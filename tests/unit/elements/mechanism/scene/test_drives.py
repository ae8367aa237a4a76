"""Actuators, couplings and what changes in time, as scene files give them."""

from pathlib import Path

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import InputError, Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.capabilities import MechanismCapability, required
from proofroll.elements.mechanism.scene.drives import Actuator, ActuatorKind
from proofroll.elements.mechanism.scene.signal import Formula, Held, Signal, Table, value_at
from proofroll.files.scene_file import load_scene
from proofroll.truth.truth_of_mechanism import truth_of

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
PLAIN = """
title = "t"
source = "s"
[parameters.size]
value = 0.3
unit = "m"
meaning = "amplitude"
source = "s"
[gravity]
magnitude = 0
[[bodies]]
name = "b"
mass = 1
inertia = [1, 1, 1]
[[bodies]]
name = "c"
mass = 1
inertia = [1, 1, 1]
[[joints]]
name = "j"
kind = "prismatic"
parent = "world"
child = "b"
[[joints]]
name = "k"
kind = "revolute"
parent = "b"
child = "c"
"""


def mechanism(tmp_path: Path, more: str) -> Mechanism:
    """The mechanism of a scene with two joints and this besides."""
    (tmp_path / "scene.toml").write_text(PLAIN + more)
    return mechanism_named(str(tmp_path))  # type: ignore[attr-defined,no-any-return]


def slider(**more: object) -> Mechanism:
    """A mass on a slide, with one actuator."""
    return Mechanism(
        (Body("b", 1.0, inertia=ONES),),
        (Joint("j", "prismatic", "world", "b", q0=(0.2,), v0=(0.5,)),),
        actuators=(Actuator("a", "j", **more),),  # type: ignore[arg-type]
        gravity=(0, 0, 0),
    )


def test_targets_are_numbers_formulas_and_tables(tmp_path: Path) -> None:
    """A target is a number, a formula of t with parameters, or a table; a formula without t is a number."""
    made = mechanism(
        tmp_path,
        """
[[actuators]]
name = "a"
joint = "j"
kind = "position"
kp = 100
target = "= size*sin(2*pi*t)^2"
[[actuators]]
name = "b"
joint = "k"
kind = "position"
kp = 1
target = {times = [0, 1], values = ["$size", 2]}
[[actuators]]
name = "c"
joint = "k"
kind = "torque"
target = "= 2*3"
""",
    )
    formula, table, number = (item.target for item in made.actuators)
    assert isinstance(formula, Formula)
    assert formula.at(np.array([0.0, 0.25, 0.125])) == pytest.approx([0.0, 0.3, 0.15])
    assert value_at(table, np.array([-1.0, 0.5, 3.0])) == pytest.approx([0.3, 1.15, 2.0])
    assert number == 6
    assert {MechanismCapability.ACTUATORS, MechanismCapability.SIGNALS} <= required(made)


@pytest.mark.parametrize(
    ("more", "effort"),
    [
        ({"kind": "torque", "target": 3.0, "gear": -2.0}, -6.0),
        ({"kind": "velocity", "target": 3.0, "kd": 5.0, "gear": 2.0}, 2 * 5 * (3 - 2 * 0.5)),
        ({"kind": "position", "target": 3.0, "kp": 7.0, "kd": 5.0, "gear": 2.0}, 2 * (7 * (3 - 0.4) - 5 * 2 * 0.5)),
        ({"kind": "position", "target": 3.0, "kp": 7.0, "kd": 5.0, "gear": 2.0, "limit": 9.0}, 9.0),
    ],
)
def test_efforts_go_through_the_gear_and_the_limit_is_at_the_joint(more: dict[str, object], effort: float) -> None:
    """A target and its gains are of the motor; the limit clamps the whole effort at the joint."""
    made = slider(**more)
    assert JointCoordinates(made).solve(*made.start()).acceleration == pytest.approx([effort])
    assert JointCoordinates(made).sample(*made.start())["named"] == pytest.approx([effort])


@pytest.mark.parametrize("kind", ["torque", "velocity", "position"])
@pytest.mark.parametrize("target", [0.3, Formula("sin(3*t)"), Table((0.0, 0.5), (0.1, -0.4), hold=True), Held(0.7)])
def test_the_law_is_the_effort(kind: ActuatorKind, target: Signal) -> None:
    """An actuator's law has its effort to the last digit, at its limit and between."""
    gains = {"torque": {}, "velocity": {"kd": 3.0}, "position": {"kp": 30.0, "kd": 0.7}}[kind]
    actuator = Actuator("motor", "j", kind, target=target, gear=1.7, limit=2.0, **gains)
    states = np.random.default_rng(0).normal(size=(50, 2)).tolist()
    assert [actuator.law()(0.6, q, v) for q, v in states] == [actuator.effort(0.6, q, v) for q, v in states]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('[[actuators]]\nname = "a"\njoint = "x"\nkind = "torque"', "actuators.a.joint = 'x': there is no such joint"),
        ('[[actuators]]\nname = "a"\njoint = "j"\nkind = "force"', "actuators.0.kind"),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\nkp = 1',
            "actuators.a.kp = 1.0: an actuator of kind torque",
        ),
        ('[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkd = 1', "actuators.a.kp = 0.0: without it"),
        ('[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\nlimit = 0', "actuators.a.limit = 0.0: an effort"),
        ('[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ngear = 0', "actuators.a.gear = 0.0: a motor"),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = 1\n'
            '[[actuators]]\nname = "b"\njoint = "j"\nkind = "velocity"\nkd = 1',
            "actuators.b.joint = 'j': a and b hold targets of the same joint and fight",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = {times = [0, 2, 1], values = [0, 0, 0]}',
            "actuators.0.target.times.2 = 1.0: the times of a table grow",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = {times = [0, 2], values = [0]}',
            "actuators.0.target.values",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = {time = [0, 2], values = [0]}',
            "actuators.0.target.time",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "= log(t)"',
            "actuators.0.target = '= log(t)': is no finite number",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "= kick*sin(t)"',
            "actuators.0.target = 'kick': there is no such parameter",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "= sin(2*pi*T)"',
            "actuators.0.target = 'T': there is no such parameter; choose from t",
        ),
        (
            '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "j"\nratio = 1',
            "couplings.g.joint_b = 'j': a coupling connects",
        ),
        ('[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = 0', "couplings.g.ratio = 0.0"),
        (
            '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = 1\n'
            '[[couplings]]\nname = "h"\njoint_a = "k"\njoint_b = "j"\nratio = 1',
            "couplings.h = 'k to j': the couplings form a ring",
        ),
        (
            '[[couplings]]\nname = "g"\njoints = ["j", "k"]\ncoefficients = [1, 0]',
            "couplings.g.coefficients = [1.0, 0.0]: none may be zero",
        ),
        (
            '[[couplings]]\nname = "g"\njoints = ["j", "k"]\ncoefficients = [1, 2, 3]',
            "couplings.g.coefficients = (1.0, 2.0, 3.0): give 2 numbers",
        ),
        (
            '[[couplings]]\nname = "g"\njoints = ["j", "j"]\ncoefficients = [1, 2]',
            "couplings.g.joints = ['j', 'j']: name two or more joints, each once",
        ),
        (
            '[[couplings]]\nname = "g"\njoints = ["j", "k"]\ncoefficients = [1, 2]\njoint_a = "j"',
            "couplings.g.joints = ['j', 'k']: give these, or joint_a, joint_b and ratio; not both",
        ),
        ('[[couplings]]\nname = "g"\njoint_a = "j"\nratio = 1', "couplings.g.joint_b is missing: name it"),
        (
            '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = 1\noffset = 0.1',
            "couplings.g = 'j to k': q0 of k is -0.1 rad (or m) off",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = "100"',
            "actuators.0.kp = '100': this is not a number; give one in N m/rad or N/m",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = "$size"',
            "actuators.0.kp = '$size': this number is in N m/rad or N/m, that parameter in m",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\nlimit = "= 2*size"',
            "actuators.0.limit = ' 2*size': this number is in N m or N, the formula gives m",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "$size"',
            "actuators.0.target = '$size': this number is in N m or N, that parameter in m",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = {times = [0, 1], values = [0, "$size"]}',
            "actuators.0.target.values.1 = '$size': this number is in N m or N, that parameter in m",
        ),
        (
            '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = "$size"',
            "couplings.0.ratio = '$size': this number is in 1 or rad/m or m/rad, that parameter in m",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "= t > 0.5"',
            "actuators.0.target = '= t > 0.5': is no finite number",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "torque"\ntarget = "= 1 if t > 1 else 2"',
            "actuators.0.target = '= 1 if t > 1 else 2': is no finite number",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = 1\ngear = 1e200',
            "actuators.0.gear = 1e+200: its size is beyond 1e+100",
        ),
        (
            '[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = 100\ntarget = 1e308',
            "actuators.0.target = 1e+308: its size is beyond 1e+100",
        ),
    ],
)
def test_bad_drives_are_one_line(tmp_path: Path, more: str, said: str) -> None:
    """Each impossible actuator, target or coupling names its field and what to do."""
    with pytest.raises(InputError) as raised:
        mechanism(tmp_path, more)
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("target", "fits"),
    [
        ("= $size*sin(2*pi*t)", False),
        ("= size*sin(2*pi*t)", True),
        ("= 0.3*sin(2*pi*t)", True),
        ("= speed*t + size", True),
        ("= size*sin(speed*t/size)", True),
        ("= speed*sin(2*pi*t)", False),
        ("= size*sin(speed*t)", False),
        ("= size + speed*sin(t)", False),
    ],
)
def test_a_formula_of_time_has_the_unit_of_its_place(tmp_path: Path, target: str, fits: bool) -> None:
    """Parameters in a target of a place give metres or radians, with the time in seconds or beside plain numbers."""
    speed = '[parameters.speed]\nvalue = 2\nunit = "m/s"\nmeaning = "rate"\nsource = "s"\n[gravity]'
    more = PLAIN.replace("[gravity]", speed, 1)
    servo = f'[[actuators]]\nname = "a"\njoint = "j"\nkind = "position"\nkp = 1\ntarget = "{target}"'
    (tmp_path / "scene.toml").write_text(more + servo)
    if fits:
        load_scene(str(tmp_path))
    else:
        with pytest.raises(InputError, match=r"(toml: |^)actuators\.0\.target = "):
            load_scene(str(tmp_path))


@pytest.mark.parametrize("text", ["t.real", "__import__('os')", "9**9**9**9*t", "sin(t", "foo(t)"])
def test_formulas_do_nothing_but_compute(text: str) -> None:
    """What is no smooth formula of numbers is refused, quickly."""
    with pytest.raises(InputError, match="is no finite number at t = 0"):
        Formula(text)


@pytest.mark.parametrize(
    ("start", "strikes"), [("v0 = -1", True), ("v0 = 1", False), ("v0 = 0", False), ("q0 = 0.5\nv0 = -1", False)]
)
def test_no_joint_strikes_its_stop_at_the_start(tmp_path: Path, start: str, strikes: bool) -> None:
    """On its stop a joint may rest or leave; into it would be an impact at time 0, of which engines report one side."""
    (tmp_path / "scene.toml").write_text(PLAIN.replace('child = "b"', f'child = "b"\nlimits = [0, 2]\n{start}', 1))
    if not strikes:
        load_scene(str(tmp_path))
        return
    with pytest.raises(InputError, match=r"joints\.j\.v0 = -1\.0: the joint starts on its stop and moves into it"):
        load_scene(str(tmp_path))


def test_a_coupled_joint_takes_its_start_from_the_other(tmp_path: Path) -> None:
    """A dependent joint starts where its coupling has it, and the coupling takes a degree of freedom."""
    more = PLAIN.replace('child = "c"', 'child = "c"\ndependent = true').replace('child = "b"', 'child = "b"\nv0 = 2.0')
    coupling = '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = 3\noffset = 0.5'
    (tmp_path / "scene.toml").write_text(more + coupling)
    made = mechanism_named(str(tmp_path))
    q, v = made.start()
    assert q == pytest.approx([0.0, 0.5])
    assert v == pytest.approx([2.0, 6.0])
    assert MechanismCapability.COUPLINGS in required(made)
    assert JointCoordinates(made).rank == 1


def test_a_scene_whose_forces_are_not_determinate_can_be_read(tmp_path: Path) -> None:
    """Friction in both joints of a coupling is no mistake of a file: what cannot be solved is refused by who solves."""
    text = PLAIN.replace('child = "b"', 'child = "b"\nfriction = 1').replace('child = "c"', 'child = "c"\nfriction = 1')
    (tmp_path / "scene.toml").write_text(text + '[[couplings]]\nname = "g"\njoint_a = "j"\njoint_b = "k"\nratio = 1')
    made = mechanism_named(str(tmp_path))
    with pytest.raises(Refused, match="keep the friction or the stop of one of them"):
        truth_of(made, np.array([0.0, 0.1]))


_ARM = np.array([[8 / 3 + 0.1, 5 / 6], [5 / 6, 1 / 3 + 0.1]])  # mass matrix of the hanging arm, armature included


@pytest.mark.parametrize(
    ("scene", "damper", "servo"),
    [
        ("stiff_damper", 1000.0, None),
        ("servo", 4.0, 10.0),
        ("pendulum", None, None),
        ("arm_pd", *(max(np.linalg.eigvals(np.linalg.solve(_ARM, np.diag(law)))) for law in ((10, 5), (100, 50)))),
    ],
)
def test_a_step_is_measured_by_dampers_and_servos(scene: str, damper: float | None, servo: float | None) -> None:
    """Numbers of a step tell how stiff the dampers, springs and servos of joints are, where there are any."""
    numbers = {item.name: item.value for item in load_scene(scene).elements[0].step_numbers(1.0, None)}
    servo = np.sqrt(servo) if scene == "arm_pd" and servo else servo
    expected = {name: value for name, value in (("damper", damper), ("servo", servo)) if value}
    assert {name: numbers[name] for name in ("damper", "servo") if name in numbers} == pytest.approx(expected)


@pytest.mark.parametrize(
    ("scene", "taken"),
    [
        ("arm_pd", {"armature of joints": {"armature": 0.0}}),
        ("spring_friction", {"dry friction of joints": {"friction": 0.0}}),
        ("saturated_servo", {"limits of efforts": {"limit": 20000.0}}),
        ("double_pendulum", {}),
        ("cradle", {"restitution of contacts": {"restitution": 0.0}}),
        (
            "ladder",
            {
                "friction of contacts": {"floor_friction": 0.0, "wall_friction": 0.0},
                "slip of contacts": {"floor_friction": 1.5, "wall_friction": 1.0},
            },
        ),
        (
            "spinning_bounce",
            {
                "friction of contacts": {"friction": 0.0},
                "restitution of contacts": {"restitution": 0.0},
                "slip of contacts": {"friction": 1.0},
            },
        ),
    ],
)
def test_the_ladder_of_models_can_leave_a_law_out(scene: str, taken: dict[str, dict[str, float]]) -> None:
    """A law whose parameter has the name of its key is a term, and the scene without it is one."""
    loaded = load_scene(scene)
    (element,) = loaded.elements
    terms = element.optional_terms(loaded.parameters, None)
    assert {term.name: dict(term.taken) for term in terms} == taken
    for term in terms:
        load_scene(scene, **term.taken)
