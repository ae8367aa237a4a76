"""The truth with bounded friction against published digits, closed forms and itself."""

import re
from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr

from proofroll import load_scene
from proofroll.core.dataset import ENDED
from proofroll.core.events import Event, events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.ball_on_surface.element import rolling_ball, scene_with
from proofroll.truth.ball_on_surface import implicit, taylor
from proofroll.truth.ball_on_surface import stick_slip as module
from proofroll.truth.ball_on_surface.contact import ContactRates
from proofroll.truth.ball_on_surface.implicit import Implicit
from proofroll.truth.ball_on_surface.polar import Polar
from proofroll.truth.ball_on_surface.route import Path
from proofroll.truth.ball_on_surface.stick_slip import first_route, stick_slip
from proofroll.truth.ball_on_surface.switching import follow

PAPER: dict[str, float] = {"rolling_resistance": 5e-4, "mu_static": 0.35}

# scene parameters, end [s], events [s], height at the end [m]
KNOWN: dict[str, tuple[dict[str, float], float, list[float], float | None]] = {
    "slow": ({"speed": 2, "mu_static": 0.35}, 0.3, [0.2166732], None),
    "slow, resisted": ({"speed": 2, **PAPER}, 0.3, [0.20720339], None),
    "paper": (PAPER, 4.0, [1.720183172, 2.00812799, 2.44969538], -2.2976587),
    "fast, resisted": ({"speed": 6, **PAPER}, 3.5, [3.36617197], None),
    "recovers": ({"mu_static": 0.15}, 0.75, [0.176667992, 0.412090574, 0.628116731, 0.710311323], None),
    "falls": ({"mu_static": 0.12}, 3.0, [0.14413074], -2.7869160),
}
# Times [s] at which tests look at the paper's case besides: around the first slip, at the events, and after them.
BEGIN = 1.7201831716243
AROUND = np.array([BEGIN - 1e-9, BEGIN + 1e-3, BEGIN + 2e-3])
AT_EVENTS = np.array(KNOWN["paper"][2])
LATER = np.linspace(2.5, 4.0, 301)


def cylinder(tilt: float = 0.0, **parameters: float) -> Scene:
    """The paper's scene with other parameters, its axis tilted from the vertical [rad]."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    return scene_with(scene, surface=replace(scene.elements[0].surface, tilt=tilt))


def events(route: Any, scene: Scene, until: float) -> list[tuple[str, float]]:
    """Kind and time [s] of the events that a route finds."""
    return list(follow(rolling_ball(scene), route, until).events)


@cache
def known(name: str) -> tuple[xr.Dataset, list[Event]]:
    """The truth of a case, once for all tests."""
    parameters, until, *_ = KNOWN[name]
    more = np.concatenate([AROUND, AT_EVENTS, LATER]) if name == "paper" else []
    return stick_slip(cylinder(**parameters), np.union1d(np.linspace(0.0, until, 31), more))


def paper_at(times: np.ndarray) -> xr.Dataset:
    """The truth of the paper's case at some of its times."""
    dataset, _ = known("paper")
    return dataset.isel(time=np.searchsorted(dataset.time.to_numpy(), times))


@pytest.mark.parametrize("name", KNOWN)
def test_known_digits(name: str) -> None:
    """Every published event comes out to 1e-7 s and every height to 1e-6 m, in order, with honest error bars."""
    _, _, times, height = KNOWN[name]
    dataset, found = known(name)
    assert [event.kind for event in found] == ["slip", "stick", "slip", "stick"][: len(times)]
    assert [event.time for event in found] == pytest.approx(times, abs=1e-7, rel=0)
    for event in found:
        assert event.time_low <= event.time <= event.time_high < event.time_low + 1e-9
    assert dataset.z.error_bar < 1e-9
    if height is not None:
        assert float(dataset.z[-1]) == pytest.approx(height, abs=1e-6)


