"""Work of drives in the truth of a mechanism: closed forms, at every sample and by every sampling."""

from typing import Any

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.studies.judging.reference import Reference
from proofroll.truth.work_of_drives import works_of_steps

LIFT, G = 0.2, 9.80665  # m/s, m/s²
TIMES = np.linspace(0.0, 0.4, 9)


def plate_and_ball() -> Scene:
    """A ball of 1 kg falls 0.1 m on a plate of 1 kg that is driven upward, and stays on it."""
    bodies = (Body("plate", 1.0, inertia=(0.1, 0.1, 0.1)), Body("ball", 1.0, inertia=(0.004, 0.004, 0.004)))
    joints = (
        Joint("shake", "prismatic", "world", "plate", axis=(0, 0, 1), motion=Formula(f"{LIFT}*t")),
        Joint("fall", "prismatic", "world", "ball", axis=(0, 0, 1), q0=(0.2,)),
    )
    shapes = (Geometry("floor", "plate", "plane"), Geometry("skin", "ball", "sphere", radius=0.1))
    pairs = (Pair("touch", ("skin", "floor"), friction=0.0),)
    mechanism = Mechanism(bodies, joints, gravity=(0, 0, -G), geometries=shapes, pairs=pairs)
    return Scene("plate", "", (MechanismElement(mechanism),))


def lifting(times: FloatArray) -> FloatArray:
    """Work of the plate's drive in :func:`plate_and_ball` by hand [J]: weights, and the impulse that the ball takes."""
    struck = (np.sqrt(LIFT**2 + 0.2 * G) - LIFT) / G
    behind = np.maximum(times - struck, 0.0)
    return np.where(times < struck, 0.0, (G * struck + LIFT) * LIFT) + G * LIFT * (times + behind)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("count", [3, 9])
def test_an_impulse_works_by_the_rate_of_its_drive(count: int) -> None:
    """Behind an impact the work of a drive is that of its force and of its impulse, whatever samples are asked for."""
    times = np.linspace(0.0, 0.4, count)
    found = truth(plate_and_ball(), times, ())["work.drive.shake"]
    assert np.max(np.abs(found.to_numpy() - lifting(times))) < found.attrs["error_bar"] < 1e-11


@pytest.mark.drill
def test_a_run_is_compared_up_to_the_first_impact() -> None:
    """A run sums its work over samples, which have no impulse: behind the first impact no value is compared."""
    scene = plate_and_ball()
    found = truth(scene, TIMES, ())
    compared = Reference.of(scene, found).determinate["work.drive.shake"]
    (struck, *_) = found["event_time"].to_numpy()
    assert 0.0 < struck < TIMES[-1]
    assert np.array_equal(compared, TIMES[1:] < struck)


@pytest.mark.drill
def test_a_motor_at_its_stop_works_by_its_path_alone() -> None:
    """A finite torque does no work in an impact: behind a stop its work is torque times angle."""
    hub = Body("hub", 1.0, inertia=(0.5, 0.5, 0.5))
    joint = Joint("axle", "revolute", "world", "hub", axis=(0, 0, 1), limits=(-1.0, 0.1))
    motor = Actuator("motor", "axle", "torque", 2.0)
    scene = Scene("", "", (MechanismElement(Mechanism((hub,), (joint,), actuators=(motor,), gravity=(0, 0, 0))),))
    found: Any = truth(scene, np.linspace(0.0, 0.5, 6), ())
    work, angle = found["work.effort.motor"], found["q.axle"].to_numpy()
    assert angle[-1] == pytest.approx(0.1, abs=1e-12)
    assert np.max(np.abs(work.to_numpy() - 2.0 * angle)) < work.attrs["error_bar"] < 1e-11


def test_round_off_of_a_power_is_not_halved_without_end() -> None:
    """Where a half resolves a power no better than the whole does, the rest is noise, and in the bar of the work."""
    slide = Joint("x", "prismatic", "world", "m", axis=(1, 0, 0), motion=Formula("t"))
    mechanism, asked = Mechanism((Body("m", 1.0, inertia=(1, 1, 1)),), (slide,)), list[int]()

    def powers(states: FloatArray) -> FloatArray:
        asked.append(len(states))
        return 1 + 1e-10 * np.sin(1e9 * states[:, :1])

    step = 0.0, 1.0, lambda times: times[None]
    works, unresolved = works_of_steps(mechanism, [step], powers, np.array([0.0, 1.0]))
    assert abs(works[-1, 0] - 1) <= 2e-10
    assert 0 < unresolved[-1, 0] < 1e-9
    assert sum(asked) < 1000
