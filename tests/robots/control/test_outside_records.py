"""``proofroll judge RECORD --robot --control`` on records that other programs wrote."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from outside_records import (
    CENTRE,
    CONTROL,
    FITTED,
    JOINTS,
    MISTAKES,
    MISWRITTEN,
    OBSERVED,
    PROGRAMS,
    SCALE,
    Loop,
    columns_of,
    miswritten,
    urdf,
    written,
)
from scipy.spatial.transform import Rotation

from proofroll.robots.control.judge import RecordJudgement, judge_record

STATE = {"time", "q", "v", "p_WB", "q_WB", "v_WB", "w_WB"}
Columns = dict[str, np.ndarray]
Judged = Callable[..., RecordJudgement]
Proofroll = Callable[..., tuple[int, str, str]]
# What three decimals of velocities do not show: of forces, a payload takes away 5.7, as it takes 5.6 of a right record.
FINE = ("gravity 9.80", "payload")
# Cases that stand for all of them where no drill is run.
QUICK = {
    ("mujoco", "", "no clamp"),
    ("mujoco", "single", "gravity 9.80"),
    ("mujoco", "3", "a step less"),
    ("pinocchio", "", "no armature"),
    ("pinocchio", "single", "xyzw"),
    ("pinocchio", "3", "legs swapped"),
    ("mujoco", "", "half the rate"),
    ("pinocchio", "single", "four times the rate"),
    ("mujoco", "3", "an action repeated"),
    ("pinocchio", "", "two instants late"),
    ("mujoco", "single", "velocity of the centre"),
    ("pinocchio", "", "held efforts"),
    ("mujoco", "", "clipped targets"),
    ("pinocchio", "single", "low pass"),
    ("mujoco", "3", "damping"),
    ("pinocchio", "3", "dry friction"),
    ("mujoco", "single", "relative coordinates"),
}
_DRILL = (pytest.mark.drill, pytest.mark.slow)
CLOSED = ("damping", "dry friction", "payload")  # named with what they close, too, by a test of their own
# Of each cause that QUICK lacks the first mistake of the table is judged before a change lands; those that take longest
# wait for the night.
_KNOWN = {MISTAKES[name][0] for _, _, name in QUICK}
FIRST = {cause: name for name, (cause, *_) in reversed(MISTAKES.items()) if cause not in _KNOWN}


def turn(place: int, program: str) -> bool:
    """True for the one program whose record of a mistake may be judged before a change lands; both are in the night."""
    return [*PROGRAMS].index(program) == place % len(PROGRAMS)


ALL = [
    pytest.param(
        program,
        digits,
        name,
        marks=()
        if (program, digits, name) in QUICK
        else _DRILL
        if not digits and name not in CLOSED and name in FIRST.values() and turn(place, program)
        else pytest.mark.nightly,
    )
    for program in PROGRAMS
    for digits in ("", "single", "3")
    for place, name in enumerate(MISTAKES)
    if digits != "3" or name not in FINE
]
# Searches of up to half a minute, and mistakes of a kind that another one stands for: signs, inverses and late rows.
LONG = {
    "other legs",
    "early velocities",
    "late actions",
    "late velocity",
    "sign of spins",
    "sign of coordinates",
    "sign of rates",
    "inverse, w_WB in base",
    "all in degrees",
    "degrees per second",
    "scaled actions",
}
OF_OBSERVATIONS = [
    pytest.param(
        name,
        marks=() if name in {"xyzw", "rates at 0.05"} else pytest.mark.nightly,
    )
    for name in OBSERVED
]


def recorded(name: str, program: str = "mujoco", **settings: object) -> Columns:
    """Columns of somebody's loop around a program with a mistake; empty: without one."""
    return columns_of(Loop(**(MISTAKES[name][2] if name else {}), **settings).record(PROGRAMS[program]))  # type: ignore[arg-type]


