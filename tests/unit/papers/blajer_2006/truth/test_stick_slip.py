"""Slips of a ball in an upright cylinder: the route that finds first slips against the truth, and known digits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from proofroll import load_scene
from proofroll.core import heyoka_library as library
from proofroll.core.events import events_of
from proofroll.core.truth import truth
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.truth.polar import Polar, first_route
from proofroll.papers.blajer_2006.truth.regimes import Path, follow
from proofroll.papers.blajer_2006.truth.sliding import Sliding
from proofroll.papers.blajer_2006.truth.taylor import SlidingTaylor
from proofroll.truth.plug_in import MechanismTruth

PAPER: dict[str, float] = {"rolling_resistance": 5e-4, "mu_static": 0.35}
UNTIL = 4.0
needs_heyoka = pytest.mark.skipif(not library.available(), reason="heyoka is not installed")


def ball(**parameters: float) -> RollingBall:
    """The paper's ball with other parameters."""
    return rolling_ball(load_scene("sphere_in_cylinder", **parameters))


@pytest.fixture(scope="module")
def paper() -> xr.Dataset:
    """The truth of the paper's case with resistance and bounded friction, once for all tests."""
    return truth(load_scene("sphere_in_cylinder", **PAPER), np.linspace(0.0, UNTIL, 401))


def final_height(path: Path, route: Sliding) -> float:
    """Height at the end of a path [m]."""
    return float(route.world(path.stretches[-1].state)[0][2])


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(
    "route", [pytest.param(SlidingTaylor, marks=needs_heyoka), pytest.param(Polar, marks=pytest.mark.drill)]
)
def test_the_route_of_first_slips_agrees_with_the_truth(route: Any, paper: xr.Dataset) -> None:
    """Events and final height are those of the general mechanics, which shares no equation with it, to 1e-9."""
    body, true = ball(**PAPER), paper
    taken = route(body)
    path, events = follow(body, taken, UNTIL), events_of(true)
    assert [kind for kind, _ in path.events] == [event.kind for event in events] == ["slip", "stick", "slip"]
    assert [time for _, time in path.events] == pytest.approx([event.time for event in events], abs=1e-9, rel=0)
    assert final_height(path, taken) == pytest.approx(float(true["z"][-1]), abs=1e-9)


@pytest.mark.nightly
def test_a_truth_goes_on_where_a_slip_begins_with_less_friction() -> None:
    """At millimetres per second after the slip of 1.72 s, kinetic friction below static keeps Coulomb's law."""
    scene = load_scene("sphere_in_cylinder", speed=4.0, mu_static=0.35, mu_kinetic=0.33, rolling_resistance=5e-4)
    true = truth(scene, np.array([0.0, 1.7203, 1.721]))
    assert "ended" not in true.attrs
    assert 0 < float(true["slips"][1, 0]) < 0.01
    assert float(np.abs(true["natural_map"]).max()) < 1e-9


@needs_heyoka
@pytest.mark.nightly
@settings(max_examples=5, deadline=None)
@given(
    speed=st.floats(2.0, 5.0),
    mu=st.floats(0.1, 0.5),
    ratio=st.floats(0.6, 1.0),
    f=st.sampled_from([0.0, 2e-4, 5e-4]),
    spin=st.floats(-20.0, 20.0),
)
def test_random_slips_agree_with_the_truth(speed: float, mu: float, ratio: float, f: float, spin: float) -> None:
    """The same of random balls, also where friction drops as the ball begins to slip."""
    parameters = {"speed": speed, "mu_static": mu, "mu_kinetic": ratio * mu, "radial_spin": spin}
    scene = load_scene("sphere_in_cylinder", **parameters, rolling_resistance=f)
    true = truth(scene, np.linspace(0.0, 1.0, 11))
    if "ill_posed" in true.attrs:
        return
    body = rolling_ball(scene)
    route = first_route(body)
    path = follow(body, route, 1.0)
    later = [(kind, time) for kind, time in path.events if time > 0]  # the truth counts a slip at once to its start
    events = events_of(true)
    assert [kind for kind, _ in later] == [event.kind for event in events]
    assert [time for _, time in later] == pytest.approx([event.time for event in events], abs=1e-9, rel=0)
    assert final_height(path, route) == pytest.approx(float(true["z"][-1]), abs=1e-9)


# Scene parameters, end [s], events [s], height at the end [m].
KNOWN: dict[str, tuple[dict[str, float], float, list[float], float | None]] = {
    "slow": ({"speed": 2, "mu_static": 0.35}, 0.3, [0.2166732], None),
    "slow, resisted": ({"speed": 2, **PAPER}, 0.3, [0.20720339], None),
    "paper": (PAPER, 4.0, [1.720183172, 2.00812799, 2.44969538], -2.2976587),
    "fast, resisted": ({"speed": 6, **PAPER}, 3.5, [3.36617197], None),
    "recovers": ({"mu_static": 0.15}, 0.75, [0.176667992, 0.412090574, 0.628116731, 0.710311323], None),
    "falls": ({"mu_static": 0.12}, 3.0, [0.14413074], -2.7869160),
}