def test_state_at_the_events_of_the_paper() -> None:
    """At the three events of the paper's case the whole state has the known digits; the bounds are their last ones."""
    dataset = paper_at(AT_EVENTS)
    state = [float(dataset[name][0]) for name in ("gamma", "z", "gamma_rate", "z_rate", "omega1")]
    assert state == pytest.approx([28.02160251, -0.15342234, 13.44828166, -0.39505144, -101.7254881], rel=4e-8)
    assert dataset.z.to_numpy()[1:] == pytest.approx([-0.16707603, -0.18606792], abs=1e-8)
    assert float(dataset.z_rate[1]) == pytest.approx(0.23922279, abs=1e-8)


@pytest.mark.drill
def test_start_of_slip_does_not_matter() -> None:
    """No event and no end point moves when what takes the place of a start of slip varies over a decade or more."""
    scene = cylinder(**PAPER)
    body = rolling_ball(scene)
    routes: list[Any] = [Implicit(body, first_step=length) for length in (0.02, 0.2)]
    routes += [Polar(body, handover=1e-4)]
    if taylor.library.available():
        routes += [taylor.SlidingTaylor(body, handover=size) for size in (1e-7, 1e-6, 1e-5, 1e-4)]
    paths: list[Path] = [follow(body, route, 2.5) for route in routes]
    reference = [time for _, time in paths[0].events]
    ends = [path.motion(np.array([2.5]), "").p_WB[0] for path in paths]
    for path, end in zip(paths, ends, strict=True):
        assert [time for _, time in path.events] == pytest.approx(reference, abs=1e-9, rel=0)
        assert end == pytest.approx(ends[0], abs=1e-9)


