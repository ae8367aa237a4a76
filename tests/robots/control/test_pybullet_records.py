"""Records that PyBullet wrote, in ``pybullet_records``, against the file of the robot."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.files.csv_table import read_csv
from proofroll.robots.control.bookkeeping.mistakes import SearchTime
from proofroll.robots.control.judge import RecordJudgement, judge_record

FOLDER = Path(__file__).parent / "pybullet_records"
ROBOT = FOLDER / "floater.urdf"
NAMED = {  # record -> layer and cause
    "honest": [("state", "base_frame")],
    "air": [("state", "base_frame"), ("acceleration", "drag")],
    "defaults": [("state", "base_frame"), ("acceleration", "inertia_from_collision"), ("acceleration", "drag")],
    "motors": [("acceleration", "held_joints")],
    "servos": [("state", "base_frame"), ("state", "late_effort")],
    "stop": [("state", "base_frame")],
}


def named(judgement: RecordJudgement) -> list[tuple[str, str]]:
    """Layer and id of each cause."""
    return [(layer.name, cause.id) for layer in judgement.layers for cause in layer.causes]


@cache
def judged(name: str) -> RecordJudgement:
    """Judgement of a record under our names, once for all tests."""
    return judge_record(FOLDER / f"{name}.csv", ROBOT, None)


def arrays(name: str, folder: Path) -> Path:
    """The record as a file of arrays with PyBullet's names."""
    table = read_csv((FOLDER / f"{name}.csv").read_text(), {})
    kinds = {"joint_positions": "q.", "joint_velocities": "v.", "torques": "effort."}
    kinds |= {"base_position": "p_WB.", "base_orientation": "q_WB."}
    kinds |= {"base_linear_velocity": "v_WB.", "base_angular_velocity": "w_WB."}
    columns = {
        array: np.stack([item.to_numpy() for key, item in table.data_vars.items() if str(key).startswith(kind)], axis=1)
        for array, kind in kinds.items()
    }
    np.savez(folder / f"{name}.npz", time=table["time"].to_numpy(), **columns)
    return folder / f"{name}.npz"


@pytest.mark.drill
@pytest.mark.drill_of("air", "stop")
@pytest.mark.nightly_of("defaults", "servos", "honest", "stop", "air")
@pytest.mark.parametrize("name", NAMED)
def test_columns_are_explained(name: str) -> None:
    """Columns under our names: each setting that PyBullet's user left is named, and nothing besides."""
    judgement = judged(name)
    assert named(judgement) == NAMED[name], "\n".join(judgement.lines())


@pytest.mark.nightly
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name == "air" else pytest.mark.nightly) for name in NAMED if name != "defaults"],
)
def test_arrays_of_pybullet_have_its_frame(name: str, tmp_path: Path) -> None:
    """Arrays under PyBullet's names: the frame of its base is no mistake, and the rest is named as before."""
    judgement = judge_record(arrays(name, tmp_path), ROBOT, None, layout="pybullet")
    assert named(judgement) == [item for item in NAMED[name] if item[1] != "base_frame"]
    assert judgement.looked_at


@pytest.mark.nightly
def test_degrees_keep_the_frame_of_the_base(tmp_path: Path) -> None:
    """Arrays with joints in degrees are held against the robot with PyBullet's frame of the base, which is exact."""
    robot = tmp_path / "floater.urdf"
    robot.write_text(ROBOT.read_text().replace('lower="-2" upper="2"', 'lower="-200" upper="200"'))
    path = arrays("honest", tmp_path)
    content = dict(np.load(path))
    content |= {name: np.degrees(content[name]) for name in ("joint_positions", "joint_velocities")}
    np.savez(path, **content)
    judgement = judge_record(path, robot, None, layout="pybullet")
    assert named(judgement) == [("state", "degrees")], "\n".join(judgement.lines())


@pytest.mark.nightly
def test_searches_of_a_record_share_one_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """All searches of a record have one time, and one that ended among importers is told."""
    ends: list[float] = []
    begin = SearchTime.__init__

    def begun(time: SearchTime, seconds: float = np.inf) -> None:
        ends.extend([seconds] if 0 < seconds < np.inf else [])
        begin(time, seconds)

    monkeypatch.setattr(SearchTime, "__init__", begun)
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 1e-9)
    layer = judge_record(FOLDER / "defaults.csv", ROBOT, None).layers[-1]
    assert ends == [1e-9]
    assert "the search for robots as importers read it ended after" in layer.reason


@pytest.mark.nightly
@pytest.mark.parametrize("known", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_steps_that_are_assumed_are_told(known: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where forces differ and the file has no ``sim_dt``, the answer says that PyBullet's usual step was assumed.

    It hangs on no search, and noise would have each search to its end.
    """
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 0.0)
    path = arrays("honest", tmp_path)
    content = dict(np.load(path))
    content["torques"] = content["torques"] + np.random.default_rng(0).normal(size=content["torques"].shape)
    np.savez(path, **content, **({"sim_dt": 1 / 240} if known else {}))
    layer = judge_record(path, ROBOT, None, layout="pybullet").layers[-1]
    assert not layer.holds
    assert ("the usual step of pybullet" in layer.reason) != known


@pytest.mark.nightly
def test_drag_has_its_size() -> None:
    """The damping of links is told with its size, 0.04, and closes what differs."""
    (cause,) = judged("air").layers[-1].causes
    assert cause.size == pytest.approx(0.04, rel=1e-5)
    assert cause.after < 1e-10


@pytest.mark.nightly
def test_rows_at_a_stop_are_left_out() -> None:
    """A joint that reaches its limit is told with the time, and its rows do not count."""
    layer = judged("stop").layers[-1]
    assert layer.holds
    assert layer.reason == "rows at an end of the range of a joint are left out: q.jb, first at 0.02917 s"


def test_a_part_of_a_base_is_no_base(tmp_path: Path) -> None:
    """A record with a place of the base and no velocity is refused with the array that lacks."""
    path = arrays("honest", tmp_path)
    content = dict(np.load(path))
    del content["base_linear_velocity"]
    np.savez(path, **content)
    with pytest.raises(InputError, match="base_linear_velocity"):
        judge_record(path, ROBOT, None, layout="pybullet")
