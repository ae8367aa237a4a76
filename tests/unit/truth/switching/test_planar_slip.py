"""Slips that start from rest in any direction of a surface."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from placed_balls import placed
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.contact.modes import Acting
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.truth.numerics.picard import PicardSteps
from proofroll.truth.switching import contact_taylor, stopping_slip
from proofroll.truth.switching.planar_slip import LedValues, begun_slip
from proofroll.truth.truth_of_mechanism import truth_of
from proofroll_drill.referee.random_contacts import random_contacts

# s: of a ball that starts with 3 m/s in a cylinder, by its own truth
SLIPS, STICKS = 0.3220872132861903, 0.4999850902951998
NEAR = 2e-12  # s: error bars of that truth
# s: slips and ends of slips of one that starts with 4 m/s and friction of 0.15, by the same
GENTLE = (0.17666799150977489, 0.41209057382659164, 0.6281167309534607, 0.7103113246767829)


def ball_in_a_bore(speed: float, friction: float = 0.35) -> Mechanism:
    """The ball of the founding scene as body, sphere and bore."""
    scene = load_scene("sphere_in_cylinder", speed=speed)
    found, wall = rolling_ball(scene), placed(scene).surface  # type: ignore[attr-defined]
    moment, radius = float(found.ball.inertia), float(found.ball.radius)
    free = Joint(
        "free", "free", "world", "ball", q0=(*map(float, found.p0), 1.0, 0.0, 0.0, 0.0),
        v0=(*map(float, found.v0), *map(float, found.w0)),
    )  # fmt: skip
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=radius),
        Geometry("wall", "world", "bore", radius=float(wall.radius)),
    )
    body = Body("ball", float(found.ball.mass), inertia=(moment,) * 3)
    return Mechanism((body,), (free,), geometries=shapes, pairs=(Pair("touch", ("sphere", "wall"), friction),))


@pytest.mark.drill
def test_a_ball_slips_from_rest_and_sticks_when_its_own_truth_says() -> None:
    """Friction turns the slip of a ball in a cylinder; start, end and motion are known to round-off."""
    times = np.array([0.0, SLIPS + 1e-5, SLIPS + 4e-3, SLIPS + 6e-3, SLIPS + 1e-2, 0.52])
    found = truth_of(ball_in_a_bore(3.0), times)
    assert np.isinf(found.horizon)
    assert np.isinf(found.end)
    assert [event.kind for event in found.events] == ["slip", "stick"]
    for event, right in zip(found.events, (SLIPS, STICKS), strict=True):
        assert event.time_low - NEAR <= right <= event.time_high + NEAR
        assert event.time == pytest.approx(right, abs=1e-14)
    assert found.bars["p_WB"][-1] < 1e-13
    assert found.bars["v_WB"][-1] < 1e-12


@pytest.mark.nightly
def test_a_slip_that_slows_gently_ends_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its last instants take no step of its stiff direction, and end when the ball's own truth says."""
    taken, step = [0], PicardSteps.step

    def counted(steps: PicardSteps, *arguments: Any) -> Any:
        taken[0] += 1
        return step(steps, *arguments)

    monkeypatch.setattr(stopping_slip.PicardSteps, "step", counted)
    # only the walks of the logarithm call it by this name; others have theirs from contact_taylor
    monkeypatch.setattr(contact_taylor, "PicardSteps", type("Others", (PicardSteps,), {"step": step}))
    found = truth_of(ball_in_a_bore(4.0, 0.15), np.linspace(0.0, 0.72, 3))
    assert [event.kind for event in found.events] == ["slip", "stick", "slip", "stick"]
    for event, right in zip(found.events, GENTLE, strict=True):
        assert event.time == pytest.approx(right, abs=1e-13)
    assert taken[0] <= 12  # of two routes; 550 without lines


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.arithmetic
@pytest.mark.parametrize(
    ("seed", "sticks", "beyond"),
    [
        (38, 0.04395707855805324, 0.0),
        pytest.param(43, 0.044611843815633004, 3e-13, marks=pytest.mark.drill),
    ],
)
def test_the_end_of_a_slip_lies_within_its_bracket(seed: int, sticks: float, beyond: float) -> None:
    """A slip ends where the referee's long doubles say, by a speed known to the error of a step over its slowing.

    Of the second, which ends in the weakest slowing, processors differ by 2e-13 s, up to seven times a bracket.
    """
    _, mechanism, until = random_contacts(seed)
    found = truth_of(mechanism, np.linspace(0.0, until, 3))
    assert {event.kind for event in found.events} == {"rest"}
    assert all(event.time_low - beyond <= sticks <= event.time_high + beyond for event in found.events)
    assert all(event.time_high - event.time_low < 3e-12 for event in found.events)


