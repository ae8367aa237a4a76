"""``proofroll judge RECORD --robot --control``: layers of a record, and the mistakes that they name."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from air_records import recorded
from air_robots import law_of, legged, solo12
from robot_templates import urdf

from proofroll.robots.control.bookkeeping.air import HeldRobot, Treatment
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import IMPLICIT, orders
from proofroll.robots.control.columns import readings_of_early_rates
from proofroll.robots.control.controlled import ControlledScenes
from proofroll.robots.control.layers import InAir, record_layers
from proofroll.robots.control.record import _roundings, record_of

Proofroll = Callable[..., tuple[int, str, str]]
ROBOT = legged()
LAW = law_of(ROBOT)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.drill_of("-rk4", "single-rk4")
@pytest.mark.parametrize("scheme", ["explicit", "implicit", "rk4"])
@pytest.mark.parametrize("digits", ["", "single", "3"])
def test_a_clean_record_holds(scheme: Treatment, digits: str) -> None:
    """Every layer of a right record holds, to 1e-9 with all digits, whatever the scheme and the digits."""
    layers = record_layers(recorded(ROBOT, LAW, LAW, scheme=scheme, digits=digits), LAW, ROBOT, grounded=False)
    assert [layer.name for layer in layers if not layer.holds] == []
    assert all(layer.residual is not None for layer in layers)
    if not digits:
        assert max(layer.residual or 0.0 for layer in layers[:5]) < 1e-9


@pytest.mark.drill
def test_what_rounding_leaves_hides_no_armature() -> None:
    """Where rounding makes a third of what is off, a missing armature is named, and nothing else that halves it."""
    record = recorded(ROBOT, LAW.change(armature=0 * LAW.armature), LAW, digits="3")
    layer = record_layers(record, LAW, ROBOT, grounded=False)[-1]
    assert [cause.id for cause in layer.causes] == ["armature"]
    assert layer.causes[0].size == pytest.approx(0.0, abs=0.1)


@pytest.mark.nightly
def test_orders_of_a_robot_of_a_package() -> None:
    """Each other order of the joints of solo12 is named where its actions act, and a clean record of it holds."""
    robot = solo12()
    law = law_of(robot)
    assert all(layer.holds for layer in record_layers(recorded(robot, law, law), law, robot, grounded=False))
    for words, order in orders(law.joints):
        wrong = law.change(action_order=order)
        layers = record_layers(recorded(robot, wrong, law), law, robot, grounded=False)
        first = next(layer for layer in layers if not layer.holds)
        assert (first.name, first.causes[0].id) == ("target", "joint_order"), words
        assert words in first.causes[0].sentence


@pytest.mark.nightly
def test_sizes_are_fitted() -> None:
    """Sizes of gains, limits, scale and armature come back to three digits and more."""
    for attribute, factor in (("kp", 0.37), ("kd", 1.73), ("scale", 0.61), ("limit", 0.7), ("armature", 0.33)):
        wrong = LAW.change(**{attribute: factor * getattr(LAW, attribute)})
        layers = record_layers(recorded(ROBOT, wrong, LAW), LAW, ROBOT, grounded=False)
        cause = next(layer for layer in layers if not layer.holds).causes[0]
        assert cause.size == pytest.approx(factor, rel=1e-6)


@pytest.mark.nightly
def test_implicit_damping_is_no_armature() -> None:
    """A record with implicit kd holds at two steps; an armature of h kd in an explicit one is named as an armature."""
    for step in (1e-3, 2e-3):
        clean = record_layers(
            recorded(ROBOT, LAW, LAW, step=step, count=50, scheme="implicit"), LAW, ROBOT, grounded=False
        )
        assert all(layer.holds for layer in clean)
    armed = LAW.change(armature=LAW.armature + 2e-3 * LAW.kd)
    layers = record_layers(recorded(ROBOT, armed, LAW, step=1e-3), LAW, ROBOT, grounded=False)
    assert [item.id for item in next(layer for layer in layers if not layer.holds).causes][:1] == ["armature"]


@pytest.mark.nightly
def test_implicit_damping_and_an_armature_are_named_together() -> None:
    """Where no effort is clamped, one step cannot tell implicit kd from an armature h kd: both are named."""
    law = LAW.change(limit=np.full(len(LAW.joints), 100.0))
    armed = law.change(armature=law.armature + 1e-3 * law.kd)
    for wrong, scheme in ((law, "implicit"), (armed, "explicit")):
        layer = record_layers(recorded(ROBOT, wrong, law, scheme=scheme), law, ROBOT, grounded=False)[-1]  # type: ignore[arg-type]
        assert (layer.name, layer.holds, layer.reason) == ("acceleration", True, IMPLICIT)
    layer = record_layers(recorded(ROBOT, armed, law, step=2e-3, count=50), law, ROBOT, grounded=False)[-1]
    assert [item.id for item in layer.causes] == ["armature"]
    clamped = record_layers(recorded(ROBOT, LAW, LAW, scheme="implicit"), LAW, ROBOT, grounded=False)[-1]
    assert clamped.holds
    assert not clamped.reason


@pytest.mark.drill
def test_efforts_that_hold_between_instants() -> None:
    """A record whose efforts hold between instants holds in every layer, and breaks at the effort otherwise."""
    held = LAW.change(hold_effort=True)
    record = recorded(ROBOT, held, LAW)
    assert all(layer.holds for layer in record_layers(record, held, ROBOT, grounded=False))
    layers = record_layers(record, LAW, ROBOT, grounded=False)
    assert next(layer for layer in layers if not layer.holds).name == "effort"


CONTROL = """rate = 50
pose = {{j1 = 0.2, j2 = 0.05, j3 = -0.4}}
[[gains]]
joints = "j*"
kp = 30
kd = {kd}
limit = 8
armature = 0.02
[policy]
call = "mine:make"
scale = 0.3
"""
POLICY = """import numpy as np
def make(joints):
    return lambda seen: np.sin(3 * seen.q + 0.2 * seen.v + seen.time + np.arange(len(joints)))
