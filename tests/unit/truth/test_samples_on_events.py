"""Samples on an event: both routes give the value after it, so that no bar counts the jump."""

import numpy as np
import pytest

from proofroll.core.events import EventKind
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene
from proofroll.truth.truth_of_mechanism import truth_of

DOWN = np.array([-0.37208365159161944, -0.3438637275758072, -0.8621551444351054])


def dropped(restitution: float) -> Mechanism:
    """A ball 0.2 m above a turned floor, which it hits after 0.2 s."""
    start = tuple((-0.3 * DOWN).tolist())
    ball = Body("ball", 1.0, inertia=(0.004, 0.004, 0.004))
    joint = Joint("free", "free", "world", "ball", q0=(*start, 1.0, 0.0, 0.0, 0.0))
    normal = tuple((-DOWN).tolist())
    shapes = (Geometry("floor", "world", "plane", normal=normal), Geometry("skin", "ball", "sphere", radius=0.1))
    pairs = (Pair("touch", ("skin", "floor"), friction=0.3, restitution=restitution),)
    return Mechanism((ball,), (joint,), geometries=shapes, pairs=pairs, gravity=tuple((10 * DOWN).tolist()))


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("last_digits", [-3, -1, 0, 1, 3])
def test_a_sample_on_an_impact_has_the_velocity_after_it(last_digits: int) -> None:
    """A ball that rebounds by half on a turned floor is known as well there as anywhere else."""
    mechanism = dropped(0.5)
    (event,) = truth_of(mechanism, np.array([0.0, 0.3])).events
    sample = event.time + last_digits * float(np.spacing(event.time))
    found = truth_of(mechanism, np.array([0.0, sample, 0.3]))
    assert found.record.v_WB[1, 0] == pytest.approx(-DOWN, abs=1e-13)
    assert found.bars["v_WB"][-1] < 1e-12


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    "last_digits", [0, pytest.param(-1, marks=pytest.mark.drill), pytest.param(1, marks=pytest.mark.drill)]
)
def test_a_sample_on_an_impact_is_known_where_rebounds_are_summed_later(last_digits: int) -> None:
    """The motion with its rebounds cut early has the value after the impact, too, and no bar counts the jump."""
    sample = 0.2 + last_digits * float(np.spacing(0.2))
    found = truth_of(dropped(0.1), np.array([0.0, sample, 0.3]))
    assert any(event.kind == EventKind.SETTLE for event in found.events)
    assert found.bars["v_WB"][-1] < 1e-11


@pytest.mark.nightly
def test_a_sample_on_a_turn_of_a_slip_has_the_force_after_it() -> None:
    """Both routes give the friction of one side, so that its bar stays round-off, though friction jumps."""
    mechanism = the_mechanism(load_scene("falling_rod")).mechanism
    turn = next(event.time for event in truth_of(mechanism, np.array([0.0, 0.9])).events if event.kind == "turn")
    found = truth_of(mechanism, np.array([0.0, turn, 0.9]))
    assert found.pressed is not None
    assert found.pressed[1, 0, 0] < -0.5  # N
    assert found.bars["pressed"].max() < 1e-11


@pytest.mark.nightly
@pytest.mark.parametrize("last_digits", [-30, -1, 0, 1, 30])
def test_a_run_that_ends_on_a_slip_from_rest_has_all_before_it(last_digits: int) -> None:
    """A pushed box is known to the last time, whichever of its last digits lie before the slip that begins there."""
    mechanism = the_mechanism(load_scene("pushed_box", push=137.0)).mechanism
    slip = truth_of(mechanism, np.array([0.0, 0.6])).events[0].time
    end = slip + last_digits * float(np.spacing(slip))
    found = truth_of(mechanism, np.array([0.0, end / 2, end]))
    assert (found.ended, len(found.record.time)) == ("", 3)
    assert float(np.abs(found.record.v_WB).max()) < 1e-15