Pull = Callable[[float], tuple[float, float]]


def reference(mass: np.ndarray, hold: float, until: float, pull: Pull, rate_of: Pull) -> np.ndarray:
    """Velocity at the end of a slip against friction ``hold`` under a pull, by ln|u| and its direction."""
    begins = brentq(lambda t: np.linalg.norm(pull(t)) - hold, 0.0, 2.0, xtol=1e-15)
    early = 1e-4  # s: after the start, where the direction of the slip is that of the pull but for its turn
    angle = np.arctan2(*pull(begins)[::-1])

    def rates(_: float, y: np.ndarray) -> list[float]:
        size, way = np.exp(y[0]), np.array([np.cos(y[1]), np.sin(y[1])])
        rate = (np.array(pull(y[2])) - hold * way) / mass
        return [rate @ way, rate @ np.array([-way[1], way[0]]), size]  # by τ with dt = |u| dτ

    def ends(_: float, y: np.ndarray) -> float:
        return float(y[2] - until)

    ends.terminal = True  # type: ignore[attr-defined]
    way = np.array([np.cos(angle), np.sin(angle)])
    growth = way @ (np.array(rate_of(begins)) / mass)
    first = [np.log(growth * early**2 / 2), angle, begins + early]
    done = solve_ivp(rates, (0, 1e9), first, "LSODA", rtol=1e-12, atol=1e-12, events=ends)
    size, angle, _ = done.y_events[0][0]
    return np.asarray(np.exp(size) * np.array([np.cos(angle), np.sin(angle)]))


@pytest.mark.nightly
def test_a_bead_slips_against_friction_that_turns_with_its_pull() -> None:
    """A bead with another inertia along each rail, pulled harder and harder round a corner, moves as Coulomb says."""
    hold, until = 0.3 * 9.81, 1.0
    rails = [("x", (1, 0, 0), "4*t"), ("y", (0, 1, 0), "6*t^2"), ("z", (0, 0, 1), "")]
    names = ["world", "one", "two", "bead"]
    joints = tuple(
        Joint(rail, "prismatic", names[k], names[k + 1], axis=axis)  # type: ignore[arg-type]
        for k, (rail, axis, _) in enumerate(rails)
    )
    bodies = tuple(Body(name, m, inertia=(0.01,) * 3) for name, m in zip(names[1:], (0.5, 0.25, 1.0), strict=True))
    pulls = tuple(Actuator(f"pull_{rail}", rail, "torque", target=Formula(law)) for rail, _, law in rails[:2])
    shapes = (Geometry("floor", "world", "plane"), Geometry("tip", "bead", "sphere", radius=0.0))
    guided = Mechanism(
        bodies, joints, actuators=pulls, geometries=shapes, pairs=(Pair("touch", ("tip", "floor"), 0.3),)
    )
    found = truth_of(guided, np.array([0.0, until]))
    assert [event.kind for event in found.events] == ["slip"]
    assert found.bars["v"][-1] < 1e-11
    right = reference(np.array([1.75, 1.25]), hold, until, lambda t: (4 * t, 6 * t**2), lambda t: (4.0, 12 * t))
    assert found.record.v[1, :2] == pytest.approx(right, abs=1e-6)