def test_the_same_answer_with_scipy_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without heyoka another first route gives the same events and path."""
    scene, times = cylinder(mu_static=0.15, mu_kinetic=0.14), np.linspace(0.0, 0.75, 7)
    with_any, found = stick_slip(scene, times)
    monkeypatch.setattr(taylor, "supports", lambda _: False)
    assert isinstance(first_route(rolling_ball(scene)), Polar)
    with_scipy, again = stick_slip(scene, times)
    assert [event.time for event in again] == pytest.approx([event.time for event in found], abs=1e-10, rel=0)
    np.testing.assert_allclose(with_scipy.p_WB, with_any.p_WB, atol=1e-10)


def test_heyoka_is_chosen_only_where_its_equations_hold() -> None:
    """Taylor series are used on the vertical cylinder, and not where the resistance changes direction by a jump."""
    if not taylor.library.available():
        pytest.skip("heyoka is not installed")
    assert isinstance(first_route(rolling_ball(cylinder(**PAPER))), taylor.SlidingTaylor)
    assert isinstance(first_route(rolling_ball(cylinder(tilt=1.2, mu_static=0.3))), taylor.SlidingTaylor)
    assert isinstance(first_route(rolling_ball(cylinder(tilt=1.2, **PAPER))), Polar)
    plane = load_scene("inclined_plane", rolling_resistance=1e-3, mu_static=0.3)
    assert isinstance(first_route(rolling_ball(plane)), Polar)


def test_many_short_slips_settle() -> None:
    """Between the two boundaries every oscillation slips once, ever more briefly, and the sequence is never cut."""
    pytest.importorskip("heyoka")
    scene = cylinder(mu_static=0.15)
    found = events(first_route(rolling_ball(scene)), scene, 30.0)
    slips, sticks = ([t for kind, t in found if kind == wanted] for wanted in ("slip", "stick"))
    lengths = np.diff(np.stack([slips[: len(sticks)], sticks]), axis=0)[0]
    assert len(slips) > 45
    assert np.all(np.diff(lengths) < 0)
    assert lengths[-1] < 0.1 * lengths[0]
    second = events(Implicit(rolling_ball(scene)), scene, 3.0)
    assert [t for _, t in second] == pytest.approx([t for _, t in found[: len(second)]], abs=1e-9, rel=0)


def test_jump_to_a_lower_kinetic_friction() -> None:
    """With μk < μs the friction drops at once from μs N to μk N, and the ball sticks again later than with μk = μs."""
    scene = cylinder(**PAPER, mu_kinetic=0.3)
    dataset, found = stick_slip(scene, np.array([0.0, BEGIN - 1e-9, BEGIN + 1e-9, 1.9, 2.1]))
    assert found[0].time == pytest.approx(1.720183172, abs=1e-7)
    assert found[1].time > 2.00812799 + 0.01
    assert dataset.needed_friction.to_numpy()[1:4] == pytest.approx([0.35, 0.3, 0.3], abs=1e-6)
    assert dataset.sticking.to_numpy()[:4].tolist() == [True, True, False, False]


def test_slip_starts_against_the_friction() -> None:
    """At a grazing onset the slip starts along -F of the sticking ball and grows with the square of time."""
    dataset = paper_at(AROUND)
    force, slip = (np.stack([dataset[f"{name}2"], dataset[f"{name}3"]]) for name in ("F", "slip"))
    against = -force[:, 0] / np.linalg.norm(force[:, 0])
    sizes = np.linalg.norm(slip, axis=0)
    assert against @ slip[:, 1] / sizes[1] == pytest.approx(1.0, abs=1e-5)
    assert sizes[2] / sizes[1] == pytest.approx(4.0, rel=0.01)


def test_energy_goes_into_slip_and_rolling() -> None:
    """The energy falls by the work of slip μk N |u| and of rolling resistance N f ω, and by nothing else."""
    dataset = paper_at(LATER)
    slip = np.hypot(dataset.slip2, dataset.slip3)
    v2, v3 = 0.2 * dataset.gamma_rate, dataset.z_rate
    rolled = (v2 * (v2 - dataset.slip2) + v3 * (v3 - dataset.slip3)) / np.hypot(v2, v3)  # a ω along the path
    rolling = 5e-4 / 0.025 * rolled
    power = (dataset.N * (0.35 * slip + rolling)).to_numpy()
    simpson = (power[0] + power[-1] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum()) * 0.005 / 3
    assert float(dataset.energy[0] - dataset.energy[-1]) == pytest.approx(simpson, rel=1e-8)


def test_without_friction_the_ball_falls_freely() -> None:
    """With μ = 0 there is one slip, at once, and the height is that of free fall."""
    with np.errstate(divide="raise", invalid="raise"):
        dataset, found = stick_slip(cylinder(mu_static=0.0, mu_kinetic=0.0), np.linspace(0, 2, 5))
    assert [(event.kind, event.time) for event in found] == [("slip", 0.0)]
    np.testing.assert_allclose(dataset.z, -0.5 * 9.81 * dataset.time**2, atol=1e-11)
    assert float(abs(dataset.F3).max()) == 0.0


def test_slip_passes_through_zero_without_sticking() -> None:
    """Where |u| comes to zero but the needed force is outside the cone, the ball goes on slipping, the other way."""
    scene = cylinder(speed=4.6, mu_static=0.07, radial_spin=320.0)
    body = rolling_ball(scene)
    path = follow(body, first_route(body), 1.5)
    turns = [stretch.end for stretch in path.stretches[:-1]]
    assert [kind for kind, _ in path.events] == ["slip"]
    assert len(turns) == 3
    dataset, _ = stick_slip(scene, np.array([turns[0] - 1e-3, turns[0] + 1e-3]))
    assert float(dataset.slip3[0] * dataset.slip3[1]) < 0
    assert float(dataset.F3[0] * dataset.F3[1]) < 0


def test_sliding_down_a_plane() -> None:
    """On a plane steeper than (7/2) μ the ball slips from the start with the acceleration g (sin α - μ cos α)."""
    scene = load_scene("inclined_plane", tilt=0.6, mu_static=0.1, speed=0.0, cross_speed=0.0)
    dataset, found = stick_slip(scene, np.linspace(0, 1, 3))
    assert [event.kind for event in found] == ["slip"]
    acceleration = 9.81 * (np.sin(0.6) - 0.1 * np.cos(0.6))
    np.testing.assert_allclose(dataset.down, 0.5 * acceleration * dataset.time**2, atol=1e-11)


def test_resistance_brings_a_ball_to_rest() -> None:
    """On a level plane the ball stops after V0² / (2 · (5/7) g f / a) and stays, without a division by zero."""
    scene = load_scene("inclined_plane", tilt=0.0, mu_static=0.3, rolling_resistance=1e-3, speed=0.3, cross_speed=0.4)
    with np.errstate(divide="raise", invalid="raise"):
        dataset, found = stick_slip(scene, np.array([0.0, 1.0, 3.0, 4.0]))
    slowing = 5 / 7 * 9.81 * 1e-3 / 0.025
    distance = 0.25 / (2 * slowing)
    np.testing.assert_allclose(np.hypot(dataset.down, dataset.across)[2:], distance, atol=1e-9)
    assert found == []
    assert not np.any(dataset.v_WB[2:])
    assert bool(dataset.sticking.all())


@pytest.mark.parametrize("resistance", [pytest.param(0.0, marks=pytest.mark.drill), 5e-4])
def test_leaving_the_wall(resistance: float) -> None:
    """In a lying cylinder a slow ball leaves the wall where N = 0 and flies; its truth ends at the landing."""
    scene = cylinder(tilt=1.3, speed=2.0, mu_static=0.5, rolling_resistance=resistance)
    _, found = stick_slip(scene, np.array([0.0, 0.3]))
    assert [event.kind for event in found][-1] == "lift_off"
    leaving = found[-1].time
    dataset, _ = stick_slip(scene, np.array([leaving - 1e-6, leaving + 0.01, leaving + 0.02]))
    assert abs(float(dataset.N[0])) < 1e-4
    assert float(dataset.gap[2]) > float(dataset.gap[1]) > 0
    acceleration = np.diff(dataset.v_WB[1:], axis=0)[0] / 0.01
    np.testing.assert_allclose(acceleration, [0, 0, -9.81], atol=1e-8)
    cut, again = stick_slip(scene, np.array([0.0, leaving + 0.01, leaving + 2.0]))
    assert re.search(r"lands at t = 0\.\d+ s; a restitution law would be needed", cut.attrs[ENDED])
    assert cut.sizes["time"] == 2
    assert [event.kind for event in again] == [event.kind for event in found]
    np.testing.assert_allclose(cut.p_WB[1], dataset.p_WB[1], rtol=0, atol=1e-11)


def test_truth_carries_events() -> None:
    """The truth of a scene with bounded friction holds mode and events; that of any other scene is as before."""
    bounded = truth(cylinder(**PAPER), np.array([0.0, 1.8, 2.1]))
    assert [event.kind for event in events_of(bounded)] == ["slip", "stick"]
    assert bounded.sticking.to_numpy().tolist() == [True, False, True]
    assert all("error_bar" in values.attrs for name, values in bounded.data_vars.items() if "event" not in str(name))
    unbounded = truth(cylinder(), np.array([0.0, 1.0]))
    assert "sticking" not in unbounded
    assert events_of(unbounded) == []


def test_grip_that_is_enough_changes_nothing() -> None:
    """Above (12/7) g c / V0² the truth with bounded friction is the closed form of rolling without slip."""
    times = np.linspace(0, 2, 5)
    bounded, unbounded = truth(cylinder(mu_static=0.2103), times), truth(cylinder(), times)
    assert events_of(bounded) == []
    np.testing.assert_allclose(bounded.p_WB, unbounded.p_WB, atol=1e-11)


def test_no_time_at_all() -> None:
    """A run that ends at time 0 is its initial state, in both modes."""
    for mu, sticking in ((0.35, True), (0.01, False)):
        dataset, _ = stick_slip(cylinder(mu_static=mu), np.array([0.0]))
        assert dataset.sticking.to_numpy().tolist() == [sticking]
        assert dataset.needed_friction.to_numpy() == pytest.approx([min(mu, 2 / 7 * 9.81 * 0.2 / 16)])


def test_disagreement_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the two routes tell different stories, only what happens before that is told."""
    monkeypatch.setattr(module, "in_common", lambda *_: (1, False))
    dataset = truth(cylinder(mu_static=0.15), np.linspace(0.0, 0.5, 6))
    assert [event.kind for event in events_of(dataset)] == ["slip"]
    assert dataset.attrs["ill_posed"].endswith("the two routes to the truth disagree about it")


