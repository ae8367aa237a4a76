"""Laws of a joint beside a contact in closed form: the truth and the projection method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from feet_on_rails import foot_on_rail

from proofroll.core.events import Event
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.truth_of_mechanism import truth_of

PROJECTION = load_engine("projection")
SLOWED = 0.2 * 1.5 * 9.81 / 2  # m/s²


@dataclass(frozen=True)
class Path:
    """Places of the cart [m], forces that are named (friction, stop or effort), and all events."""

    places: Any
    forces: Any
    events: tuple[Event, ...]


def by_truth(mechanism: Mechanism, times: list[float], _dt: float) -> Path:
    """The truth, whose bars are narrow."""
    found = truth_of(mechanism, np.array([0.0, *times]))
    assert np.isinf(found.horizon)
    assert max(float(bar[-1]) for bar in found.bars.values()) < 1e-9
    return Path(found.record.q[1:, 0], found.record.named[1:, 0], tuple(found.events))


def by_projection(mechanism: Mechanism, times: list[float], dt: float) -> Path:
    """The projection method at fixed steps."""
    run = PROJECTION.build(mechanism, replace(PROJECTION.presets["dependent"]["default"], dt=dt))
    samples = []
    for t in times:
        run.advance(t)
        samples.append(run.sample())
    (rail, _), efforts = mechanism.joints, bool(mechanism.actuators)
    forces = [sample.effort[0] if efforts else sample.friction[0] if rail.friction else sample.stop[0]
              for sample in samples]  # fmt: skip
    return Path(np.array([sample.p_WB[0, 0] for sample in samples]), np.array(forces), tuple(run.events()))


Follow = Callable[[Mechanism, list[float], float], Path]
BOTH = pytest.mark.parametrize("follow", [by_truth, by_projection])


def happened(path: Path, *expected: str, at: float) -> None:
    """Asserts that these events happen, all at one time [s]."""
    assert [f"{event.kind} {event.name}" for event in path.events] == list(expected)
    assert [event.time for event in path.events] == pytest.approx([at] * len(expected), abs=1e-12)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.drill_of("by_truth")
@BOTH
def test_friction_of_a_joint_and_of_a_contact_stop_a_foot(follow: Follow) -> None:
    """A rail and a floor that rub together slow a foot by the sum of their frictions, and hold it where it stops."""
    path, slowed = follow(foot_on_rail(friction=2.0), [0.1, 0.5], 1e-2), SLOWED + 2.0 / 2
    assert path.places == pytest.approx([0.1 - slowed * 0.1**2 / 2, 1 / slowed / 2], abs=1e-12)
    assert path.forces[0] == pytest.approx(-2.0, abs=1e-10)
    assert follow is not by_truth or np.isnan(path.forces[1])  # what rail and floor hold together is anybody's
    happened(path, "rest sole", "stick rail", at=1 / slowed)


@pytest.mark.drill
@pytest.mark.one_in(2)
@BOTH
def test_a_foot_that_slides_rebounds_from_a_stop(follow: Follow) -> None:
    """A stop returns half of the speed, and friction at the foot turns with it."""
    path = follow(foot_on_rail(limits=(-1.0, 0.1), restitution=0.5), [0.3], 1e-2)
    hit = (1 - np.sqrt(1 - 2 * SLOWED * 0.1)) / SLOWED
    back, left = 0.5 * (1 - SLOWED * hit), 0.3 - hit
    assert path.places == pytest.approx([0.1 - back * left + SLOWED * left**2 / 2], abs=1e-12)
    happened(path, "impact rail", "turn sole", at=hit)


@pytest.mark.drill
@pytest.mark.one_in(2)
@BOTH
def test_a_smooth_foot_is_pressed_against_a_stop(follow: Follow) -> None:
    """A stop that returns nothing bears what pulls the foot on."""
    path = follow(foot_on_rail(limits=(-1.0, 0.1), sole=0.0, pull=3.0), [0.3], 1e-2)
    assert path.places == pytest.approx([0.1], abs=1e-12)
    assert path.forces == pytest.approx([-2.0 * 3.0], abs=1e-9)
    happened(path, "impact rail", at=(np.sqrt(1 + 2 * 3.0 * 0.1) - 1) / 3.0)


@pytest.mark.one_in(2)
@pytest.mark.drill
@BOTH
def test_a_limit_of_an_effort_is_not_stepped_across(follow: Follow) -> None:
    """A force that grows in time up to its limit, within a step, moves a foot by a cubic, then by a parabola."""
    push, left = Actuator("push", "rail", "torque", target=Formula("20*t"), limit=4.0), 0.04
    path = follow(replace(foot_on_rail(), actuators=(push,)), [0.12, 0.24], 0.03)
    moved = [t - SLOWED * t**2 / 2 for t in (0.12, 0.24)]
    moved[0] += 10 * 0.12**3 / 6
    moved[1] += 10 * (0.2**3 / 6 + 0.2**2 / 2 * left) + 2.0 * left**2 / 2
    assert path.places == pytest.approx(moved, abs=1e-13)
    assert path.forces == pytest.approx([2.4, 4.0], abs=1e-12)


@pytest.mark.drill
def test_a_stop_and_a_floor_that_rubs_share_a_load() -> None:
    """Where friction holds a foot beside a stop only the sum of both is unique: it is what pulls."""
    mechanism = foot_on_rail(limits=(-1.0, 0.1), pull=3.0)
    run = PROJECTION.build(mechanism, replace(PROJECTION.presets["dependent"]["default"], dt=1e-2))
    run.advance(0.3)
    sample = run.sample()
    assert sample.p_WB[0, 0] == pytest.approx(0.1, abs=1e-12)
    assert sample.stop[0] + sample.contact_force[0, 0] == pytest.approx(-6.0, abs=1e-9)