def bead(push: str = "", speed: float = 0.0, shake: str = "", aside: str = "0") -> Mechanism:
    """A bead of 1 kg on a floor with friction 0.5, pushed along x and ``aside``; the floor may be shaken along x."""
    start = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
    joints = [Joint("free", "free", "world", "bead", q0=start, v0=(speed, 0.0, 0.0, 0.0, 0.0, 0.0))]
    bodies = [Body("bead", 1.0, inertia=(0.1,) * 3)]
    if shake:
        joints.append(Joint("shake", "prismatic", "world", "plate", axis=(1, 0, 0), motion=Formula(shake)))
        bodies.append(Body("plate", 1.0, inertia=(0.1,) * 3))
    shapes = (Geometry("floor", "plate" if shake else "world", "plane"), Geometry("tip", "bead", "sphere", radius=0.0))
    return Mechanism(
        tuple(bodies),
        tuple(joints),
        forces=(Force("push", "bead", "force", value=(Formula(push), Formula(aside), 0.0)),) if push else (),
        geometries=shapes,
        pairs=(Pair("touch", ("tip", "floor"), 0.5),),
    )


def slip_under_a_push(push: float, rate: float, hold: float) -> tuple[float, float, float]:
    """Begin [s], end [s] and length [m] of a slip under ``push`` sin(``rate`` t) against friction, by its integral."""
    begin = float(np.arcsin(hold / push)) / rate

    def speed(t: float) -> float:
        return float(push / rate * (np.cos(rate * begin) - np.cos(rate * t)) - hold * (t - begin))

    end = brentq(speed, begin + 1e-2, 2 * np.pi / rate, xtol=1e-15)
    way = push / rate * (np.cos(rate * begin) * (end - begin) - (np.sin(rate * end) - np.sin(rate * begin)) / rate)
    return begin, end, float(way - hold * (end - begin) ** 2 / 2)


PUSHED, SLIP = bead("5.2*sin(10*t)"), slip_under_a_push(5.2, 10.0, 0.5 * 9.81)


@pytest.mark.nightly
def test_a_slip_that_turns_fast_is_followed_from_its_first_instant() -> None:
    """A pull that turns by 20 rad/s as friction gives way takes the bead with it, as Coulomb's law says."""
    until, hold = 0.05, 0.5 * 9.81
    found = truth_of(bead("4.9", aside="100*t"), np.array([0.0, until]))
    (event,) = found.events
    begin = float(np.sqrt(hold**2 - 4.9**2)) / 100
    assert event.kind == "slip"
    assert event.time_low <= begin <= event.time_high
    assert not found.ended
    right = reference(np.ones(2), hold, until, lambda t: (4.9, 100 * t), lambda _: (0.0, 100.0))
    assert found.record.v[-1, :2] == pytest.approx(right, abs=1e-6)


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    "until",
    [pytest.param(end, marks=pytest.mark.nightly if k % 4 else ()) for k, end in enumerate(np.linspace(0.13, 0.4, 20))],
)
def test_a_slip_that_stops_in_its_first_instants_ends_there(until: float) -> None:
    """A bead under a swelling push sticks when its speed is zero, whatever the end of the run is."""
    found = truth_of(PUSHED, np.array([0.0, until]))
    begin, end, way = SLIP
    right = [("slip", begin), ("stick", end)][: 1 + (until > end)]
    assert [event.kind for event in found.events] == [kind for kind, _ in right]
    for event, (_, time) in zip(found.events, right, strict=True):
        assert event.time_low <= time <= event.time_high
    if until > end:
        assert found.record.q[-1, 0] == pytest.approx(way, abs=1e-14)
        assert found.record.v[-1, 0] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("0.4", "0.25")