"""


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str, str]:
    """Record of a fixed arm, its robot file and its controller's file."""
    robot, control, record = (tmp_path / name for name in ("arm.urdf", "arm.toml", "arm.csv"))
    robot.write_text(urdf())
    control.write_text(CONTROL.format(kd=1.5))
    (tmp_path / "mine.py").write_text(POLICY)
    mechanism = ControlledScenes(control).of_record(robot, free=False).mechanism
    law = ControlLaw.of(mechanism)
    written = recorded(mechanism, law, law)
    names = [name for name in written.columns if name[:5] not in {"p_WB.", "q_WB.", "v_WB.", "w_WB.", "obser"}]
    rows = zip(written.time, *(written.columns[name] for name in names), strict=True)
    lines = [",".join(["time", *names]), *(",".join(repr(float(value)) for value in row) for row in rows)]
    record.write_text("\n".join(lines))
    return str(record), str(robot), str(control)


@pytest.mark.drill
def test_the_command(proofroll: Proofroll, files: tuple[str, str, str]) -> None:
    """A right record exits 0, a wrong one 1 with the mistake; what the record lacks is said."""
    record, robot, control = files
    code, out, err = proofroll("judge", record, "--robot", robot, "--control", control)
    assert code == 0, err
    assert "every layer that was looked at holds" in " ".join(out.split())
    assert "– observation (from the state): the record has no columns observed" in " ".join(out.split())
    Path(control).write_text(CONTROL.format(kd=3.0))
    code, out, _ = proofroll("judge", record, "--robot", robot, "--control", control)
    assert code == 1
    assert "the effort is the first layer that does not hold" in " ".join(out.split())
    assert "kd is 0.5 of the right one" in out
    code, out, _ = proofroll("judge", record, "--robot", robot, "--control", control, "--json")
    content = json.loads(out)
    assert code == 1
    effort = next(layer for layer in content["layers"] if layer["name"] == "effort")
    assert effort["causes"][0]["id"] == "kd"
    assert effort["causes"][0]["size"] == pytest.approx(0.5, rel=1e-6)


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda text: text.replace("effort.j2", "effort.x"), "the record has no such column"),
        (lambda text: text.replace("time", "t"), "time"),
        (lambda text: text.split("0.001,")[0], "two or more times"),
    ],
)
def test_broken_records(
    change: Callable[[str], str], said: str, proofroll: Proofroll, files: tuple[str, str, str]
) -> None:
    """A record that lacks a column or a time is one clear line."""
    record, robot, control = files
    Path(record).write_text(change(Path(record).read_text()))
    code, _, err = proofroll("judge", record, "--robot", robot, "--control", control)
    assert code == 2
    assert said in err
    assert "Traceback" not in err


def test_robot_and_control_belong_together(proofroll: Proofroll, files: tuple[str, str, str]) -> None:
    """A controller without its robot, or a file that is no robot, is one clear line."""
    record, _, control = files
    for asked, said in (
        (["--control", control], "--robot"),
        (["--robot", control, "--control", control], "give the path of a robot file"),
    ):
        code, _, err = proofroll("judge", record, *asked)
        assert code == 2
        assert said in err


@pytest.mark.drill
def test_a_step_that_is_too_long_comes_first(proofroll: Proofroll, files: tuple[str, str, str]) -> None:
    """The step that explicit servos need is the first line where the rows are farther apart, and else no line."""
    record, robot, control = files
    for kd, start in ((1.5, record), (150.0, "explicit PD needs h ≤ ")):
        Path(control).write_text(CONTROL.format(kd=kd))
        _, out, _ = proofroll("judge", record, "--robot", robot, "--control", control)
        assert out.replace("\n", "").startswith(start)


