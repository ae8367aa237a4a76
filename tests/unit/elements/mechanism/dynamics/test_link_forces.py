"""Forces of springs and bushings, and work of drives, as results: closed forms, in truth and engines."""

from typing import Any

import mechanism_runs as runs
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.elements.mechanism import Body, Joint, Mechanism, Spring
from proofroll.elements.mechanism.dynamics.link_forces import sampled_works
from proofroll.elements.mechanism.run.dataset import from_samples
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.plug_in import MechanismTruth

TIMES = np.linspace(0.0, 1.0, 41)
BODY = Body("b", 2.0, inertia=((0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)))
SLIDE: dict[str, Any] = {"name": "j", "kind": "prismatic", "parent": "world", "child": "b", "axis": (1, 0, 0)}


def of_truth(mechanism: Mechanism) -> Any:
    """Dataset of the truth."""
    return MechanismTruth.truth(MechanismElement(mechanism), TIMES, ())


def hung() -> Mechanism:
    """A mass of 2 kg that swings by 0.1 m along x on a spring of 50 N/m, given half by its stiffness."""
    spring = Spring("s", "world", "b", (-1.0, 0, 0), stiffness=25.0, length=1.0, force=SpringLaw("25*(L - 1)"))
    return Mechanism((BODY,), (Joint(**SLIDE, q0=(0.1,)),), springs=(spring,), gravity=(0, 0, 0))


def pull(times: FloatArray) -> FloatArray:
    """Pull of the spring of :func:`hung` [N]."""
    return 5.0 * np.cos(5.0 * times)


@pytest.mark.drill
def test_the_pull_of_a_spring_is_that_of_the_oscillator() -> None:
    """The force of a spring is k times its stretch, positive where it pulls, with a bar near round-off."""
    found = of_truth(hung())["force.s"]
    assert np.max(np.abs(found.to_numpy() - pull(TIMES))) < 1e-12
    assert 0 < found.attrs["error_bar"] < 1e-11


@pytest.mark.parametrize("formulation", ["joints", "redundant", "null_space", "dependent"])
def test_engines_have_the_pull_of_a_spring(formulation: str) -> None:
    """The force of a spring follows from an engine's own motion."""
    element, run, samples = MechanismElement(hung()), runs.build(formulation, hung()), []
    for time in TIMES[:5]:
        run.advance(float(time))
        samples.append(run.sample())
    found = from_samples(element, TIMES[:5], samples).variables["force.s"].values
    assert np.max(np.abs(found - pull(TIMES[:5]))) < {"redundant": 1e-3}.get(formulation, 1e-4)


@pytest.mark.drill
def test_the_load_of_a_bushing_acts_on_its_second_body() -> None:
    """A bushing pushes with −k x along and −k θ about an axis of its frame, along the axes of the world."""
    turn = 0.5
    start = (0.1, 0, 0, np.cos(turn / 2), 0, np.sin(turn / 2), 0)
    bushing = Bushing("m", "world", "b", stiffness=(30.0, 1, 1, 0, 4.0, 0), damping=(2.0, 0, 0, 0, 0.5, 0))
    joint = Joint("j", "free", "world", "b", q0=start, v0=(0, 0, 0, 0, 0.4, 0))
    content = of_truth(Mechanism((BODY,), (joint,), bushings=(bushing,), gravity=(0, 0, 0)))
    assert content["force.m.x"].to_numpy()[0] == pytest.approx(-3.0, abs=1e-12)
    assert content["torque.m.y"].to_numpy()[0] == pytest.approx(-4.0 * turn - 0.5 * 0.4, abs=1e-12)
    acceleration = np.gradient(content["v_WB"].to_numpy()[:, 0, 0], TIMES, edge_order=2)
    assert np.max(np.abs(content["force.m.x"].to_numpy() - 2.0 * acceleration)[1:-1]) < 0.02
    assert content["bushing_forces"].shape == (len(TIMES), 1, 3)


def test_a_bushing_needs_a_name_of_its_own() -> None:
    """Forces of joints and bushings are named alike, so that one name for both is refused."""
    with pytest.raises(InputError, match="used twice"):
        Mechanism((BODY,), (Joint(**SLIDE),), bushings=(Bushing("j", "world", "b"),))


@pytest.mark.drill
def test_the_work_of_a_motor_is_energy_and_losses() -> None:
    """A constant push F against a damper c works F x, to its bar near round-off."""
    push, damping = 3.0, 4.0
    motor = Actuator("m", "j", "torque", push)
    mechanism = Mechanism((BODY,), (Joint(**SLIDE, damping=damping),), gravity=(0, 0, 0), actuators=(motor,))
    found = of_truth(mechanism)["work.effort.m"]
    rate = damping / BODY.mass
    path = push / damping * (TIMES - (1 - np.exp(-rate * TIMES)) / rate)
    assert np.max(np.abs(found.to_numpy() - push * path)) < found.attrs["error_bar"] < 1e-11


@pytest.mark.drill
def test_the_work_of_a_motion_is_the_energy_that_it_gives() -> None:
    """The drive of a prescribed motion works as much as the kinetic energy of the mass that it moves."""
    mechanism = Mechanism((BODY,), (Joint(**SLIDE, motion=Formula("0.1*(1 - cos(6*t))")),), gravity=(0, 0, 0))
    found = of_truth(mechanism)["work.drive.j"]
    energy = 0.5 * BODY.mass * (0.6 * np.sin(6 * TIMES)) ** 2
    assert np.max(np.abs(found.to_numpy() - energy)) < found.attrs["error_bar"] < 1e-11


def test_a_run_sums_its_work_with_the_error_of_that() -> None:
    """Simpson's rule over samples has an error that the change by every other sample bounds; it is the run's own."""
    power = np.sin(20.0 * TIMES)[:, None]
    work, error = sampled_works(TIMES, power)
    apart = np.abs(work[:, 0] - (1.0 - np.cos(20.0 * TIMES)) / 20.0).max()
    assert apart < error[0] < 1e-2


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 40])
def test_work_over_samples_is_that_of_scipy(count: int) -> None:
    """Simpson's rule without scipy, whose import is slow, has scipy's numbers at any number and spacing of samples."""
    random = np.random.default_rng(count)
    times, power = np.cumsum(random.uniform(0.1, 1.0, count)), random.normal(size=(count, 3))
    expected = cumulative_simpson(power, x=times, axis=0, initial=0.0) if count > 1 else np.zeros((1, 3))
    np.testing.assert_allclose(sampled_works(times, power)[0], expected, rtol=1e-13, atol=1e-13)