@pytest.mark.drill
@pytest.mark.parametrize("until", [0.19, 0.21, 0.25, 0.4])
def test_a_slip_on_a_shaken_floor_ends_when_the_floor_has_its_speed(until: float) -> None:
    """A bead that holds to a shaken floor slips and holds again at one time, whatever the end of the run is."""
    found = truth_of(bead(speed=0.5, shake="0.05*sin(10*t)"), np.array([0.0, until]))
    begin = float(np.arcsin(0.5 * 9.81 / 5.0)) / 10  # s: the floor's deceleration reaches the bound
    assert 0.1 < begin < 0.19
    end = brentq(
        lambda t: 0.5 * np.cos(10 * begin) - 0.5 * 9.81 * (t - begin) - 0.5 * np.cos(10 * t), 0.15, 0.22, xtol=1e-15
    )
    kinds = [event.kind for event in found.events]
    assert kinds == ["slip", "stick"][: 1 + (until > end)]
    for event, right in zip(found.events, (begin, end), strict=False):
        assert event.time_low <= right <= event.time_high


def rolling_in(way: tuple[float, float]) -> Mechanism:
    """A ball of unequal moments that slides backward along a ``way`` until it rolls, at μ g = 3 m/s²."""
    start = (0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0)
    free = Joint("free", "free", "world", "ball", q0=start, v0=(-2.0 * way[0], -2.0 * way[1], 0.0, 0.0, 0.0, 0.0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("skin", "ball", "sphere", radius=0.2))
    return Mechanism(
        (Body("ball", 1.0, inertia=(0.018, 0.03, 0.028)),), (free,), geometries=shapes,
        pairs=(Pair("c", ("skin", "floor"), 0.3),), gravity=(0.0, 0.0, -10.0),
    )  # fmt: skip


@pytest.mark.drill
def test_friction_opposes_a_slip_until_its_last_instant() -> None:
    """Friction turns with a slip that vanishes: a sample just before its end has the force against its direction."""
    ball = rolling_in((0.6, 0.8))
    (event,) = truth_of(ball, np.array([0.0, 0.4])).events
    before = event.time - np.array([3e-8, 3e-9, 1e-9, 1e-10])
    found = truth_of(ball, np.array([0.0, *before]))
    assert found.pressed is not None
    slip = (found.record.v_WB[:, 0] + np.cross(found.record.w_WB[:, 0], [0.0, 0.0, -0.2]))[1:, :2]
    ways = slip / np.linalg.norm(slip, axis=1)[:, None]
    assert np.linalg.norm(found.pressed[1:, 0, :2] + 0.3 * 10.0 * ways, axis=1).max() < 1e-5  # of 3 N
    assert found.bars["pressed"][-1] < 1e-5


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("way", [(1.0, 0.0), (0.0, 1.0), (0.6, 0.8)])
def test_a_ball_of_unequal_moments_slides_along_an_axis_until_it_rolls(way: tuple[float, float]) -> None:
    """A slip that keeps its direction stops without a division by zero: at 2/7 of v/(μ g) for moments alike."""
    right = {(1.0, 0.0): 0.03, (0.0, 1.0): 0.018}.get(way)
    found = truth_of(rolling_in(way), np.array([0.0, 0.4]))
    (event,) = found.events
    assert event.kind == "stick"
    if right is not None:
        end = 2.0 / (0.3 * 10.0 * (1 + 0.2**2 / right))
        assert event.time_low <= end <= event.time_high
        place = -2.0 * end + 1.5 * end**2 - (2.0 - 3.0 * end) * (0.4 - end)
        assert found.record.p_WB[-1, 0] @ np.array([*way, 0.0]) == pytest.approx(place, abs=1e-14)


def test_a_slip_begins_in_one_go_where_its_pull_turns_with_the_square_of_time() -> None:
    """First instants are not cut short where friction turns as much as the states changed the round before."""
    turning, growing, until = 0.5, 0.1, 0.02

    def led(states: np.ndarray, ways: np.ndarray) -> LedValues:
        """A mass under a pull of an angle w with ẇ proportional to time; states are (u_x, u_y, w, t)."""
        w, t = states[:, 2], states[:, 3]
        pull = (1 + growing * t)[:, None] * np.array([np.cos(w), np.sin(w), 0 * w]).T
        rates = pull - ways
        slides = np.column_stack([states[:, :2], 0 * t])
        all_rates = np.column_stack([rates[:, :2], turning * t, np.ones_like(t)])
        return LedValues(all_rates, np.tile([0.0, 0.0, 1.0], (len(t), 1)), slides, rates)

    mode = (Acting("slip", heading=(1.0, 0.0, 0.0), leads=True),)
    begun = begun_slip(0.0, np.zeros(4), mode, until, led, 14, "mass")
    assert begun.end == until
    way = begun.directions_at(np.array([until]))[0]
    # behind the pull by the time |u| in which friction turns the slip, times the pull's rate of turning
    behind = growing * until**2 / 2 * turning * until
    assert np.arctan2(way[1], way[0]) == pytest.approx(turning * until**2 / 2, abs=2 * behind)


@pytest.mark.parametrize("pull", [1.1, 2.0, 20.0])
def test_a_slip_begins_where_kinetic_friction_is_far_below_the_pull(pull: float) -> None:
    """A mass whose speed grows by (P - F) t lags behind a pull P of angle c t^2 / 2: by P c t^2 / 2 / (3 P - 2 F)."""
    turning, until = 0.5, 0.02

    def led(states: np.ndarray, ways: np.ndarray) -> LedValues:
        """States are (u_x, u_y, t), of a mass of 1 kg with friction of 1 N."""
        t = states[:, 2]
        rates = pull * np.array([np.cos(turning * t**2 / 2), np.sin(turning * t**2 / 2), 0 * t]).T - ways
        slides = np.column_stack([states[:, :2], 0 * t])
        all_rates = np.column_stack([rates[:, :2], np.ones_like(t)])
        return LedValues(all_rates, np.tile([0.0, 0.0, 1.0], (len(t), 1)), slides, rates)

    mode = (Acting("slip", heading=(1.0, 0.0, 0.0), leads=True),)
    begun = begun_slip(0.0, np.zeros(3), mode, until, led, 14, "mass")
    assert begun.end == until
    times = np.array([until / 2, until])
    angles = pull * turning * times**2 / 2 / (3 * pull - 2)
    ways, slides = begun.directions_at(times), begun.at(times)[:, :2]
    assert np.arctan2(ways[:, 1], ways[:, 0]) == pytest.approx(angles, rel=1e-6)
    assert np.arctan2(slides[:, 1], slides[:, 0]) == pytest.approx(angles, rel=1e-6)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("excess", [1e-2, 1e-6])
def test_a_slip_from_rest_may_begin_as_slowly_as_it_likes(excess: float) -> None:
    """A push just above the grip of a ball that hardly turns moves it at once, while another ball falls beside it."""
    inertia, times, grip = 1e4, np.linspace(0.0, 0.4, 5), 0.25 * 2.0 * 9.81
    bodies = Body("slides", 2.0, inertia=(inertia,) * 3), Body("falls", 1.0, inertia=(0.1,) * 3)
    joints = (
        Joint("floating", "free", "world", "slides", q0=(0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0)),
        Joint("falling", "free", "world", "falls", q0=(5.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
    )
    shapes = Geometry("floor", "world", "plane"), Geometry("skin", "slides", "sphere", radius=0.1)
    push = grip * (1 + 2.0 * 0.1**2 / inertia) * (1 + excess)  # that at which it no longer rolls, and more
    mechanism = Mechanism(
        bodies, joints, geometries=shapes, pairs=(Pair("p", ("skin", "floor"), 0.25),),
        forces=(Force("push", "slides", "force", (push, 0.0, 0.0)),),
    )  # fmt: skip
    found = truth_of(mechanism, times)
    assert found.ended == ""
    np.testing.assert_allclose(found.record.p_WB[:, 1, 2], -9.81 / 2 * times**2, atol=1e-13)
    np.testing.assert_allclose(found.record.p_WB[:, 0, 0], (push - grip) / 4 * times**2, rtol=1e-9, atol=1e-16)