def only(columns: Columns, *kinds: str) -> Columns:
    """Columns of a state, and of some more kinds."""
    return {key: values for key, values in columns.items() if key.split(".")[0] in STATE | {*kinds}}


@pytest.fixture
def legs(tmp_path: Path) -> list[str]:
    """Options that name the robot of the loops and its controller."""
    (tmp_path / "legs.urdf").write_text(urdf())
    (tmp_path / "legs.toml").write_text(CONTROL)
    return ["--robot", str(tmp_path / "legs.urdf"), "--control", str(tmp_path / "legs.toml")]


@pytest.fixture
def judged(legs: list[str], tmp_path: Path) -> Judged:
    """Judgement of columns, written with some digits."""

    def judgement(columns: Columns, digits: str = "") -> RecordJudgement:
        return judge_record(written(columns, tmp_path / "record.csv", digits), Path(legs[1]), Path(legs[3]))

    return judgement


def require_first(judgement: RecordJudgement, layer: str, cause: str) -> None:
    """Checks the first layer that does not hold, and its first cause."""
    wrong = next(item for item in judgement.layers if not item.holds)
    assert (wrong.name, wrong.causes[0].id) == (layer, cause)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("digits", ["", "single", "3"])
def test_a_right_record_of_another_program_holds(program: str, digits: str, judged: Judged) -> None:
    """Every layer of a right record holds, to 1e-9 with all digits."""
    layers = judged(recorded("", program), digits).layers
    assert [layer.name for layer in layers if not layer.holds] == []
    assert max(layer.residual for layer in layers if layer.residual is not None) < (0.1 if digits == "3" else 1e-5)
    if not digits:
        assert all(layer.residual is not None and layer.residual < 1e-9 for layer in layers)


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of(
    "pinocchio-3-dry friction",
    "pinocchio-single-xyzw",
    "pinocchio--relative coordinates",
    "pinocchio--velocity in the base",
    "pinocchio--spin at 0.25",
    "mujoco--rotation back",
    "mujoco--velocity at 2",
    "pinocchio--no armature",
    "mujoco-3-damping",
    "pinocchio--half kd",
    "mujoco--rates at 0.05",
)
@pytest.mark.drill_of(
    "mujoco-single-gravity 9.80", "pinocchio--two instants late", "mujoco-single-relative coordinates"
)
@pytest.mark.parametrize(("program", "digits", "name"), ALL)
def test_a_mistake_of_another_program_is_named(program: str, digits: str, name: str, judged: Judged) -> None:
    """A mistake in a loop around another program stops at its layer and is named; a limit is that of the URDF."""
    cause, layer, _ = MISTAKES[name]
    require_first(judged(recorded(name, program), digits), layer, cause)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of("first for last-pinocchio", "kd of hips-pinocchio")
@pytest.mark.parametrize(
    ("name", "program"),
    [
        pytest.param(
            name,
            program,
            marks=()
            if k % 7 == 0 and program == "pinocchio"
            else pytest.mark.drill
            if turn(k, program) and k % 4 == 1
            else pytest.mark.nightly,
        )
        for k, name in enumerate(FITTED)
        for program in PROGRAMS
    ],
)
def test_numbers_of_single_joints_are_named(name: str, program: str, judged: Judged) -> None:
    """What differs at a joint, by two numbers, or by a law of targets, is named at its layer with its size."""
    cause, layer, changes, words = FITTED[name]
    judgement = judged(columns_of(Loop(**changes).record(PROGRAMS[program])))
    require_first(judgement, layer, cause)
    assert words in "\n".join(judgement.lines())


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of("milliseconds", "inverse")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.nightly if name in LONG else () if k % 5 == 0 else pytest.mark.drill)
        for k, name in enumerate(MISWRITTEN)
    ],
)
def test_a_mistake_of_columns_accuses_nothing_else(name: str, judged: Judged) -> None:
    """Columns that are not what their names say are named, and every layer behind them is judged without that."""
    layer, words = MISWRITTEN[name]
    judgement = judged(columns_of(miswritten(Loop().record(PROGRAMS["pinocchio"]), name)))
    wrong = [item for item in judgement.layers if not item.holds and item.name != "acceleration"]
    assert [item.name for item in wrong] == [layer]
    assert wrong[0].causes[0].sentence.startswith(words)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("kind", ["v_WB", "v", "w_WB"])