@pytest.mark.drill
def test_on_the_ground_accelerations_are_left_out() -> None:
    """A record on the ground is judged but for its accelerations, and says why."""
    layers = record_layers(recorded(ROBOT, LAW, LAW, count=30), LAW, ROBOT, grounded=True)
    assert layers[-1].residual is None
    assert "ground" in layers[-1].reason
    assert np.isfinite([layer.residual for layer in layers[:-1]]).all()  # type: ignore[arg-type]


@pytest.mark.parametrize("digits", [4, 7])
def test_digits_of_a_stream_are_rounding(digits: int) -> None:
    """Numbers that are written with so many digits, small ones too, are known to half a unit of their last one."""
    values = np.array([123.456789, 1.23456789e-4, -9.87654321, 0.0])
    written = np.array([float(f"{value:.{digits}g}") for value in values])
    bars = _roundings({"q.a": written})["q.a"]
    assert np.all(np.abs(written - values) <= bars)
    assert bars[[0, 2]] == pytest.approx(0.5 * 10.0 ** np.array([3.0 - digits, 1.0 - digits]), rel=1e-9)


@pytest.mark.nightly
def test_an_inertia_that_is_another_has_no_size() -> None:
    """An inertia of a body is named with what is off with it alone; it is no mass."""
    trunk, *legs = ROBOT.bodies
    turned = replace(trunk, inertia=((0.03, 0.004, 0.0), (0.004, 0.05, 0.0), (0.0, 0.0, 0.045)))
    record = recorded(replace(ROBOT, bodies=(turned, *legs)), LAW, LAW)
    (cause,) = record_layers(record, LAW, ROBOT, grounded=False)[-1].causes
    assert cause.sentence.startswith("the inertia of trunk is another (")
    assert cause.size is None
    assert cause.after < 1e-9


def test_rates_that_are_not_there_are_not_early() -> None:
    """A record without velocities has no reading with early ones, and one of a base alone has those of the base."""
    times, names = 0.01 * np.arange(9), ("v_WB.x", "v_WB.y", "v_WB.z")
    targets = {f"{kind}.j": np.sin(times) for kind in ("action", "target")}
    assert [*readings_of_early_rates(record_of(times, targets))] == []
    (reading,) = readings_of_early_rates(record_of(times, {name: np.cos(times) for name in names}))
    assert reading.layer is not None
    assert reading.layer.causes[0].sentence.startswith("v_WB: one row early")


@pytest.mark.nightly
def test_the_fewest_causes_tell_the_importer() -> None:
    """Of robots that importers make, the one that needs no further cause is named, though another comes before it."""
    masses = [(1.2 if k % 2 else 0.8) * body.mass for k, body in enumerate(ROBOT.bodies)]
    bodies = tuple(replace(body, mass=mass) for body, mass in zip(ROBOT.bodies, masses, strict=True))
    lighter = replace(ROBOT, gravity=(0.0, 0.0, -9.5))
    importers = [
        replace(HeldRobot.of(robot), causes=(name,), words=name)
        for name, robot in (("another gravity", lighter), ("right", ROBOT))
    ]
    in_air = InAir(HeldRobot.of(replace(ROBOT, bodies=bodies)), imported=lambda: importers)
    layer = record_layers(recorded(ROBOT, LAW, LAW), LAW, ROBOT, grounded=False, in_air=in_air)[-1]
    assert [cause.id for cause in layer.causes] == ["right"]


@pytest.mark.nightly
def test_assumed_steps_decide_nothing() -> None:
    """What steps between the rows may explain is not decided where rows are steps only by the usual step."""
    record = recorded(ROBOT, LAW, LAW, scheme="rk4", step=1e-3, count=100)
    record = record.part(np.arange(0, len(record.time), 2))
    in_air = InAir(HeldRobot.of(ROBOT), assumed="rows are the usual step")
    plain, assumed = (record_layers(record, LAW, ROBOT, grounded=False, in_air=item)[-1] for item in (None, in_air))
    assert plain.undecided
    assert "log every step to decide" in plain.reason
    assert assumed.undecided
    assert assumed.reason.endswith("rows are the usual step")


@pytest.mark.nightly
def test_what_no_cause_explains_is_not_called_rounding() -> None:
    """Rows of a robot whose thighs are heavier hold in no layer of accelerations."""
    bodies = [replace(body, mass=(1.5 if body.name.endswith("HFE") else 1.0) * body.mass) for body in ROBOT.bodies]
    heavy = replace(ROBOT, bodies=tuple(bodies))
    layer = record_layers(recorded(heavy, LAW, LAW, scheme="rk4"), LAW, ROBOT, grounded=False)[-1]
    assert layer.residual is None or not layer.holds
