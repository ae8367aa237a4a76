from pathlib import Path

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

from proofroll.core.errors import InputError
from proofroll.elements.mechanism.dynamics.analysis import analyse

LENGTH = 'unit = "m"\nsource = "this test"'
MASS = 'unit = "kg"\nsource = "this test"'
SLIDER_CRANK = f"""
[parameters.crank]
value = 0.15
meaning = "crank"
above = 0
below = "rod"
{LENGTH}
[parameters.rod]
value = 0.4
meaning = "rod"
above = 0
{LENGTH}
[parameters.crank_mass]
value = 0.4
meaning = "mass of the crank"
{MASS}
[parameters.rod_mass]
value = 0.8
meaning = "mass of the rod"
{MASS}
[gravity]
magnitude = 9.81
direction = [0, -1, 0]
[[bodies]]
name = "crank"
mass = "$crank_mass"
com = ["= crank/2", 0, 0]
inertia = [1e-4, "= crank_mass*crank^2/12", "= crank_mass*crank^2/12"]
[[bodies]]
name = "rod"
mass = "$rod_mass"
com = ["= rod/2", 0, 0]
inertia = [1e-4, "= rod_mass*rod^2/12", "= rod_mass*rod^2/12"]
[[bodies]]
name = "slider"
mass = 0.6
inertia = [1e-3, 1e-3, 1e-3]
[[joints]]
name = "guide"
kind = "prismatic"
parent = "world"
child = "slider"
axis = [1, 0, 0]
q0 = 0.5
dependent = true
[[joints]]
name = "pin"
kind = "revolute"
parent = "crank"
child = "rod"
position = ["$crank", 0, 0]
q0 = -1
dependent = true
[[joints]]
name = "shaft"
kind = "revolute"
parent = "world"
child = "crank"
q0 = "= pi/4"
v0 = 10
[[loops]]
name = "wrist"
kind = "revolute"
body_a = "rod"
position_a = ["$rod", 0, 0]
body_b = "slider"
"""


@pytest.fixture
def read(tmp_path: Path):
    """Reads the mechanism of a scene's file as every command does."""

    def mechanism(text=SLIDER_CRANK, **given):
        (tmp_path / "scene.toml").write_text(f'title = "a mechanism"\nsource = "this test"\n{text}')
        return mechanism_named(str(tmp_path), **given)

    return mechanism


def test_dependent_joints_follow_from_the_loops(read):
    """The slider stands and moves where plane geometry puts it, for any lengths."""
    for crank, rod in ((0.15, 0.4), (0.1, 0.3)):
        joints = {joint.name: joint for joint in read(crank=crank, rod=rod).joints}
        angle = np.pi / 4
        tilt = np.arcsin(-crank * np.sin(angle) / rod)
        turning = -crank * np.cos(angle) * 10 / (rod * np.cos(tilt))
        assert joints["guide"].q0[0] == pytest.approx(crank * np.cos(angle) + rod * np.cos(tilt), abs=1e-14)
        speed = -crank * np.sin(angle) * 10 - rod * np.sin(tilt) * turning
        assert joints["guide"].v0[0] == pytest.approx(speed, abs=1e-13)


def test_a_bare_number_takes_the_unit_of_what_it_is_added_to(read):
    """A formula may add a number to a length; one of plain numbers alone stands for a number."""
    for formula in ("= crank/2 + 0.025", "= 0.1 - 0.025 + 2*crank - 1*crank - 0.125", "= 0.2/2"):
        assert read(SLIDER_CRANK.replace("= crank/2", formula)).bodies[0].com[0] == pytest.approx(0.1, abs=1e-15)


def test_joints_are_sorted_depth_first(read):
    """Each joint comes after its parent's and before any other branch, whatever the file's order."""
    assert [joint.name for joint in read().joints] == ["guide", "shaft", "pin"]


def test_analysis_of_a_planar_loop_closed_by_a_revolute(read):
    """It has one degree of freedom, three redundant rows, and only Fx, Fy, Mz are determinate."""
    found = analyse(read())
    assert (found.rows, found.rank, found.redundant, found.mobility, found.singular_start) == (5, 2, 3, 1, False)
    assert (found.determinate == [True, True, False, False, False, True]).all()