def test_a_row_of_lag_shows_in_three_decimals(kind: str, judged: Judged) -> None:
    """Rates that are a row late are named in a file with three decimals, and accuse no observation or frame."""
    record = dict(Loop().record(PROGRAMS["mujoco"]))
    record[kind] = np.concatenate([record[kind][:1], record[kind][:-1]])
    judgement = judged(columns_of(record), "3")
    causes = [(layer.name, cause.id) for layer in judgement.layers for cause in layer.causes]
    assert causes == [("state", "late")], "\n".join(judgement.lines())


@pytest.mark.drill
def test_a_lag_that_no_digit_shows_is_left_open(judged: Judged) -> None:
    """Where the digits of a file are too few for a lag of a row, the answer says so."""
    judgement = judged(columns_of(Loop(steps=60).record(PROGRAMS["mujoco"])), "2")
    assert "the digits of the record do not tell whether" in judgement.remarks[0]


@pytest.mark.nightly
def test_rates_whose_rows_are_told_are_not_left_open(judged: Judged) -> None:
    """Rates that are called a row early are not called untold beside that."""
    judgement = judged(columns_of(miswritten(Loop().record(PROGRAMS["pinocchio"]), "early velocities")), "2")
    assert [cause.id for cause in judgement.layers[0].causes] == ["early"]
    assert list(judgement.remarks) == []


@pytest.mark.nightly
def test_a_layer_that_stays_open_tells_no_column(judged: Judged, monkeypatch: pytest.MonkeyPatch) -> None:
    """A base at its centre of mass, which layers alone tell, is not claimed where an observation stays open."""
    record = dict(Loop().record(PROGRAMS["mujoco"]))
    offset = Rotation.from_quat(record["q_WB"], scalar_first=True).apply(CENTRE)
    record["p_WB"] = record["p_WB"] + offset
    record["v_WB"] = record["v_WB"] + np.cross(record["w_WB"], offset)
    assert [cause.id for cause in judged(columns_of(record)).layers[0].causes] == ["base_frame"]
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 1.0)  # else all pairs of mistakes are tried
    noise = np.random.default_rng(0).normal(size=record["q"].shape)
    judgement = judged(columns_of({**record, "observed.q": record["observed.q"] + noise}))
    assert not any("the layers behind it tell so" in line for line in judgement.lines())
    assert not any("none of 0 " in line for line in judgement.lines())


@pytest.mark.nightly_of("late-are one instant")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("columns_of_actions", "words"),
    [("scaled", "have the scale of the controller already"), ("late", "are one instant")],
)
def test_columns_of_actions_do_not_accuse_the_last_one(columns_of_actions: str, words: str, judged: Judged) -> None:
    """Where columns of actions are wrong and the observed last action is right, the columns are named, once."""
    record = Loop().record(PROGRAMS["pinocchio"])
    last = np.concatenate([np.zeros((20, 6)), record["action"][:-20]])
    wrong = last if columns_of_actions == "late" else SCALE * record["action"]
    judgement = judged(columns_of({**record, "observed.last": last, "action": wrong}))
    causes = [cause.sentence for layer in judgement.layers if not layer.holds for cause in layer.causes]
    assert len(causes) == 1
    assert words in causes[0]


