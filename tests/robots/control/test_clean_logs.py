"""Logs of a right arm with sensor noise, in single precision or with soft friction: none is accused."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.robots.control.air_several import noise_of_states
from proofroll.robots.control.differences import instant_rows, passed_instants
from proofroll.robots.control.judge import RecordJudgement, judge_record
from proofroll.robots.control.record import _roundings, read_record, record_of

JOINTS = ("a", "b", "c")
ARM = """<mujoco><option timestep="0.001" integrator="{scheme}"/><worldbody>
<body><joint name="a" axis="0 0 1" damping=".02" armature=".02" frictionloss="{loss}"/>
<inertial pos=".1 0 .02" mass="1.2" diaginertia=".01 .02 .015"/>
<body pos=".2 0 0"><joint name="b" axis="0 1 0" damping=".02" armature=".02" frictionloss="{loss}"/>
<inertial pos=".1 .02 0" mass=".9" diaginertia=".006 .01 .012"/>
<body pos=".25 0 0"><joint name="c" axis="1 .2 0" damping=".02" armature=".02"/>
<inertial pos=".05 0 .1" mass=".5" diaginertia=".004 .003 .005"/></body></body></body></worldbody></mujoco>"""
CONTROL = """rate = 100
delay = {delay}
pose = {{a = 0.1, b = -0.2, c = 0.3}}
[[gains]]
joints = "*"
kp = 30
kd = 0.6
[policy]
call = "a_policy:make"
scale = 0.3
"""
POLICY = """import math

def make(joints):
    def policy(seen):
        states = enumerate(zip(seen.q, seen.v))
        return [math.tanh(0.8 * q - 0.1 * v + math.sin(3 * seen.time + k)) for k, (q, v) in states]

    return policy
