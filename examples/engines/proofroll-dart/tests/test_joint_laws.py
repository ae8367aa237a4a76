"""Servos, limits of efforts, dry friction and stops of DART's joints; bodies that touch are refused."""

import numpy as np
import pytest
from proofroll_dart import Dart

import proofroll
from proofroll.adapter import Refused, require_provided


@pytest.mark.parametrize(
    ("name", "error"), [("servo", 0.02), ("saturated_servo", 0.01), ("stop", 0.01), ("friction_hold", 1e-9)]
)
def test_laws_are_those_of_the_scene(name: str, error: float) -> None:
    """After 0.5 s at a step of 1 ms a mass is where it should be, as far as a first-order step brings it."""
    scene = proofroll.load_scene(name)
    engine = Dart.build(scene, Dart.presets["world"]["default"])
    engine.advance(0.5)
    truth = proofroll.simulate(scene, until=0.5, every=0.5)
    assert np.max(np.abs(engine.sample().p_WB - truth["p_WB"].to_numpy()[1])) < error


@pytest.mark.parametrize(("name", "reason"), [("arm_pd", "no inertia of their own"), ("gear_pair", "no mimic joints")])
@pytest.mark.parametrize("formulation", ["world", "forward_dynamics"])
def test_what_it_has_not_is_refused_with_the_reason(formulation: str, name: str, reason: str) -> None:
    """Armature and couplings are refused before anything is built."""
    with pytest.raises(Refused, match=reason):
        require_provided(Dart, formulation, proofroll.load_scene(name))


def test_equations_without_steps_have_no_stops() -> None:
    """Laws that switch are not among the capabilities of the formulation that scipy integrates."""
    assert not proofroll.load_scene("stop").requires <= Dart.provides["forward_dynamics"]


@pytest.mark.parametrize("formulation", ["world", "forward_dynamics"])
def test_bodies_that_touch_are_refused(formulation: str) -> None:
    """Contact between bodies is refused with what DART lacks."""
    with pytest.raises(proofroll.Refused, match=r"contact between bodies.*pyramid"):
        proofroll.simulate("falling_rod", f"dart[formulation={formulation}]", until=0.1, every=0.1)