@pytest.mark.one_in(3)
@pytest.mark.nightly_of("paper", "fast, resisted", "recovers")
@pytest.mark.drill
@pytest.mark.parametrize("name", KNOWN)
def test_known_digits(name: str) -> None:
    """In the truth every published event comes out to 1e-7 s and every height to 1e-6 m, in narrow brackets."""
    parameters, until, times, height = KNOWN[name]
    found = truth(load_scene("sphere_in_cylinder", **parameters), np.linspace(0.0, until, 31))
    events = events_of(found)
    assert [event.kind for event in events] == ["slip", "stick", "slip", "stick"][: len(times)]
    assert [event.time for event in events] == pytest.approx(times, abs=1e-7, rel=0)
    assert all(event.time_low <= event.time <= event.time_high < event.time_low + 1e-9 for event in events)
    assert found["z"].attrs["error_bar"] < 1e-9
    if height is not None:
        assert float(found["z"][-1]) == pytest.approx(height, abs=1e-6)


def test_state_at_the_first_slip_of_the_paper() -> None:
    """Where the paper's ball first slips its state has the known digits; the bounds are their last ones."""
    body = ball(**PAPER)
    end, motion = first_route(body).rolling(1.8)
    p, v, w = (values[-1] for values in _state(motion(np.array([1.0, end]))))
    frame = body.surface.frame(body.surface.locate(p))
    assert end == pytest.approx(1.720183172, abs=1e-9)
    state = [p[2], v @ frame[:, 1] / 0.2, v[2], w @ frame[:, 0]]
    assert state == pytest.approx([-0.15342234, 13.44828166, -0.39505144, -101.7254881], rel=4e-8)


def _state(motion: Any) -> tuple[Any, Any, Any]:
    return motion.p_WB, motion.v_WB, motion.w_WB


@pytest.mark.nightly
def test_start_of_slip_does_not_matter() -> None:
    """No event and no end point moves when what takes the place of a start of slip varies over a decade or more."""
    body = ball(**PAPER)
    routes: list[Any] = [Polar(body), Polar(body, handover=1e-4)]
    if library.available():
        routes += [SlidingTaylor(body, handover=size) for size in (1e-7, 1e-6, 1e-5, 1e-4)]
    paths = [follow(body, route, 2.5) for route in routes]
    for route, path in zip(routes[1:], paths[1:], strict=True):
        assert [time for _, time in path.events] == pytest.approx([time for _, time in paths[0].events], abs=1e-9)
        assert final_height(path, route) == pytest.approx(final_height(paths[0], routes[0]), abs=1e-9)


@needs_heyoka
def test_many_short_slips_settle() -> None:
    """Between the two boundaries every oscillation slips once, ever more briefly, and the sequence is never cut."""
    body = ball(mu_static=0.15)
    found = follow(body, SlidingTaylor(body), 30.0).events
    slips, sticks = ([time for kind, time in found if kind == wanted] for wanted in ("slip", "stick"))
    lengths = np.diff(np.stack([slips[: len(sticks)], sticks]), axis=0)[0]
    assert len(slips) > 45
    assert np.all(np.diff(lengths) < 0)
    assert lengths[-1] < 0.1 * lengths[0]


@pytest.mark.drill
def test_the_published_digits_of_the_article_law(paper: xr.Dataset) -> None:
    """The paper's ball slips, sticks, slips and falls at the digits that an independent solver has, to the last one."""
    events = [event.time for event in events_of(paper)]
    assert events == pytest.approx([1.720183172, 2.008127990, 2.449695383], abs=1e-9, rel=0)
    assert float(paper["z"][-1]) == pytest.approx(-2.297658694, abs=1e-9)


@pytest.mark.nightly
def test_resistance_against_turning_falls_elsewhere() -> None:
    """By the law of bodies the first slip is the same, the second 8 ms later, and the fall 38 mm deeper, to 1e-6."""
    (element,) = load_scene("sphere_in_cylinder", **PAPER).elements
    assert isinstance(element, MechanismElement)
    pairs = tuple(replace(pair, against="turning") for pair in element.mechanism.pairs)
    turning = MechanismElement(replace(element.mechanism, pairs=pairs), local=element.local)
    true = MechanismTruth.truth(turning, np.array([0.0, UNTIL]), ())
    events = [event.time for event in events_of(true)]
    assert events == pytest.approx([1.720183172, 2.0080917395, 2.4576800619], abs=1e-9, rel=0)
    assert float(true["z"][-1]) == pytest.approx(-2.3359491272, abs=1e-9)


@pytest.mark.drill
def test_state_at_the_events_of_the_paper() -> None:
    """Where the ball sticks and slips again its height and speed have the known digits; the bounds are their last."""
    times = np.array([0.0, 2.00812799, 2.44969538])
    true = truth(load_scene("sphere_in_cylinder", **PAPER), times)
    assert true["z"].to_numpy()[1:] == pytest.approx([-0.16707603, -0.18606792], abs=1e-8)
    assert float(true["z_rate"][1]) == pytest.approx(0.23922279, abs=1e-8)


def test_energy_goes_into_slip_and_rolling(paper: xr.Dataset) -> None:
    """While it slips the energy falls by the work of slip μk N |u| and of rolling resistance, and no other.

    The resistance takes N f ω along the path of the centre.
    """
    later = paper.sel(time=slice(2.495, 4.001))
    slip = np.hypot(later["slip2"], later["slip3"])
    v2, v3 = 0.2 * later["gamma_rate"], later["z_rate"]
    rolled = (v2 * (v2 - later["slip2"]) + v3 * (v3 - later["slip3"])) / np.hypot(v2, v3)  # a ω along the path
    power = (later["N"] * (0.35 * slip + 5e-4 / 0.025 * rolled)).to_numpy()
    simpson = (power[0] + power[-1] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum()) * 0.01 / 3
    assert len(power) % 2 == 1
    assert float(later["energy"][0] - later["energy"][-1]) == pytest.approx(simpson, rel=1e-6)
