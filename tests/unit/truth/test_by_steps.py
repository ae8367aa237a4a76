"""Reference by steps: contacts under held targets, which the truth does not follow."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll import Refused, simulate
from proofroll.core import plugins
from proofroll.core.columns import Variable
from proofroll.core.dataset import BARS, BY_STEPS, ENDED, ENDS, HORIZON, bar_until
from proofroll.core.engine_abilities import Steps, stepped
from proofroll.core.errors import Diverged, Missing
from proofroll.core.pace import PACE, OutOfTime
from proofroll.core.scene import Scene
from proofroll.core.truth import needs_steps
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.control import Control
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth import by_steps

pytest.importorskip("pinocchio")
UNTIL = 0.12


def hopper(*, held: bool) -> Scene:
    """A ball on a vertical slide, pulled down on the floor by a servo whose target changes at 50 Hz or never."""
    slide = Joint("slide", "prismatic", "world", "ball", axis=(0, 0, 1), q0=(0.03,))
    servo = Actuator("servo", "slide", "position", 0.01, kp=40.0, kd=2.0)
    mechanism = Mechanism(
        (Body("ball", 1.0, (0.0, 0.0, 0.0), tuple(np.diag([1e-3] * 3).tolist())),),
        (slide,),
        actuators=(servo,),
        geometries=(Geometry("foot", "ball", "sphere", radius=0.02), Geometry("floor", "world", "plane")),
        pairs=(Pair("step", ("foot", "floor"), 0.5),),
        impacts="together",
        control=Control(50.0, ("servo",)) if held else None,
    )
    return Scene("hopper", "A ball that a servo presses on the floor", (MechanismElement(mechanism),))


@pytest.mark.drill
def test_the_reference_is_within_its_bar_of_the_truth() -> None:
    """Targets that never change are a motion that the truth knows: the reference by steps is near it, and says so."""
    truth, reference = (simulate(hopper(held=held), until=UNTIL) for held in (False, True))
    assert BY_STEPS not in truth.attrs
    assert "mujoco geoms, dt 1e-3 s, is within" in reference.attrs["second_route"]
    assert reference.attrs[BY_STEPS] == "pinocchio[formulation=impulses]"
    assert reference.attrs["route"].startswith("reference by steps of pinocchio impulses, dt 1e-3, 5e-4, 2.5e-4 s")
    error = float(np.abs(truth["p_WB"].values - reference["p_WB"].values).max())
    bar = float(reference["p_WB"].attrs["error_bar"])
    assert 0 < error <= bar < 1e-3
    for name in ("v_WB", "contact_forces"):  # which no two steps have alike beside a touch
        assert np.isinf(reference[name].attrs["error_bar"])


def test_steps_lie_between_instants() -> None:
    """The longest step is at most a millisecond, and divides the time between two instants."""
    (element,) = hopper(held=True).elements
    assert isinstance(element, MechanismElement)
    for rate, longest in ((50.0, 1e-3), (30.0, 1 / 30 / 34)):
        mechanism = replace(element.mechanism, control=Control(rate, ("servo",)))
        assert by_steps._steps(MechanismElement(mechanism)) == pytest.approx([longest, longest / 2, longest / 4])


def test_without_its_engine_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the engine of the steps is not installed, the refusal says what is missing."""

    def missing(name: str) -> Any:
        raise Missing(f"{name} is not installed here")

    monkeypatch.setattr(plugins, "load_engine", missing)
    with pytest.raises(Refused, match="held targets yet, and no installed engine that represents it declares"):
        simulate(hopper(held=True), until=0.01)


def test_steps_that_diverge_are_named() -> None:
    """Where a run of the steps ends early, the reason says whose, and with which step."""
    (element,) = hopper(held=True).elements
    assert isinstance(element, MechanismElement)
    (servo,) = element.mechanism.actuators
    mechanism = replace(element.mechanism, actuators=(replace(servo, kd=1e9),))
    with pytest.raises(Diverged, match=r"the steps of pinocchio impulses, dt 1e-3 s end: the state is not finite"):
        by_steps.reference_by_steps(
            MechanismElement(mechanism), np.linspace(0, UNTIL, 13), ["pinocchio[formulation=impulses]"]
        )