@pytest.mark.drill
def test_late_targets_at_times_of_four_digits(legs: list[str], judged: Judged, monkeypatch: pytest.MonkeyPatch) -> None:
    """Instants that are written to a part of a step belong to the targets of an instant before."""
    monkeypatch.setattr("outside_records.RATE", 75)
    Path(legs[3]).write_text(CONTROL.replace("rate = 50", "rate = 75\ndelay = 1"))
    columns = columns_of(Loop(step=1 / 1500, late=1).record(PROGRAMS["pinocchio"]))
    columns["time"] = np.array([float(f"{time:.4g}") for time in columns["time"]])
    judgement = judged(columns)
    assert judgement.agrees, "\n".join(judgement.lines())


@pytest.mark.drill
def test_digits_that_show_no_force_decide_nothing(judged: Judged) -> None:
    """Accelerations whose rounding is larger than all forces are not judged."""
    layer = judged(recorded("no gravity"), "1").layers[-1]
    assert (layer.residual, layer.reason) == (None, "the rounding of the record is larger than the forces")


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("begin", [3.0, pytest.param(3.007, marks=pytest.mark.drill)])
def test_a_clock_that_begins_at_any_time(begin: float, program: str, judged: Judged) -> None:
    """A right record holds wherever its clock begins, between two instants of a clock from 0 as well."""
    columns = recorded("", program)
    judgement = judged({**columns, "time": columns["time"] + begin})
    assert judgement.agrees, "\n".join(judgement.lines())


@pytest.mark.drill
def test_a_limit_that_is_never_reached_has_a_bound(judged: Judged) -> None:
    """Where no effort is at a limit, it is at least the largest effort, beside the cause that there is none."""
    said = "\n".join(judged(columns_of(Loop(limit=40.0).record(PROGRAMS["mujoco"]))).lines())
    columns = columns_of(Loop(limit=40.0).record(PROGRAMS["mujoco"]))
    largest = max(np.abs(values).max() for name, values in columns.items() if name.startswith("effort."))
    bound = re.search(r"the limit of efforts is at least (\S+) of the right one, for no effort is larger", said)
    assert bound, said
    assert float(bound[1]) == pytest.approx(largest / 0.8, rel=1e-3)


@pytest.mark.nightly_of("rates at 0.05")
@pytest.mark.nightly
@pytest.mark.parametrize("name", OF_OBSERVATIONS)
def test_a_mistake_of_an_observation_shows_in_actions(name: str, judged: Judged) -> None:
    """Where no observation is recorded, its mistakes are named at the action."""
    columns = only(recorded(name, "pinocchio"), "action", "target", "effort")
    require_first(judged(columns), "action", MISTAKES[name][0])


@pytest.mark.nightly
@pytest.mark.nightly_of("dry friction", "payload")
@pytest.mark.parametrize("name", CLOSED)
def test_what_no_file_has_is_named_with_what_it_explains(name: str, judged: Judged) -> None:
    """Damping, dry friction and a payload are named at the accelerations with their sizes, and close them."""
    layer = judged(recorded(name)).layers[-1]
    size = next(iter(MISTAKES[name][2].values()))
    assert (layer.name, layer.holds, layer.causes[0].id) == ("acceleration", False, MISTAKES[name][0])
    assert layer.causes[0].size == pytest.approx(size, rel=1e-6)
    assert layer.causes[0].after < 1e-6 < layer.residual  # type: ignore[operator]


@pytest.mark.nightly
def test_a_payload_shows_in_states_alone(judged: Judged) -> None:
    """A payload is named with its mass and place from states alone."""
    judgement = judged(only(recorded("payload")))
    require_first(judgement, "motion", "payload")
    assert "trunk carries 0.15 kg more, at (0.1, 0.05, 0.12) m" in "\n".join(judgement.lines())


@pytest.mark.drill
def test_two_mistakes_at_two_layers_are_both_named(judged: Judged) -> None:
    """Each layer is computed from recorded ones, so mistakes at several layers are named one by one."""
    judgement = judged(recorded("", kd=0.1, pose=np.zeros(6), xyzw=True))
    causes = {layer.name: layer.causes[0].id for layer in judgement.layers if not layer.holds and layer.causes}
    assert causes["observation"] == "quaternion"
    assert causes["target"] == "pose_missing"
    assert causes["effort"] == "kd"


