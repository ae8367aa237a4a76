"""The longest step that servos allow."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from servo_robots import servo_robot

from proofroll import compare, judge, simulate
from proofroll.core.element_abilities import step_bound
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.step_limits import ServoSteps, servo_steps
from proofroll.elements.mechanism.scene.drives import Actuator, Coupling
from proofroll.report.comparison.summary import outcome_content
from proofroll.report.terminal.verdicts import verdict_parts


def sliders(kp: float, kd: float, masses: tuple[float, ...] = (2.0,), gear: float = 1.0, **more: object) -> Mechanism:
    """Sliders beside each other, the first with a position servo."""
    names = [f"s{number}" for number in range(len(masses))]
    inertia = ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1))
    return Mechanism(
        bodies=tuple(
            Body(name=name, mass=mass, com=(0, 0, 0), inertia=inertia) for name, mass in zip(names, masses, strict=True)
        ),
        joints=tuple(Joint(name=name, kind="prismatic", parent="world", child=name, axis=(1, 0, 0)) for name in names),
        actuators=(Actuator("servo", "s0", "position", kp=kp, kd=kd, gear=gear),),
        gravity=(0, 0, 0),
        **more,  # type: ignore[arg-type]
    )


def bounds(mechanism: Mechanism) -> ServoSteps:
    """Its bounds, of which there are some."""
    found = servo_steps(JointCoordinates(mechanism))
    assert found is not None
    return found


def radius(kp: float, kd: float, mass: float, h: float, *, implicit: bool) -> float:
    """Spectral radius of the step map of a slider with a servo."""
    m = mass + h * kd if implicit else mass
    row = np.array([-h * kp / m, 1 - h * kd / m])
    return float(np.abs(np.linalg.eigvals([[1 + h * row[0], h * row[1]], row])).max())


@pytest.mark.parametrize(("kp", "kd"), [(800.0, 0.0), (800.0, 20.0), (3.0, 400.0), (1e5, 900.0)])
def test_a_slider_is_stable_up_to_its_bound(kp: float, kd: float) -> None:
    """The step map of a servo has spectral radius 1 at the bound, less below and more above, explicit and implicit."""
    found = bounds(sliders(kp, kd))
    for h, implicit in ((found.explicit, False), (found.implicit, True)):
        assert radius(kp, kd, 2.0, 0.99 * h, implicit=implicit) < 1 + 1e-12
        assert radius(kp, kd, 2.0, 1.01 * h, implicit=implicit) > 1 + 1e-4


def test_gears_and_couplings_count() -> None:
    """A gear multiplies gains by its square, and a coupled mass adds to the inertia by the square of its ratio."""
    geared = bounds(sliders(800.0, 20.0, gear=3.0))
    assert geared.explicit == pytest.approx(bounds(sliders(7200.0, 180.0)).explicit, rel=1e-12)
    coupled = bounds(sliders(800.0, 20.0, (2.0, 0.5), couplings=(Coupling("belt", "s0", "s1", ratio=2.0),)))
    assert coupled.explicit == pytest.approx(bounds(sliders(800.0, 20.0, (4.0,))).explicit, rel=1e-12)


def test_words() -> None:
    """The clause names both bounds and the engines' steps; without servos there is none."""
    steps = ServoSteps(explicit=3.2e-4, implicit=4.6e-2)
    said = "explicit PD needs h ≤ 0.00032 s with these gains and masses (implicit kd: 0.046 s)"
    assert steps.sentence([]) == said
    assert steps.sentence([2.5e-4]) == f"{said}; you have 0.00025 s"
    assert steps.sentence([1e-3, 2e-3, 1e-3]) == f"{said}; you have 0.001 to 0.002 s, 6.2 times too much"
    assert "implicit" not in ServoSteps(1e-3, math.inf).sentence([])
    bare = sliders(1.0, 0.0)
    assert step_bound([MechanismElement(bare), object()]).startswith("explicit PD needs h ≤ 2.8 s")
    without = MechanismElement(Mechanism(bodies=bare.bodies, joints=bare.joints, gravity=(0, 0, 0)))
    assert step_bound([without]) == ""


@pytest.mark.nightly
def test_every_verdict_begins_with_it(tmp_path: Path) -> None:
    """Comparisons, runs and judgements of a scene with servos have the clause, a comparison above its rows."""
    pytest.importorskip("pinocchio")
    outcome = compare("servo", ["pinocchio[formulation=null_space,dt=0.004]"], out=tmp_path, until=0.2, every=0.1)
    content = outcome_content(outcome)
    assert (
        content.step_bound
        == "explicit PD needs h ≤ 0.16 s with these gains and masses (implicit kd: 0.24 s); you have 0.004 s"
    )
    assert f"{content.step_bound}." in list(verdict_parts(content))
    run = simulate("servo", engine="pinocchio", until=0.1, every=0.1)
    assert "explicit PD needs h ≤ 0.16 s" in str(judge(run, "servo"))
    assert outcome_content(compare("pendulum", ["pinocchio"], out=tmp_path, until=0.2, every=0.1)).step_bound == ""


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(("name", "armature"), [("solo12", 0.0), ("solo12", 5e-4), ("g1", 0.0), ("g1", 0.01)])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_robots_blow_up_at_the_bound(name: str, armature: float, integrator: str) -> None:
    """A robot on its servos rests at 0.9 of the bound and blows up at 1.1 of it, with and without armature."""
    mujoco = pytest.importorskip("mujoco")
    from proofroll.engines.mujoco.settings import MujocoSettings
    from proofroll.engines.mujoco.smooth.mechanism_model import write

    robot = servo_robot(name, armature)
    found = bounds(robot)
    bound = found.explicit if integrator == "Euler" else found.implicit
    speeds = []
    for part in (0.9, 1.1):
        settings = MujocoSettings("joints", "tuned", dt=part * bound, integrator=integrator)  # type: ignore[arg-type]
        model = write(robot, settings).compile()
        data = mujoco.MjData(model)
        for actuator in robot.actuators:
            data.qpos[model.joint(actuator.joint).qposadr[0]] = actuator.target
            data.ctrl[model.actuator(actuator.name).id] = actuator.target
        data.qvel[6:] = 1e-6 * np.random.default_rng(0).normal(size=model.nv - 6)
        for _ in range(400):
            mujoco.mj_step(model, data)
            if not np.all(np.abs(data.qvel) < 1.0):
                break
        speeds.append(float(np.nan_to_num(np.abs(data.qvel).max(), nan=np.inf)))
    assert speeds[0] < 1e-5
    assert speeds[1] > 1e-2