"""
KP, KD, POSE, SCALE = 30.0, 0.6, np.array([0.1, -0.2, 0.3]), 0.3
Log = dict[str, np.ndarray]
Judge = Callable[..., RecordJudgement]


def log_of(
    seconds: float,
    scheme: str = "Euler",
    loss: float = 0.0,
    heavier: float = 1.0,
    lost: float = 1.0,
    clock: float = 0.0,
) -> Log:
    """Columns of a loop around MuJoCo, a row for each step; of another arm with a heavier last link or lost efforts.

    ``clock``: time by which the clock of the policy is ahead [s].
    """
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(ARM.format(scheme=scheme, loss=loss))
    model.body_mass[3] *= heavier
    model.body_inertia[3] *= heavier
    data, rows = mujoco.MjData(model), []
    data.qpos[:], data.qvel[:] = (0.3, -0.4, 0.2), (0.5, -1.0, 0.8)
    for step in range(round(seconds / 1e-3) + 1):
        q, v, time = data.qpos.copy(), data.qvel.copy(), step * 1e-3
        if step % 10 == 0:
            action = np.array([math.tanh(0.8 * q[k] - 0.1 * v[k] + math.sin(3 * (time + clock) + k)) for k in range(3)])
        target = POSE + SCALE * action
        effort = KP * (target - q) - KD * v
        rows.append([time, *q, *v, *action, *target, *effort])
        data.qfrc_applied[:] = lost * effort
        mujoco.mj_step(model, data)
    kinds = ("q", "v", "action", "target", "effort")
    return dict(
        zip(["time", *(f"{kind}.{joint}" for kind in kinds for joint in JOINTS)], np.array(rows).T, strict=True)
    )


def noisy(log: Log, part: float = 1e-3) -> Log:
    """A log whose states have white noise of this part of their ranges that the policy did not see."""
    generator = np.random.default_rng(1)
    return {
        name: item + part * np.ptp(item) * generator.normal(size=item.shape) * name.startswith(("q.", "v."))
        for name, item in log.items()
    }


@pytest.fixture
def judge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Judge:
    """Judgement of a log that is written in a form, of an arm with a friction."""

    def judged(log: Log, form: str = "%.17g", loss: float = 0.0) -> RecordJudgement:
        for name, text in {
            "arm.xml": ARM.format(scheme="Euler", loss=loss), "a_policy.py": POLICY, "arm.toml": CONTROL.format(delay=0)
        }.items():  # fmt: skip
            (tmp_path / name).write_text(text, encoding="utf-8")
        np.savetxt(tmp_path / "log.csv", np.column_stack([*log.values()]), form, ",", header=",".join(log), comments="")
        return judge_record(tmp_path / "log.csv", tmp_path / "arm.xml", tmp_path / "arm.toml")

    monkeypatch.syspath_prepend(str(tmp_path))
    return judged


@pytest.mark.parametrize("form", ["%.9g", "%.8e", "%.12g", "%.17g"])
def test_single_precision_is_seen_however_it_is_written(form: str) -> None:
    """Digits that a value of single precision does not have are no digits of it; a column of doubles keeps its own."""
    values = np.random.default_rng(0).normal(size=200)
    single = np.array([float(form % item) for item in values.astype(np.float32)])
    bars = _roundings({"q.a": single, "target.a": values})
    assert bars["q.a"].max() == pytest.approx(2.0**-24 * np.abs(values).max(), rel=1e-6)
    assert bars["target.a"].max() < 1e-15


@pytest.mark.drill
@pytest.mark.parametrize("form", ["%.9g", "%.17g"])
def test_a_log_in_single_precision_holds(judge: Judge, form: str) -> None:
    """Each layer of a right arm is within the rounding of single precision, and one of gains off by 1e-4 is not."""
    log = {name: item.astype(np.float32).astype(float) for name, item in log_of(0.3).items()}
    assert judge(log, form).agrees
    log["effort.b"] = (log["effort.b"] * (1 + 1e-4)).astype(np.float32).astype(float)
    assert not judge(log, form).agrees


@pytest.mark.drill
@pytest.mark.parametrize("seconds", [0.5, 1.5])
def test_noise_of_sensors_leaves_layers_undecided(judge: Judge, seconds: float) -> None:
    """Actions, efforts and accelerations that noise may explain are not decided, in short logs and in long ones."""
    judged = judge(noisy(log_of(seconds)))
    assert (judged.agrees, judged.decided) == (True, False)
    assert {"action", "effort", "acceleration"} == {layer.name for layer in judged.layers if layer.undecided}


@pytest.mark.drill
@pytest.mark.parametrize("clock", [0.05, -0.004])
def test_a_clock_that_is_off_is_named(judge: Judge, clock: float) -> None:
    """A policy that sees another time than that of the record is told so, with the time by which its clock is ahead."""
    layer = next(layer for layer in judge(log_of(0.3, clock=clock)).layers if not layer.holds)
    assert (layer.name, layer.causes[0].sentence) == ("action", f"the clock of the policy is off by {clock:.5g} s")


@pytest.mark.drill
def test_mistakes_beyond_the_noise_are_named(judge: Judge) -> None:
    """Gains and signs that make more than the noise are told in a noisy log."""
    log = noisy(log_of(0.5))
    log["effort.b"] = 1.5 * log["effort.b"]
    (effort,) = (layer for layer in judge(log).layers if layer.name == "effort")
    assert (effort.holds, effort.undecided) == (False, False)


def test_a_log_without_noise_has_none(tmp_path: Path) -> None:
    """Steps, rounding to four decimals and jumps of the accelerations are no noise; noise of 0.1 % of a range is."""
    log = {name: item for name, item in log_of(0.3).items() if name == "time" or name[:2] in ("q.", "v.")}

    def noise(item: Log, form: str) -> float | None:
        np.savetxt(
            tmp_path / "log.csv", np.column_stack([*item.values()]), form, ",", header=",".join(item), comments=""
        )
        found = noise_of_states(read_record(tmp_path / "log.csv", {}))
        return None if found is None else found.part

    assert [noise(log, form) for form in ("%.17g", "%.4f")] == [None, None]
    assert noise(noisy(log), "%.17g") == pytest.approx(1e-3, rel=0.5)


@pytest.mark.drill
@pytest.mark.parametrize("scheme", ["Euler", "implicitfast", "RK4"])
def test_soft_friction_is_told_as_softness(judge: Judge, scheme: str) -> None:
    """MuJoCo's dry friction below its bound is no other robot: the layer is not decided, and says why."""
    judged = judge(log_of(0.5, scheme, loss=0.1), loss=0.1)
    layer = judged.layers[-1]
    assert (judged.agrees, layer.undecided, layer.name) == (True, True, "acceleration")
    assert "dry friction within its bounds explains it, as that of MuJoCo" in layer.reason


@pytest.mark.parametrize(("every", "late", "hidden"), [(4e-3, 0, True), (4e-3, 1, False), (2e-3, 0, False)])
def test_rows_that_pass_between_instants_do_not_show_them(every: float, late: int, hidden: bool) -> None:
    """Targets that change at the first row after each instant are no mistake, and those a row later may be one."""
    times = every * np.arange(60)
    instants = np.floor(times * 100 + 1e-6)
    record = record_of(times[late:], {"target.a": instants[: len(times) - late]})
    control: Any = SimpleNamespace(rate=100)
    assert passed_instants(record, control).startswith(f"rows every {every:.4g} s pass") == hidden


def test_targets_that_never_change_have_instants_of_the_clock() -> None:
    """A record with constant targets, whose efforts may hold between instants, has these at multiples of their time."""
    times = 2e-3 * np.arange(20)
    control: Any = SimpleNamespace(rate=100)
    assert instant_rows(record_of(times, {"target.a": 0 * times + 0.1}), control).tolist() == [0, 5, 10, 15]


@pytest.mark.drill
@pytest.mark.parametrize("changes", [{"heavier": 1.1}, {"lost": 0.9}])
def test_another_robot_is_no_softness(judge: Judge, changes: dict[str, float]) -> None:
    """A heavier link and lost efforts leave more than friction within its bounds may, and are accused."""
    judged = judge(log_of(0.5, loss=0.1, **changes), loss=0.1)
    assert [layer.name for layer in judged.layers if not layer.holds] == ["acceleration"]