def test_repeat_writes_tables_with_an_index(read):
    """A chain of n links has n bodies, each joint naming the one before it."""
    text = """
    [parameters.n]
    value = 3
    unit = "1"
    meaning = "number of links"
    source = "this test"
    [parameters.w]
    value = 1
    unit = "m"
    meaning = "length"
    source = "this test"
    [gravity]
    magnitude = 1
    [[repeat]]
    from = 1
    count = "$n"
    bodies = [{name = "link{i}", mass = "= i", inertia = [1, 1, 1]}]
    joints = [{name = "j{i}", kind = "revolute", parent = "link{i-1}", child = "link{i}", position = ["= i/n*w", 0, 0]}]
    [[bodies]]
    name = "link0"
    mass = 1
    inertia = [1, 1, 1]
    [[joints]]
    name = "j0"
    kind = "fixed"
    parent = "world"
    child = "link0"
    """
    mechanism = read(text, n=4)
    assert [body.name for body in mechanism.bodies] == ["link0", "link1", "link2", "link3", "link4"]
    assert [joint.parent for joint in mechanism.joints] == ["world", "link0", "link1", "link2", "link3"]
    assert mechanism.bodies[3].mass == 3
    assert mechanism.joints[2].position == (0.5, 0, 0)


ROD = '\n[[bodies]]\nname = "extra"\nmass = 1\ninertia = [1, 1, 1]\n'
EXTRA = '\n[[joints]]\nname = "extra"\nkind = "{kind}"\nparent = "{parent}"\nchild = "{child}"\n{more}\n'


def joint(parent, child, kind="revolute", more=""):
    """One more joint."""
    return EXTRA.format(parent=parent, child=child, kind=kind, more=more)


