"""Equations of motion in a mode as a recorded program, held against the same solver's numpy."""

from typing import Any

import numpy as np
import pytest

from proofroll.engines.projection.contact.contact_modes import ContactMotion
from proofroll.engines.projection.contact.recorded_modes import RecordedMode
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import build

SLIPPERY = {"mu_static": 0.05, "mu_kinetic": 0.05}


def motion_of(scene: str, parameters: dict[str, Any], time: float) -> ContactMotion:
    """Motion of a scene's run of the projection solver at a time [s]."""
    run = build(load_scene(scene, **parameters), "projection[formulation=dependent,rtol=1e-9]")
    run.advance(time)
    motion = vars(run)["_touching"]
    assert isinstance(motion, ContactMotion)
    return motion


@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("scene", "parameters", "time"),
    [
        ("sphere_in_cylinder", {}, 0.1),
        ("sphere_in_cylinder", SLIPPERY, 0.1),
        ("sphere_in_cylinder", {"rolling_resistance": 5e-4}, 0.1),
        ("sphere_in_cylinder", {"rolling_resistance": 5e-4} | SLIPPERY, 0.1),
        ("rolling_stop", {}, 2.0),
        ("tilted_cylinder", {}, 0.1),
        ("torus_rim", {}, 0.1),
        ("sled_on_slope", {}, 0.1),
        ("two_spheres", {}, 0.05),
        ("cradle", {}, 0.1),
        ("bouncing_ball", {}, 0.1),
        ("eccentric_sphere", {}, 0.1),
        ("free_turntable", {}, 0.1),
    ],
)
def test_a_program_has_the_motion_of_numpy(scene: str, parameters: dict[str, Any], time: float) -> None:
    """Rates, forces and geometry of contacts are equal to round-off, in each mode, of one body or two."""
    motion = motion_of(scene, parameters, time)
    y = vars(motion)["_stepper"].x
    program = RecordedMode(vars(motion)["_mechanism"], motion.mode)
    recorded, expected = program.at(y, vars(motion)["_slipping"]), vars(type(motion))["_in_numpy"](motion, y)
    assert recorded is not None
    for ours, numpys in ((recorded.rates, expected.rates), (recorded.force, expected.force)):
        np.testing.assert_allclose(ours, numpys, rtol=0, atol=1e-11 * max(1.0, np.abs(numpys).max()))
    for point, other in zip(recorded.touching, expected.touching, strict=True):
        for part, number in zip(point[1:6], other[1:6], strict=True):
            np.testing.assert_allclose(part, number, rtol=0, atol=1e-12 * max(1.0, np.abs(number).max()))
        assert point.gap == pytest.approx(other.gap, abs=1e-14)


@pytest.mark.drill
def test_a_slip_without_a_direction_of_its_own_is_left_to_numpy() -> None:
    """A program says nothing of a slip that counts as rest, nor of one against its direction at the step's start."""
    motion = motion_of("sphere_in_cylinder", SLIPPERY, 0.1)
    y, slipping = vars(motion)["_stepper"].x, vars(motion)["_slipping"]
    program = RecordedMode(vars(motion)["_mechanism"], motion.mode)
    assert program.at(y, slipping) is not None
    toward = vars(slipping)["_toward"]
    toward[0] = -toward[0]
    assert program.at(y, slipping) is None


@pytest.mark.one_in(3)
@pytest.mark.parametrize("scene", ["sphere_in_cylinder", "bowl", "flick", "dominoes", "turntable", "tilted_disc"])
def test_mechanisms_with_few_plain_contacts_are_recorded(scene: str) -> None:
    """Few bodies with spheres on walls by formulas are, after some steps in a mode; drives, boxes and discs are not."""
    motion = motion_of(scene, {}, 0.1)
    assert bool(vars(motion)["_recorded"]) == (scene in {"sphere_in_cylinder", "bowl"})