@pytest.mark.drill
def test_a_quaternion_of_few_digits_is_no_mistake(judged: Judged) -> None:
    """What a program loses of a quaternion, its length shows; other columns have all digits."""
    columns = recorded("")
    columns |= {
        name: np.float32(values).astype(float) * (1 + 1e-5) for name, values in columns.items() if name[:5] == "q_WB."
    }
    judgement = judged(columns)
    assert judgement.agrees, "\n".join(judgement.lines())


@pytest.mark.nightly_of("-every layer that was looked at holds")
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("name", "said"),
    [("", "every layer that was looked at holds"), ("spin in the world", "angular velocity of the base is observed")],
)
def test_states_alone_tell_a_mistake(
    name: str, said: str, proofroll: Proofroll, legs: list[str], tmp_path: Path
) -> None:
    """A record of states every 5 ms, in single precision, is held against motions under the law and its mistakes."""
    record = written(only(recorded(name, step=5e-3, steps=20)), tmp_path / "record.csv", "single")
    code, out, err = proofroll("judge", str(record), *legs)
    assert code == int(bool(name)), out + err
    assert said in " ".join(out.split())


@pytest.mark.nightly
def test_a_search_that_ran_out_of_time_decides_nothing(
    proofroll: Proofroll, legs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """States that are off, and that no search has explained, are neither right nor wrong: exit 3, with the reason."""
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 0.0)
    record = written(only(recorded("spin in the world", step=5e-3, steps=20)), tmp_path / "record.csv", "single")
    code, out, err = proofroll("judge", str(record), *legs)
    assert code == 3, out + err
    assert "not decided: off by" in out
    assert proofroll("judge", str(record), *legs, "--as", "isaaclab", "--map", "a=q.b")[0] == 2
    code, out, err = proofroll("judge", str(record), "pendulum", "--as", "isaaclab")
    assert (code, "give --robot, too" in " ".join(err.split())) == (2, True)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("begin", "name", "said"),
    [
        (0.04, "", "every layer that was looked at holds"),
        (0.033, "", "every layer that was looked at holds"),
        (0.033, "state before", "servos see the state of the step before"),
    ],
)
def test_a_record_that_begins_later(
    begin: float, name: str, said: str, proofroll: Proofroll, legs: list[str], tmp_path: Path
) -> None:
    """A record that begins at an instant, or between two, holds in every layer, and a mistake in it is named."""
    columns = recorded(name)
    rows = columns["time"] >= begin - 1e-9
    record = written({key: values[rows] for key, values in columns.items()}, tmp_path / "record.csv")
    code, out, err = proofroll("judge", str(record), *legs)
    assert code == int(bool(name)), out + err
    assert said in " ".join(out.split())


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("kinds", "name", "code", "said"),
    [
        ((), "", 3, "a policy that observes its last action needs what was before"),
        (("action",), "", 0, "every layer that was looked at holds"),
        (("action",), "half kd", 1, "kd is 0.5 of the right one"),
    ],
)
def test_states_of_a_record_that_begins_later(
    kinds: tuple[str, ...], name: str, code: int, said: str, proofroll: Proofroll, legs: list[str], tmp_path: Path
) -> None:
    """States alone from a later instant on need what a policy saw before, and are judged with its actions."""
    columns = recorded(name, step=5e-3, steps=40)
    rows = columns["time"] >= 0.035 - 1e-9
    states = {key: values[rows] for key, values in only(columns, *kinds).items()}
    got, out, err = proofroll("judge", str(written(states, tmp_path / "record.csv")), *legs)
    assert got == code, out + err
    assert said in " ".join(out.split())


