"""Slip onset as a staircase: digits, edges, sensitivities and verdicts."""

import numpy as np
import pytest

from proofroll import load_scene
from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.truth.friction_curve import friction_curve
from proofroll.papers.blajer_2006.truth.onset import Onset, edge_between, first_slip, onset

FIFTIETH = 5e-4  # 0.02 a


def cylinder(**parameters: float) -> Scene:
    """The paper's case with other parameters."""
    return load_scene("sphere_in_cylinder", **{"rolling_resistance": FIFTIETH, "mu_static": 0.35, **parameters})


def slip_of(scene: Scene, until: float) -> float | None:
    """First slip of the ball of a scene [s]."""
    return first_slip(rolling_ball(scene), until)


def onset_of(scene: Scene, until: float, uncertainty: float = 1e-3) -> Onset:
    """First slip of the ball of a scene, and its conditioning."""
    return onset(rolling_ball(scene), until, uncertainty)


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"mu_static": 0.30}, 0.99076),
        ({"mu_static": 0.31}, 1.66515),
        ({"mu_static": 0.39}, 1.82306),
        ({"mu_static": 0.40}, 2.58296),
        ({"rolling_resistance": 0.011 * 0.025}, 3.16582),
        ({"rolling_resistance": 0.012 * 0.025}, 2.45101),
        ({"rolling_resistance": 0.016 * 0.025}, 2.46440),
        ({"rolling_resistance": 0.017 * 0.025}, 1.74152),
        ({"rolling_resistance": 0.027 * 0.025}, 1.73830),
        ({"rolling_resistance": 0.028 * 0.025}, 1.04819),
    ],
)
def test_stairs(parameters: dict[str, float], expected: float) -> None:
    """On both sides of each known jump the first slip has the known time."""
    assert slip_of(cylinder(**parameters), 4.0) == pytest.approx(expected, abs=1e-5)


@pytest.mark.nightly
def test_onset_is_the_first_event_of_the_truth() -> None:
    """The onset read off the curve of needed friction is where the truth begins to slip."""
    events = events_of(truth(cylinder(), np.array([0.0, 1.8])))
    assert slip_of(cylinder(), 4.0) == pytest.approx(events[0].time, abs=1e-10)


@pytest.mark.drill
def test_edge_separates_two_rises() -> None:
    """The edge between μ = 0.39 and 0.40, found to six digits (the bounds), is where the first slip jumps."""
    edge = edge_between(rolling_ball(cylinder()), 0.39, 0.40, 4.0)
    assert edge is not None
    before, after = (slip_of(cylinder(mu_static=edge + side), 4.0) for side in (-1e-6, 1e-6))
    assert before is not None
    assert after is not None
    assert after - before > 0.7
    assert onset_of(cylinder(), 4.0).edge_above == pytest.approx(edge, abs=1e-6)
    assert edge_between(rolling_ball(cylinder()), 0.35, 0.36, 4.0) is None


def test_sensitivities_are_derivatives() -> None:
    """The logarithmic sensitivities are those of nearby scenes."""
    base = onset_of(cylinder(speed=6.0), 4.0)
    step = 1e-4
    for name, value, found in (("mu_static", 0.35, base.by_mu), ("rolling_resistance", FIFTIETH, base.by_f)):
        high, low = (slip_of(cylinder(speed=6.0, **{name: value * np.exp(s)}), 4.0) for s in (step, -step))
        assert high is not None
        assert low is not None
        assert found == pytest.approx(np.log(high / low) / (2 * step), rel=1e-5)


def test_verdicts() -> None:
    """The paper's case stands in the middle of a stair; at an edge, or with a wide range, the onset is ill-posed."""
    middle = onset_of(cylinder(), 4.0, uncertainty=0.02)
    assert middle.verdict == "well-posed"
    assert middle.earliest is not None
    assert middle.latest is not None
    assert middle.earliest < 1.720183 < middle.latest
    assert onset_of(cylinder(), 4.0, uncertainty=0.15).verdict == "ill-posed"
    edge = middle.edge_above
    assert edge is not None
    at_edge = onset_of(cylinder(mu_static=round(edge, 6)), 4.0, uncertainty=1e-5)
    assert at_edge.verdict == "ill-posed"
    assert at_edge.distance < 2e-6
    assert at_edge.by_mu is None or at_edge.by_mu > 50


def test_no_slip_and_slip_at_once() -> None:
    """Above every crest there is no onset, below the first value it comes at time 0; both without sensitivities."""
    never = onset_of(cylinder(rolling_resistance=0.0), 4.0)
    assert (never.time, never.by_mu, never.verdict) == (None, None, "well-posed")
    assert never.edge_below == pytest.approx(12 / 7 * 9.81 * 0.2 / 16, rel=1e-9)
    assert onset_of(cylinder(mu_static=0.01), 4.0).time == 0.0


def test_curve_against_closed_form() -> None:
    """Without resistance the needed friction is (g c / V0²)(1 - (5/7) cos νt) and its only edge is its crest."""
    body = rolling_ball(cylinder(rolling_resistance=0.0))
    curve = friction_curve(body, 2.0)
    times = np.linspace(0, 2, 50)
    expected = 9.81 * 0.2 / 16 * (1 - 5 / 7 * np.cos(np.sqrt(2 / 7) * 20 * times))
    np.testing.assert_allclose(curve(times), expected, atol=1e-11)
    assert len(curve.edges()) == 1
    assert curve.crest_times[0] == pytest.approx(np.pi / (np.sqrt(2 / 7) * 20), abs=1e-6)


@pytest.mark.parametrize("uncertainty", [-0.1, 1.0, float("nan")])
def test_uncertainty_is_checked(uncertainty: float) -> None:
    """An uncertainty that is no fraction is refused with a sentence."""
    with pytest.raises(InputError, match="relative uncertainty"):
        onset_of(cylinder(), 4.0, uncertainty=uncertainty)