EPS = float(np.finfo(float).eps)


@pytest.mark.arithmetic
@pytest.mark.parametrize("part", [0.0, 1e-12])
def test_friction_that_just_suffices_on_an_incline_is_ill_posed(part: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """At μ = (2/7) tan(tilt) rolling and slipping are a relative 1e-9 of μ apart, whatever round-off makes of it."""
    monkeypatch.setattr(taylor, "supports", lambda _: False)  # to compile takes as long as ten truths
    edge = 2 / 7 * float(np.tan(load_scene("inclined_plane").parameters["tilt"]))
    scene = load_scene("inclined_plane", mu_static=edge * (1 + part))
    assert "a relative 1e-09 of friction" in truth(scene, np.linspace(0, 0.5, 3)).attrs["ill_posed"]


@pytest.mark.drill
@pytest.mark.parametrize(
    "beside",
    # All of them take three minutes, so that other kinds of arithmetic try some.
    [
        pytest.param(range(-20, 21), id="all", marks=pytest.mark.nightly),
        pytest.param((-20, -1, 0, 1, 20), id="some", marks=pytest.mark.arithmetic),
    ],
)
@pytest.mark.parametrize(("factor", "known"), [(1.0, ["slip"]), (12 / 7, [])])
def test_between_two_regimes_the_answer_is_ill_posed(factor: float, known: list[str], beside: Iterable[int]) -> None:
    """At each μ within round-off of g c/V0² and (12/7) g c/V0² the truth says the same: that it hangs."""
    edge, said = factor * 9.81 * 0.2 / 16, set()
    for k in beside:
        dataset = truth(cylinder(mu_static=edge * (1 + k * EPS)), np.linspace(0, 1, 11))
        assert [event.kind for event in events_of(dataset)] == known
        assert np.isfinite(dataset.z.attrs["error_bar"])
        said.add(dataset.attrs["ill_posed"])
    assert len(said) == 1
    assert "a relative 1e-09 of friction, resistance or gravity changes it" in said.pop()
    for part in (-1e-6, 1e-6):
        near = truth(cylinder(mu_static=edge * (1 + part)), np.linspace(0, 1, 11))
        assert "last digits" not in near.attrs.get("ill_posed", "")  # the first slip hangs on what μ is known to


@pytest.mark.parametrize(
    ("parameters", "until", "kinds"), [({"mu_static": 0.15}, 4.0, 14), ({"speed": 100.0, "mu_static": 2e-4}, 0.1, 15)]
)
def test_long_sequences(
    parameters: dict[str, float], until: float, kinds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A slip takes the second route some fifty steps and eighty Jacobians, which are what it costs."""
    counted = {"steps": 0, "jacobians": 0}
    take, jacobian = implicit.take, ContactRates._jacobian

    def counting(*arguments: Any) -> Any:
        counted["steps"] += 1
        return take(*arguments)

    def counting_too(*arguments: Any) -> Any:
        counted["jacobians"] += 1
        return jacobian(*arguments)

    monkeypatch.setattr(implicit, "take", counting)
    monkeypatch.setattr(ContactRates, "_jacobian", counting_too)
    body = rolling_ball(cylinder(**parameters))
    assert len(follow(body, Implicit(body), until).events) == kinds
    assert counted["steps"] < 53 * kinds
    assert counted["jacobians"] < 81 * kinds


def test_a_long_stretch_is_handed_to_a_compiled_series(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long the ball rolls, collocation makes a bounded number of steps, and events and path stay the same."""
    if not taylor.library.available():
        pytest.skip("heyoka is not installed")
    body, times = rolling_ball(cylinder(speed=10.0, mu_static=0.03)), np.linspace(0.0, 2.0, 7)
    steps, take = [0], implicit.take

    def counting(*arguments: Any) -> Any:
        steps[-1] += 1
        return take(*arguments)

    monkeypatch.setattr(implicit, "take", counting)
    paths = []
    for many in (10**9, 3):
        monkeypatch.setattr(implicit, "_MANY", many)
        paths.append(follow(body, Implicit(body), 2.0))
        steps.append(0)
    (kinds, found), (others, again) = (zip(*path.events, strict=True) for path in paths)
    assert kinds == others
    assert len(kinds) > 1
    assert again == pytest.approx(found, abs=1e-11, rel=0)
    assert steps[1] < steps[0] - 20
    whole, handed = (path.motion(times, "") for path in paths)
    for name in ("p_WB", "v_WB", "w_WB", "force"):
        np.testing.assert_allclose(getattr(handed, name), getattr(whole, name), rtol=1e-10, atol=1e-10)
