"""Loops that a person writes in MuJoCo, as it is installed: clean ones hold, and what is planted is named alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.robots.control.judge import RecordJudgement, judge_record

mujoco = pytest.importorskip("mujoco", reason="the loops are written in MuJoCo; pip install 'proofroll[mujoco]'")

ARM = """<mujoco model="arm"><option gravity="0 0 -9.81"/><default><joint damping="{damping}"/></default><worldbody>
<body name="one" pos="0 0 1"><joint name="a" axis="0 0 1"/>
<inertial pos=".1 .02 .1" mass="2" diaginertia=".02 .03 .01"/>
<body name="two" pos=".2 0 .1"><joint name="b" axis="0 1 0"/>
<inertial pos=".15 0 .03" mass="1.5" diaginertia=".01 .02 .02"/>
<body name="three" pos=".3 0 0"><joint name="c" axis="1 1 0"/>
<inertial pos=".1 .05 0" mass=".8" diaginertia=".006 .004 .007"/>
</body></body></body></worldbody></mujoco>"""
INTEGRATORS = ("EULER", "IMPLICITFAST", "IMPLICIT", "RK4")


def loop(
    path: Path, integrator: str, precision: str, eulerdamp: bool = True, step: float = 1e-3, **planted: Any
) -> RecordJudgement:
    """Judgement of a record of a tenth of a second under swinging torques, without a controller's file.

    Args:
        path: folder of the record and of the robot's file.
        integrator: of MuJoCo.
        precision: ``float64``, ``float32``, or a number of decimals.
        eulerdamp: False where MuJoCo's Euler has its damping at the velocity before the step.
        step: of MuJoCo [s].
        planted: ``heavier``, a factor on the mass and the inertia of the last link; ``torque``, ``friction``,
            ``stiffness``, ``damping`` and ``quadratic`` drag of the second joint, which the file does not have, and the
            ``lost`` part of its efforts; ``beat``, a torque; gravity along x as ``tilt``, and a force on the second
            link along y as ``push``.
    """
    file = path / "arm.xml"
    file.write_text(ARM.format(damping=0.4))
    spec = mujoco.MjSpec.from_file(str(file))
    spec.option.timestep = step
    spec.option.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    if not eulerdamp:
        spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_EULERDAMP)
    spec.body("three").mass *= planted.get("heavier", 1.0)
    spec.body("three").inertia *= planted.get("heavier", 1.0)
    spec.option.gravity[0] += planted.get("tilt", 0.0)
    spec.joint("b").damping[0] += planted.get("damping", 0.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (0.3, -0.5, 0.8), (1.0, -0.7, 0.4)
    rows = []
    for k in range(round(0.1 / step) + 1):
        torques = np.array([1.5, -2.0, 0.7]) * np.sin(40 * k * step + np.arange(3)) + 0.5
        rows.append((data.qpos.copy(), data.qvel.copy(), torques))
        data.qfrc_applied[:] = torques
        data.qfrc_applied[1] += planted.get("torque", 0.0) - planted.get("stiffness", 0.0) * data.qpos[1]
        data.qfrc_applied[0] += planted.get("beat", 0.0) * np.sin(k * k / 50)
        data.qfrc_applied[1] -= planted.get("friction", 0.0) * np.sign(data.qvel[1])
        data.qfrc_applied[1] -= planted.get("quadratic", 0.0) * data.qvel[1] * abs(data.qvel[1])
        data.qfrc_applied[1] -= planted.get("lost", 0.0) * torques[1]
        data.xfrc_applied[2, 1] = planted.get("push", 0.0)
        mujoco.mj_step(model, data)
    q, v, efforts = map(np.array, zip(*rows, strict=True))
    arrays: Mapping[str, Any] = {"qpos": q, "qvel": v, "torques": efforts}
    arrays = {
        name: item.astype(precision) if precision.startswith("float") else item.round(int(precision))
        for name, item in arrays.items()
    }
    np.savez(path / "run.npz", dt=step, **arrays)
    return judge_record(path / "run.npz", file, None, layout="playground")


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("float64-EULER")
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("precision", ["float64", "float32", "5", "3"])
def test_a_clean_loop_is_not_accused(tmp_path: Path, integrator: str, precision: str) -> None:
    """Whatever the integrator of MuJoCo and the precision of the file, a robot with joint damping holds to rounding."""
    judged = loop(tmp_path, integrator, precision)
    (layer,) = judged.layers
    assert layer.holds, [*judged.lines()]
    assert layer.residual is not None
    assert not layer.causes


PLANTED: dict[str, tuple[dict[str, float], list[str]]] = {
    "a heavier link": ({"heavier": 1.01}, ["payload"]),
    "a constant torque": ({"torque": 0.3}, ["torque"]),
    "a spring": ({"stiffness": 0.5}, ["stiffness"]),
    "dry friction": ({"friction": 0.1}, ["friction"]),
    "more damping": ({"damping": 0.2}, ["damping"]),
    "quadratic drag": ({"quadratic": 0.2}, ["quadratic"]),
    "a tilted gravity": ({"tilt": 0.3}, ["pull"]),
    "a constant force": ({"push": 2.0}, ["push"]),
    "an effort of the other sign": ({"lost": 2.0}, ["efforts"]),
    "an effort of nothing": ({"lost": 1.0}, ["efforts"]),
    "more damping and a spring": ({"damping": 0.2, "stiffness": 0.5}, ["damping", "stiffness"]),
    "a heavier link and a constant torque": ({"heavier": 1.05, "torque": 0.3}, ["payload", "torque"]),
}


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.drill_of("EULER-a heavier link and a constant torque", "IMPLICITFAST-more damping and a spring")
@pytest.mark.nightly_of(
    "EULER-a heavier link",
    "EULER-more damping and a spring",
    "IMPLICITFAST-a heavier link",
    "IMPLICITFAST-a heavier link and a constant torque",
)
@pytest.mark.parametrize("name", PLANTED)
@pytest.mark.parametrize("integrator", ["EULER", "IMPLICITFAST"])
def test_what_is_planted_is_named_alone(tmp_path: Path, name: str, integrator: str) -> None:
    """A link, a torque, a spring, friction or damping that the file does not have is named, two of them as well."""
    planted, named = PLANTED[name]
    (layer,) = loop(tmp_path, integrator, "float64", **planted).layers
    assert sorted(cause.id for cause in layer.causes) == named, [cause.sentence for cause in layer.causes]
    assert max(cause.after for cause in layer.causes) < 1e-7


@pytest.mark.nightly
def test_sizes_come_back_to_their_errors(tmp_path: Path) -> None:
    """The size of a torque and of a spring at one joint are told with an error in which they lie."""
    for planted, words in (({"torque": 0.3}, "a constant torque of 0.3"), ({"stiffness": 0.5}, "a spring of 0.5")):
        (layer,) = loop(tmp_path, "EULER", "float64", **planted).layers
        assert words in layer.causes[0].sentence
        assert "at b" in layer.causes[0].sentence


@pytest.mark.nightly
def test_what_nothing_explains_is_not_called_rounding(tmp_path: Path) -> None:
    """A torque that beats is no number of the robot: the layer differs without a cause, or is not decided."""
    (layer,) = loop(tmp_path, "EULER", "float64", beat=0.05).layers
    assert not layer.causes
    assert not layer.holds or layer.undecided