def test_the_first_exact_claim_is_the_reference() -> None:
    """Of those that represent a scene: an exact cone and a hard contact, with a witness of another engine."""
    exact, convex, soft = Steps(True, True), Steps(False, True), Steps(True, False)
    declared = {
        "soft": ({"springs": soft}, {"springs": {"contact", "motors"}}),
        "lame": ({"cones": exact}, {"cones": {"contact"}}),
        "hard": ({"cones": exact, "also": convex}, {"cones": {"contact", "motors"}, "also": {"contact", "motors"}}),
        "other": ({"cones": exact}, {"cones": {"contact", "motors"}}),
        "silent": ({}, {"cones": {"contact", "motors"}}),
    }
    assert stepped(declared, {"contact", "motors"}) == ["hard[formulation=cones]", "soft[formulation=springs]"]
    assert stepped({"soft": declared["soft"]}, {"contact"}) == []
    assert needs_steps(hopper(held=True))
    assert not needs_steps(hopper(held=False))


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("rungs", "words", "whole"), [(2, "dt 1e-3, 5e-4 s", True), (1, "dt 1e-3, 5e-4 s", False)])
def test_a_limit_keeps_the_runs_that_it_has(
    rungs: int, words: str, whole: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With two whole runs the reference is the second; with one it ends where the second one was."""
    counts = [UNTIL / 1e-3, UNTIL / 5e-4, UNTIL / 2.5e-4]
    limit = sum(counts[:rungs]) + counts[rungs] / 2

    def reached(count: float) -> None:
        if count > limit:
            raise OutOfTime("its limit was reached", count)

    monkeypatch.setattr(PACE, "reached", reached)
    run = simulate(hopper(held=True), until=UNTIL)
    assert words in run.attrs["route"]
    assert run.sizes["time"] == (13 if whole else 8)
    assert (ENDED in run.attrs) is not whole


@pytest.mark.parametrize(
    ("apart", "change", "words", "end"),
    [
        ([0, 1e-4, 2e-4, 3e-4], [0, 0, 0, 0], "1 mm to the end, 10 mm to the end", None),
        ([0, 5e-4, 5e-3, 9e-3], [0, 0, 0, 0], "1 mm until 0.1 s, 10 mm to the end", None),
        ([0, 1e-4, 1e-4, 1e-4], [0, 5e-4, 5e-4, 5e-3], "1 mm until 0 s, 10 mm until 0.2 s", 0.3),
        ([0, 1e-4, 2e-2, 3e-2], [0, 0, 0, 0], "1 mm until 0.1 s, 10 mm until 0.1 s", 0.2),
    ],
)
def test_a_reference_ends_at_its_horizon(
    apart: list[float], change: list[float], words: str, end: float | None
) -> None:
    """Where twins part by a centimetre, or shorter steps still change a third of it, nothing is judged any more."""
    whole = xr.Dataset({"x": ("time", np.arange(4.0))}, coords={"time": 0.1 * np.arange(4)})
    cut = by_steps._to_horizon(whole, np.array(apart), np.array(change))
    assert words in cut.attrs[HORIZON]
    assert cut.attrs.get(ENDS) == (None if end is None else pytest.approx(end))
    assert cut.sizes["time"] == (4 if end is None else round(end / 0.1))


def test_the_bar_grows_in_time() -> None:
    """Three times the largest last change so far: the length of a vector, of two quaternions the nearer sign."""
    times = np.array([0.0, 0.1, 0.2, 0.3])
    moved = np.array([[0, 0, 0], [3e-3, 0, 4e-3], [1e-3, 0, 0], [0, 6e-3, 8e-3]])
    places = Variable(("time", "xyz"), np.zeros((4, 3)), {"units": "m"})
    attrs = by_steps._bars("p", places, places._replace(values=moved), times)
    assert [bar_until(attrs, time) for time in (0.0, 0.05, 0.1, 0.25, 9.0)] == pytest.approx(
        [0, 0, 15e-3, 15e-3, 30e-3]
    )
    assert attrs["error_bar"] == pytest.approx(30e-3)
    assert len(attrs[BARS]) == 6
    turned = Variable(("time", "wxyz"), np.tile([1.0, 0, 0, 0], (4, 1)), {"units": "1"})
    assert by_steps._bars("q", turned, turned._replace(values=-turned.values), times)["error_bar"] == 0
    speeds = places._replace(attrs={"units": "m/s"})
    assert by_steps._bars("v", speeds, speeds, times) == {"error_bar": np.inf}
    assert by_steps._bars("time", Variable(("time",), times), Variable(("time",), times), times) == {}
    assert bar_until({"error_bar": 2.0}, 0.1) == 2.0
    assert bar_until({}, 0.1) == np.inf


def test_a_reference_is_known_as_well_as_before_its_horizon() -> None:
    """What is behind the horizon does not widen the bar of what is told."""
    attrs = {"error_bar": 9.0, BARS: [0.0, 1.0, 0.1, 2.0, 0.3, 9.0]}
    whole = xr.Dataset({"x": ("time", np.arange(4.0), attrs)}, coords={"time": 0.1 * np.arange(4)})
    cut = by_steps._to_horizon(whole, np.array([0, 1e-4, 2e-2, 3e-2]), np.zeros(4))
    assert cut["x"].attrs["error_bar"] == 2.0


@pytest.mark.drill
def test_twins_of_a_pressed_ball_stay_together() -> None:
    """Twins start a tenth of a millimetre apart and come to rest on the same floor."""
    pytest.importorskip("mujoco")
    attrs = simulate(hopper(held=True), until=0.05).attrs
    assert "1 mm to the end, 10 mm to the end" in attrs[HORIZON]
