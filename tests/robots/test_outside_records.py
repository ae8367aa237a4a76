"""``proofroll judge RECORD --robot --control`` on records that other programs wrote."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from outside_records import CONTROL, JOINTS, MISTAKES, PROGRAMS, Loop, columns_of, urdf, written

from proofroll.robots.control_judge import RecordJudgement, judge_record

BASE = ("p_WB", "q_WB", "v_WB", "w_WB")
Proofroll = Callable[..., tuple[int, str, str]]
FINE = "gravity 9.80"  # what three decimals of velocities do not show


@pytest.fixture
def judged(tmp_path: Path) -> Callable[..., RecordJudgement]:
    """Judgement of a record of somebody's loop around a program, written with some digits."""
    (tmp_path / "legs.urdf").write_text(urdf())
    (tmp_path / "legs.toml").write_text(CONTROL)

    def judgement(program: str, digits: str, **mistake: object) -> RecordJudgement:
        columns = columns_of(Loop(**mistake).record(PROGRAMS[program]))  # type: ignore[arg-type]
        record = written(columns, tmp_path / "record.csv", digits)
        return judge_record(record, tmp_path / "legs.urdf", tmp_path / "legs.toml")

    return judgement


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("digits", ["", "single", "3"])
def test_a_right_record_of_another_program_holds(
    program: str, digits: str, judged: Callable[..., RecordJudgement]
) -> None:
    """Every layer of a right record holds, to 1e-9 with all digits."""
    layers = judged(program, digits).layers
    assert [layer.name for layer in layers if not layer.holds] == []
    assert max(layer.residual for layer in layers if layer.residual is not None) < (0.1 if digits == "3" else 1e-5)
    if not digits:
        assert all(layer.residual is not None and layer.residual < 1e-9 for layer in layers)


@pytest.mark.parametrize(
    ("program", "digits", "name"),
    [
        ("mujoco", "", "no clamp"),
        ("mujoco", "single", "gravity 9.80"),
        ("mujoco", "3", "a step less"),
        ("pinocchio", "", "no armature"),
        ("pinocchio", "single", "xyzw"),
        ("pinocchio", "3", "legs swapped"),
    ],
)
def test_a_mistake_of_another_program_is_named(
    program: str, digits: str, name: str, judged: Callable[..., RecordJudgement]
) -> None:
    """A mistake in a loop around another program stops at its layer and is named; a limit is that of the URDF."""
    _named(judged(program, digits, **MISTAKES[name][2]), name)


@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize("digits", ["", "single", "3"])
def test_all_mistakes_of_another_program_are_named(
    program: str, digits: str, judged: Callable[..., RecordJudgement]
) -> None:
    """Each mistake stops at its layer and is named there, but a thousandth of gravity in three decimals."""
    for name in MISTAKES:
        if (name, digits) != (FINE, "3"):
            _named(judged(program, digits, **MISTAKES[name][2]), name)


def _named(judgement: RecordJudgement, name: str) -> None:
    cause, layer, _ = MISTAKES[name]
    first = next(item for item in judgement.layers if not item.holds)
    assert (first.name, first.causes[0].id) == (layer, cause), name


@pytest.mark.drill
@pytest.mark.parametrize(
    ("name", "said"),
    [("", "every layer that was looked at holds"), ("spin in the world", "angular velocity of the base is observed")],
)
def test_states_alone_tell_a_mistake(name: str, said: str, proofroll: Proofroll, tmp_path: Path) -> None:
    """A record of states every 5 ms, in single precision, is held against motions under the law and its mistakes."""
    (tmp_path / "legs.urdf").write_text(urdf())
    (tmp_path / "legs.toml").write_text(CONTROL)
    loop = Loop(step=5e-3, steps=20, **(MISTAKES[name][2] if name else {}))
    columns = columns_of(loop.record(PROGRAMS["mujoco"]))
    states = {key: values for key, values in columns.items() if key.split(".")[0] in {"time", "q", "v", *BASE}}
    record = written(states, tmp_path / "record.csv", "single")
    asked = ["--robot", str(tmp_path / "legs.urdf"), "--control", str(tmp_path / "legs.toml")]
    code, out, err = proofroll("judge", str(record), *asked)
    assert code == int(bool(name)), out + err
    assert said in " ".join(out.split())


@pytest.mark.parametrize(("begin", "named"), [(0.04, False), (0.033, False), (0.033, True)])
def test_a_record_that_begins_later(begin: float, named: bool, proofroll: Proofroll, tmp_path: Path) -> None:
    """A record that begins at an instant, or between two, holds in every layer, and a mistake in it is named."""
    (tmp_path / "legs.urdf").write_text(urdf())
    (tmp_path / "legs.toml").write_text(CONTROL)
    columns = columns_of(Loop(steps=100, **(MISTAKES["state before"][2] if named else {})).record(PROGRAMS["mujoco"]))
    rows = columns["time"] >= begin - 1e-9
    record = written({key: values[rows] for key, values in columns.items()}, tmp_path / "record.csv")
    asked = ["--robot", str(tmp_path / "legs.urdf"), "--control", str(tmp_path / "legs.toml")]
    code, out, err = proofroll("judge", str(record), *asked)
    assert code == int(named), out + err
    said = "servos see the state of the step before" if named else "every layer that was looked at holds"
    assert said in " ".join(out.split())


@pytest.mark.drill
def test_states_of_a_record_that_begins_later(proofroll: Proofroll, tmp_path: Path) -> None:
    """States alone from a later instant on need what a policy saw before, and are judged with its actions."""
    (tmp_path / "legs.urdf").write_text(urdf())
    (tmp_path / "legs.toml").write_text(CONTROL)
    asked = ["--robot", str(tmp_path / "legs.urdf"), "--control", str(tmp_path / "legs.toml")]
    for kinds, mistake, code, said in (
        ({"time", "q", "v", *BASE}, {}, 3, "a policy that observes its last action needs what was before"),
        ({"time", "q", "v", "action", *BASE}, {}, 0, "every layer that was looked at holds"),
        ({"time", "q", "v", "action", *BASE}, MISTAKES["half kd"][2], 1, "kd is 0.5 of the right one"),
    ):
        columns = columns_of(Loop(step=5e-3, steps=40, **mistake).record(PROGRAMS["mujoco"]))
        rows = columns["time"] >= 0.035 - 1e-9
        states = {key: values[rows] for key, values in columns.items() if key.split(".")[0] in kinds}
        got, out, err = proofroll("judge", str(written(states, tmp_path / "record.csv")), *asked)
        assert got == code, out + err
        assert said in " ".join(out.split())


def test_a_record_with_names_and_units_of_its_own(proofroll: Proofroll, tmp_path: Path) -> None:
    """Columns of another program are named by ``--map``; milliseconds, degrees and axes of the base are converted.

    A gear of the URDF explains efforts of motors, and its velocity limit is said where the record passes it.
    """
    (tmp_path / "legs.urdf").write_text(urdf().replace('velocity="40"', 'velocity="0.5"'))
    (tmp_path / "legs.toml").write_text(CONTROL)
    ours = columns_of(Loop().record(PROGRAMS["pinocchio"]))
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
    asked = ["--robot", str(tmp_path / "legs.urdf"), "--control", str(tmp_path / "legs.toml")]
    asked += ["--map", ",".join(f"{key}={name}" for key, name in names.items())]
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
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_quat(quaternion, scalar_first=True).inv().apply(vectors))