@pytest.mark.nightly
def test_a_record_with_names_and_units_of_its_own(proofroll: Proofroll, legs: list[str], tmp_path: Path) -> None:
    """Columns of another program are named by ``--map``; milliseconds, degrees and axes of the base are converted.

    A gear of the URDF explains efforts of motors, and its velocity limit is said where the record passes it.
    """
    Path(legs[1]).write_text(urdf().replace('velocity="40"', 'velocity="0.5"'))
    ours = recorded("", "pinocchio")
    turned = {key: np.stack([ours[f"{key}.{axis}"] for axis in "xyz"], axis=1) for key in ("v_WB", "w_WB")}
    quaternion = np.stack([ours[f"q_WB.{axis}"] for axis in "wxyz"], axis=1)
    theirs, names = {"t": 1e3 * ours["time"]}, {"t": "time[ms]"}
    for k, joint in enumerate(JOINTS):
        theirs |= {f"dof_pos_{k}": np.degrees(ours[f"q.{joint}"]), f"dof_vel_{k}": ours[f"v.{joint}"]}
        theirs |= {f"action_{k}": ours[f"action.{joint}"], f"target_{k}": ours[f"target.{joint}"]}
        theirs[f"torque_{k}"] = ours[f"effort.{joint}"]
        names |= {f"dof_pos_{k}": f"q.{joint}[deg]", f"dof_vel_{k}": f"v.{joint}", f"action_{k}": f"action.{joint}"}
        names |= {f"target_{k}": f"target.{joint}", f"torque_{k}": f"effort.{joint}"}
    for axis in "xyzw":
        theirs[f"quat_{axis}"], names[f"quat_{axis}"] = ours[f"q_WB.{axis}"], f"q_WB.{axis}"
    for k, axis in enumerate("xyz"):
        theirs[f"root_{axis}"], names[f"root_{axis}"] = ours[f"p_WB.{axis}"], f"p_WB.{axis}"
        for theirs_name, key in (("lin", "v_WB"), ("ang", "w_WB")):
            theirs[f"{theirs_name}_{axis}"] = _in_base(quaternion, turned[key])[:, k]
            names[f"{theirs_name}_{axis}"] = f"{key}_B.{axis}"
    asked = [*legs, "--map", ",".join(f"{key}={name}" for key, name in names.items())]
    record = written(theirs, tmp_path / "record.csv")
    code, out, err = proofroll("judge", str(record), *asked)
    assert code == 0, out + err
    assert "passes the velocity limit 0.5 of the robot's file" in " ".join(out.split())
    theirs |= {f"torque_{k}": theirs[f"torque_{k}"] / 9 for k in range(len(JOINTS))}
    code, out, _ = proofroll("judge", str(written(theirs, record)), *asked)
    assert code == 1
    assert "efforts are those of motors, divided by the reductions of the robot's file" in " ".join(out.split())