BAD = {
    "joint without its body": (SLIDER_CRANK + joint("crank", "ghost"), "joints.extra.child = 'ghost'.*no such body"),
    "kind of no kind": (SLIDER_CRANK.replace('kind = "revolute"', "kind = [[1]]", 1), r"joints.1.kind = \[\[1\]\]"),
    "moments beyond numbers": (
        SLIDER_CRANK + ROD.replace("[1, 1, 1]", "[1, 1e99, 1]"),
        "inertia.*triangle inequality",
    ),
    "a mass beside which others are nothing": (
        SLIDER_CRANK + ROD.replace("mass = 1", "mass = 1e99\ncom = [1e99, 0, 0]") + joint("rod", "extra"),
        "can move so that nothing with inertia does",
    ),
    "body without a joint": (SLIDER_CRANK + ROD, "bodies.extra.*no joint"),
    "two parents": (SLIDER_CRANK + joint("slider", "rod"), "two parents, through pin and extra"),
    "cycle": (
        SLIDER_CRANK
        + ROD
        + ROD.replace("extra", "other")
        + joint("extra", "other")
        + joint("other", "extra").replace('"extra"\nkind', '"back"\nkind'),
        "cycle",
    ),
    "child of itself": (SLIDER_CRANK + ROD + joint("extra", "extra"), "the same"),
    "world as a child": (SLIDER_CRANK + joint("rod", "world"), "cannot be a child"),
    "loop that does not close": (
        SLIDER_CRANK.replace("dependent = true", ""),
        r"loops.wrist = 'rod to slider': does not close: its points are 0\.0\d+ m apart",
    ),
    "loop that cannot close": (
        SLIDER_CRANK.replace('position_a = ["$rod", 0, 0]', "position_a = [0.05, 0, 0]"),
        r"does not close: its points are 0\.0\d+ m apart",
    ),
    "triangle inequality": (SLIDER_CRANK.replace("[1e-3, 1e-3, 1e-3]", "[1, 1, 3]"), "triangle inequality: 3 > 1 . 1"),
    "inertia not symmetric": (
        SLIDER_CRANK.replace("[1e-3, 1e-3, 1e-3]", "[[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]"),
        "symmetric",
    ),
    "negative inertia": (SLIDER_CRANK.replace("[1e-3, 1e-3, 1e-3]", "[-1, 1, 1]"), "negative principal moment"),
    "massless body that moves": (
        SLIDER_CRANK.replace("mass = 0.6\ninertia = [1e-3, 1e-3, 1e-3]", "mass = 0"),
        "bodies.slider.mass = 0.0: a body without mass can move",
    ),
    "point that spins": (
        SLIDER_CRANK + '\n[[bodies]]\nname = "extra"\nmass = 1\n' + joint("world", "extra", "spherical"),
        "joints = .extra.: can move so that nothing with inertia does",
    ),
    "negative mass": (SLIDER_CRANK.replace("mass = 0.6", "mass = -0.6"), "bodies.slider.mass.*at least 0"),
    "axis of zero": (SLIDER_CRANK.replace("axis = [1, 0, 0]", "axis = [0, 0, 0]"), "joints.guide.axis.*no direction"),
    "quaternion of zero": (
        SLIDER_CRANK + ROD + joint("world", "extra", "spherical", "q0 = [0, 0, 0, 0]"),
        "joints.extra.q0.*no rotation",
    ),
    "wrong number of coordinates": (SLIDER_CRANK.replace("q0 = 0.5", "q0 = [1, 2]"), "joints.guide.q0.*one number"),
    "nothing but fixed joints": (
        SLIDER_CRANK.split("[[bodies]]", maxsplit=1)[0] + ROD + joint("world", "extra", "fixed"),
        "mechanism = '1 joints': it cannot move",
    ),
    "spring without a direction": (
        SLIDER_CRANK + '\n[[springs]]\nname = "s"\nbody_a = "world"\nbody_b = "crank"\nstiffness = 1\nlength = 1\n',
        "springs.s = 'world to crank': its ends are at one place",
    ),
    "dependent without a loop": (
        SLIDER_CRANK.split("[[bodies]]", maxsplit=1)[0] + ROD + joint("world", "extra", more="dependent = true"),
        "joints.extra.dependent.*no loop or coupling that it could follow from",
    ),
    "parameter of another unit": (
        SLIDER_CRANK.replace('mass = "$rod_mass"', 'mass = "$rod"'),
        "bodies.1.mass = '.rod': this number is in kg, that parameter in m",
    ),
    "parameter of the other kind of joint": (
        SLIDER_CRANK.replace("v0 = 10", 'v0 = 10\nstiffness = "$rod"'),
        "joints.2.stiffness = '.rod': this number is in N m/rad, that parameter in m",
    ),
    "formula of another unit": (
        SLIDER_CRANK.replace("= crank/2", "= crank^2/2"),
        r"bodies.0.com.0 = ' crank\^2/2': this number is in m, the formula gives m\^2",
    ),
    "formula with a factor that hides a unit": (
        SLIDER_CRANK.replace("= rod_mass*rod^2/12", "= 0.8*rod^2/12"),
        r"bodies.1.inertia.1 = .*in kg m\^2, the formula gives m\^2; .* make a parameter",
    ),
    "sum of different units": (SLIDER_CRANK.replace("= crank/2", "= crank + rod_mass"), "m and kg cannot be added"),
    "power with a unit": (SLIDER_CRANK.replace("= crank/2", "= rod^crank"), "a power must be a plain number"),
    "division by zero": (SLIDER_CRANK.replace("= crank/2", "= crank/0"), "bodies.0.com.0 = .* divides by zero"),
    "function call": (SLIDER_CRANK.replace("= crank/2", "= eval(crank)"), "Function 'eval' not defined"),
    "hostile expression": (SLIDER_CRANK.replace("= crank/2", "= __import__('os').getcwd()"), "bodies.0.com.0"),
    "attribute": (SLIDER_CRANK.replace("= crank/2", "= crank.real"), "bodies.0.com.0.*crank.real.*is no arithmetic"),
    "huge power": (SLIDER_CRANK.replace("= crank/2", "= 9^9^9^9^9"), "bodies.0.com.0"),
    "velocity beyond numbers": (SLIDER_CRANK.replace("v0 = 10", "v0 = 1e200", 1), "v0 = 1e.200: its size is beyond"),
    "assignment": (SLIDER_CRANK.replace("= crank/2", "= m = crank/2"), "is no arithmetic"),
    "complex": (SLIDER_CRANK.replace("= crank/2", "= (0-1)^0.5"), "no finite real number"),
    "text": (
        SLIDER_CRANK.replace("mass = 0.6", 'mass = "heavy"'),
        "bodies.2.mass = 'heavy': this is not a number; give one in kg",
    ),
    "formula of time without =": (
        SLIDER_CRANK.replace("q0 = 0.5", 'q0 = 0.5\ntorque = "0.3*sin(t)"', 1),
        "joints.0.torque = .*: give a number, a formula that begins with =, or a table",
    ),
    "ragged list": (SLIDER_CRANK.replace("q0 = 0.5", "q0 = [1, [2], 3]"), r"joints.0.q0.1 = \[2\]: give a number"),
    "number beyond all bounds": (
        SLIDER_CRANK.replace("[1e-3,", f"[{10**400},"),
        "bodies.2.inertia.0.*its cube overflows",
    ),
    "nan": (SLIDER_CRANK.replace("mass = 0.6", "mass = nan"), "bodies.slider.mass.*finite"),
    "bool": (
        SLIDER_CRANK.replace("mass = 0.6", "mass = true"),
        "bodies.2.mass = True: this is not a number; give one in kg",
    ),
    "unknown key": (
        SLIDER_CRANK.replace("mass = 0.6", "mass = 0.6\ncolour = 3"),
        "bodies.2.colour.*no such key here; the keys are name, mass",
    ),
    "unknown key of a joint": (
        SLIDER_CRANK.replace("q0 = 0.5", "q1 = 0.5"),
        "the keys are name, .*, q0, v0.*dependent",
    ),
    "missing key": (SLIDER_CRANK.replace("mass = 0.6\n", ""), "bodies.2.mass.*required"),
    "unknown parameter": (SLIDER_CRANK.replace("$crank", "$lenght"), "no such parameter; choose from crank, rod"),
    "unknown kind": (
        SLIDER_CRANK.replace('"prismatic"', '"slider"'),
        "joints.0.kind = 'slider': choose one of fixed, revolute",
    ),
    "name used twice": (SLIDER_CRANK.replace('"wrist"', '"pin"'), "used twice"),
    "out of bounds": (
        SLIDER_CRANK.replace("value = 0.15", "value = 0.5"),
        "parameters.crank.value = 0.5: crank must be below rod = 0.4 m",
    ),
    "no gravity": (SLIDER_CRANK.replace("[gravity]\nmagnitude = 9.81", "[gravity]"), "gravity.magnitude.*required"),
    "axis where there is none": (
        SLIDER_CRANK + ROD + joint("world", "extra", "spherical", "axis = [1, 0, 0]"),
        "a spherical joint has no axis",
    ),
    "stiffness without a coordinate": (
        SLIDER_CRANK + ROD + joint("world", "extra", "planar", "stiffness = 1"),
        "a planar joint has none",
    ),
}


@pytest.mark.filterwarnings("ignore:.*(overflow|invalid value):RuntimeWarning")
@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_clear_line(read, name):
    """Each mistake is an InputError of one line that names the field."""
    text, message = BAD[name]
    with pytest.raises(InputError, match=message) as raised:
        read(text)
    assert "\n" not in str(raised.value)


def test_inconsistent_velocities_are_refused(read):
    """Speeds that would open a loop are refused with the speed at which it opens."""
    whole = read()
    start = {joint.name: joint.q0[0] for joint in whole.joints}
    text = SLIDER_CRANK.replace("dependent = true", "").replace("q0 = 0.5", f"q0 = {start['guide']!r}")
    text = text.replace("q0 = -1", f"q0 = {start['pin']!r}")
    with pytest.raises(InputError, match=r"loops.wrist = .*v0 opens the loop at 4\.\d+ m/s"):
        read(text)
    assert read(text.replace("v0 = 10", "v0 = 0")).joints == read(SLIDER_CRANK.replace("v0 = 10", "v0 = 0")).joints
