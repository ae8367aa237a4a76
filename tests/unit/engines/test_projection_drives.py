"""Efforts with limits, and drives and targets in time, in the projection method."""

from dataclasses import replace
from typing import Any

import pytest
from one_coordinate import moved

from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.engines.projection.settings import PRESETS
from proofroll.engines.projection.smooth.mechanism import ProjectionMechanism

ONES = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))


def wheel(*actuators: Actuator, **more: Any) -> Mechanism:
    """A wheel of 1 kg m² on an axle."""
    joint = Joint("j", "revolute", "world", "b", orientation=(0, 0, 0.3), q0=(0.2,), v0=(0.5,), **more)
    return Mechanism((Body("b", 1.0, inertia=ONES),), (joint,), actuators=actuators, gravity=(0, 0, 0))


@pytest.mark.parametrize(("preset", "error"), [("default", 1e-5), ("matched", 1e-9)])
@pytest.mark.parametrize(
    "made",
    [
        wheel(Actuator("a", "j", "position", 3.0, kp=70.0, kd=5.0, gear=2.0, limit=9.0)),
        wheel(Actuator("a", "j", "velocity", 30.0, kd=5.0, limit=2.0)),
        wheel(Actuator("a", "j", "position", Formula("4*sin(7*t)"), kp=50.0, kd=2.0, limit=20.0)),
        wheel(torque=Formula("90*cos(9*t)")),
        wheel(torque=Table((0.0, 0.1, 0.4), (0.0, 90.0, -1.0))),
    ],
)
def test_efforts_are_those_of_each_stage(made: Mechanism, preset: str, error: float) -> None:
    """Clamped and varying efforts give the true motion, beyond a turn, and are told."""
    engine = ProjectionMechanism(made, PRESETS["dependent"][preset])
    engine.advance(0.2)
    found, (_, spin, efforts) = engine.sample(), moved(made, 0.2)
    assert found.w_WB[0, 2] == pytest.approx(spin, abs=20 * error)
    if made.actuators:
        assert found.effort == pytest.approx(efforts, abs=100 * error)


def test_what_is_not_followed_is_refused() -> None:
    """Compiled equations have their reason."""
    limited = Actuator("a", "j", "torque", 3.0, limit=2.0)
    compiled = replace(PRESETS["dependent"]["tuned"])
    with pytest.raises(Refused, match="not compiled"):
        ProjectionMechanism(wheel(limited), compiled)