def _in_base(quaternion: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors along the axes of the base."""
    return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).inv().apply(vectors))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("layout", ["playground", "isaaclab", "legged_gym"])
def test_arrays_of_a_training_framework(layout: str, legs: list[str], tmp_path: Path) -> None:
    """Arrays are read with the quaternion, frames, point and order of joints of their program, in single precision."""
    ours = Loop().record(PROGRAMS["mujoco"])
    turned, spin = ours["q_WB"], ours["w_WB"]
    by_level = [0, 3, 1, 4, 2, 5] if layout == "isaaclab" else range(6)
    joints = {key: ours[key][:, list(by_level)] for key in ("q", "v", "action", "target", "effort")}
    if layout == "playground":
        base = _in_base(turned, spin)
        arrays = {
            "qpos": np.concatenate([ours["p_WB"], turned, joints["q"]], axis=1),
            "qvel": np.concatenate([ours["v_WB"], base, joints["v"]], axis=1),
            "ctrl": joints["target"],
            "action": joints["action"],
        }
    else:
        centre = -_in_base(turned * [1, -1, -1, -1], np.tile(-np.array([0.02, 0, 0.01]), (len(turned), 1)))
        moving = ours["v_WB"] + np.cross(spin, centre)
        scalar = turned if layout == "isaaclab" else np.roll(turned, -1, axis=1)
        names = ("root_state_w", "joint_pos", "joint_vel", "applied_torque")
        names = names if layout == "isaaclab" else ("root_states", "dof_pos", "dof_vel", "torques")
        values = (
            np.concatenate([ours["p_WB"], scalar, moving, spin], axis=1),
            *(joints[k] for k in ("q", "v", "effort")),
        )
        arrays = dict(zip(names, values, strict=True)) | {"actions": joints["action"]}
    stored = {name: values.astype(np.float32) for name, values in arrays.items()}
    np.savez(tmp_path / "record.npz", dt=1e-3, **stored)
    judgement = judge_record(tmp_path / "record.npz", Path(legs[1]), Path(legs[3]), layout=layout)
    assert judgement.agrees, "\n".join(judgement.lines())
    assert [layer.name for layer in judgement.layers if layer.residual is not None][:2] == ["instants", "action"]


@pytest.mark.parametrize(
    ("asked", "lacking", "said"),
    [
        ([], (), "say whose arrays these are: playground, isaaclab"),
        (["--as", "gym"], (), "choose the program whose arrays these are"),
        (["--as", "isaacgym"], (), "isaacgym calls it dof_pos"),
        (["--as", "playground"], ("dt",), "give an array time [s], or a number dt"),
    ],
)
def test_arrays_that_cannot_be_read(
    asked: list[str], lacking: tuple[str, ...], said: str, proofroll: Proofroll, legs: list[str], tmp_path: Path
) -> None:
    """Arrays without the name of their program, with a wrong one, or without times are one line."""
    arrays = {"qpos": np.zeros((9, 13)), "qvel": np.zeros((9, 12)), "dt": np.array(0.01)}
    np.savez(tmp_path / "record.npz", **{key: values for key, values in arrays.items() if key not in lacking})
    code, _, err = proofroll("judge", str(tmp_path / "record.npz"), *legs, *asked)
    assert code == 2
    assert said in err


@pytest.mark.parametrize(
    ("layout", "changed", "said"),
    [
        ("isaacgym", {"root_states": np.ones((9, 12))}, "'root_states': it has 12 columns, and a robot of 6 joints 13"),
        ("isaacgym", {"root_states": np.ones((9, 7))}, "it has 7 columns, .* 13: place, quaternion, velocity and"),
        ("isaacgym", {"root_states": np.ones((9, 3))}, "it has 3 columns"),
        ("isaacgym", {"torques": np.ones((8, 6))}, "'torques': it has 8 rows, and the file 9 times"),
        ("playground", {"qpos": np.ones((9, 12))}, "'qpos': it has 12 columns, and a robot of 6 joints 6 or 13"),
        ("playground", {"qvel": np.ones((9, 6))}, "'qvel': it has 6 columns, and a robot of 6 joints 12"),
    ],
)
def test_arrays_of_another_shape(
    layout: str, changed: dict[str, np.ndarray], said: str, proofroll: Proofroll, legs: list[str], tmp_path: Path
) -> None:
    """An array with too few columns or rows is one line with its own name and what it should have."""
    gym = {"root_states": np.ones((9, 13)), "dof_pos": np.zeros((9, 6)), "dof_vel": np.zeros((9, 6))}
    arrays = {"qpos": np.ones((9, 13)), "qvel": np.zeros((9, 12))} if layout == "playground" else gym
    np.savez(tmp_path / "record.npz", dt=0.01, **(arrays | changed))
    code, _, err = proofroll("judge", str(tmp_path / "record.npz"), *legs, "--as", layout)
    assert (code, err.count("\n")) == (2, 1), err
    assert re.search(said, err)
