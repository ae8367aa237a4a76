"""Rolling resistance against the motion of a ball's centre, in both routes of the truth, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import InputError
from proofroll.core.events import events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.parts import Force
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula

RADIUS, MASS, G = 0.025, 0.5, 9.81
MOMENT = 0.4 * MASS * RADIUS**2
NORMAL = MASS * G
Vector = tuple[float, float, float]


def ball(
    speed: Vector = (0.0, 0.0, 0.0),
    spin: Vector = (0.0, 0.0, 0.0),
    *,
    friction: float = 0.2,
    f: float = 5e-4,
    slope: float = 0.0,
    first: bool = True,
    **laws: Any,
) -> Mechanism:
    """A ball on a plane that gravity leans over by ``slope`` [rad] towards +x; ``first``: the pair names it first."""
    shapes = (Geometry("s", "ball", "sphere", radius=RADIUS), Geometry("floor", "world", "plane"))
    joint = Joint("j", "free", "world", "ball", q0=(0, 0, RADIUS, 1, 0, 0, 0), v0=(*speed, *spin))
    names = ("s", "floor") if first else ("floor", "s")
    pair = Pair("contact", names, friction, rolling_resistance=f, **{"against": "motion", **laws})
    inertia = (MOMENT, MOMENT, MOMENT)
    pull = (G * math.sin(slope), 0.0, -G * math.cos(slope))
    return Mechanism((Body("ball", MASS, inertia=inertia),), (joint,), geometries=shapes, pairs=(pair,), gravity=pull)


def found(mechanism: Mechanism, *times: float) -> Any:
    """The truth at times after 0 [s]."""
    return truth(Scene("ball", "", (MechanismElement(mechanism),)), np.array([0.0, *times]))


def last(true: Any) -> tuple[float, float]:
    """Place along x [m] and spin about y [rad/s] at the last time."""
    return float(true["p_WB"][-1, 0, 0]), float(true["w_WB"][-1, 0, 1])


def bar(true: Any) -> float:
    """Larger of the bars of place [m] and spin [rad/s]."""
    return max(float(true[name].attrs["error_bar"]) for name in ("p_WB", "w_WB"))


@pytest.mark.drill
def test_a_backspin_keeps_its_moment_as_long_as_the_centre_goes_on() -> None:
    """The moment is against the motion ahead, so that f N adds to μ N a until the centre has turned back."""
    speed, spin, time = 1.0, -100.0, 0.3
    true = found(ball((speed, 0, 0), (0, spin, 0)), time)
    torque = NORMAL * (0.2 * RADIUS - 5e-4)  # friction turns forward, resistance backward
    expected = speed * time - 0.1 * G * time**2, spin + torque / MOMENT * time
    assert last(true) == pytest.approx(expected, abs=1e-11)


@pytest.mark.drill
def test_the_moment_reverses_with_the_centre() -> None:
    """A back spin that outlasts the motion brings the ball back, and the moment turns round as its centre does."""
    speed, spin, time = 0.4, -150.0, 0.5
    true = found(ball((speed, 0, 0), (0, spin, 0)), time)
    turns = speed / (0.2 * G)
    torques = NORMAL * (0.2 * RADIUS - 5e-4), NORMAL * (0.2 * RADIUS + 5e-4)
    expected = spin + (torques[0] * turns + torques[1] * (time - turns)) / MOMENT
    assert last(true) == pytest.approx((speed * time - 0.1 * G * time**2, expected), abs=bar(true))
    assert bar(true) < 1e-8
    assert [event.kind for event in events_of(true)] == []


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("first", [True, False])
def test_the_order_of_the_pair_does_not_matter(first: bool) -> None:
    """A ball that slips askew moves alike whichever body the pair names first, and not as against its turning."""
    start: Any = {"speed": (1.0, 0.3, 0.0), "spin": (5.0, -60.0, 3.0)}
    true, turning = (found(ball(**start, first=first, against=law), 1.0) for law in ("motion", "turning"))
    assert "DOP853" not in true.attrs["route"] + true.attrs["second_route"]  # both have the law compiled, too
    place = true["p_WB"].to_numpy()[-1, 0, :2]
    assert place == pytest.approx([0.364910576520, 0.173086590625], abs=1e-9)
    assert turning["p_WB"].to_numpy()[-1, 0, :2] == pytest.approx([0.411600987501, 0.179208167138], abs=1e-9)


@pytest.mark.drill
def test_rolling_is_the_same_by_both_laws() -> None:
    """A ball that rolls to rest has one motion, to the truth's bar, for there the centre moves as the ball turns."""
    start: Any = {"speed": (0.3, 0.2, 0.0), "spin": (-0.2 / RADIUS, 0.3 / RADIUS, 0.0)}
    true, turning = (found(ball(**start, against=law), 1.0, 4.0) for law in ("motion", "turning"))
    assert float(np.abs(true["p_WB"] - turning["p_WB"]).max()) <= 1e-12
    assert float(np.abs(true["v_WB"][-1]).max()) <= 1e-15


@pytest.mark.drill
def test_a_ball_that_starts_spinning_in_place_resists_the_motion_that_begins() -> None:
    """Its centre is driven by friction at once, and the moment is against that direction."""
    spin, time = 60.0, 0.15
    torque = -NORMAL * (0.2 * RADIUS + 5e-4)
    expected = 0.1 * G * time**2, spin + torque / MOMENT * time
    true = found(ball(spin=(0, spin, 0)), time)
    assert last(true) == pytest.approx(expected, abs=bar(true))
    assert bar(true) < 1e-10


@pytest.mark.drill
def test_a_centre_that_nothing_moves_has_no_moment() -> None:
    """Without friction a ball spins in place for ever: its centre has no direction, and the normal force no shift."""
    true = found(ball(spin=(0.0, 30.0, 0.0), friction=0.0), 1.0)
    assert "ill_posed" not in true.attrs
    assert last(true) == pytest.approx((0.0, 30.0), abs=1e-12)


@pytest.mark.nightly
def test_a_resistance_longer_than_the_arm_of_friction_turns_a_sliding_ball_back() -> None:
    """From rest on a slope with f > μ a the ball slides, and the moment exceeds that of friction."""
    slope, f, time = 0.3, 6e-3, 0.5
    true = found(ball(f=f, slope=slope), time)
    pressed = NORMAL * math.cos(slope)
    slides = G * math.sin(slope) - 0.2 * G * math.cos(slope)
    expected = 0.5 * slides * time**2, pressed * (0.2 * RADIUS - f) / MOMENT * time
    assert last(true) == pytest.approx(expected, abs=1e-10)


def test_rest_holds_what_either_law_holds() -> None:
    """At rest the normal force may lie anywhere within f: the ball stays while f cos α ≥ a sin α."""
    assert last(found(ball(f=6e-3, slope=0.1), 1.0)) == pytest.approx((0.0, 0.0), abs=1e-12)


@pytest.mark.drill
def test_a_slip_that_begins_while_resistance_holds_the_ball_is_refused() -> None:
    """A growing push that moves a ball held by f > μ a has no direction of motion yet: the truth ends there."""
    mechanism = replace(ball(f=6e-3), forces=(Force("push", "ball", "force", value=(Formula("2*t"), 0.0, 0.0)),))
    true = found(mechanism, 0.2, 1.0)
    assert "against the motion of a centre that does not move yet" in true.attrs["ended"]
    assert float(true["time"][-1]) == 0.2


def test_only_a_ball_on_a_wall_has_a_motion_to_resist() -> None:
    """Two spheres, and a box on a plane, are refused in one line that names the key."""
    other = Geometry("t", "world", "sphere", radius=0.1, position=(0.0, 0.0, -0.1))
    parts = ball()
    with pytest.raises(InputError, match=r"pairs.contact.against = 'motion'.*only a sphere moves over a plane"):
        replace(parts, geometries=(parts.geometries[0], other), pairs=(replace(parts.pairs[0], geometries=("s", "t")),))
    with pytest.raises(InputError, match=r"pairs.contact.against"):
        replace(parts.pairs[0], against="rolling")


@pytest.mark.drill
@pytest.mark.parametrize("aside", [0.0, 0.3])
def test_an_arm_longer_than_that_of_friction_rocks_a_ball_to_rest(aside: float) -> None:
    """With f > (1 + k) μ a a ball turns back ever faster, by (f - (1 + k) μ a)/(f + (1 + k) μ a) each time, to rest.

    By hand along a line: while the centre goes on it slows by μ g, and a times the spin by (f/a - μ) g/k; after it has
    turned the spin slows by (f/a + μ) g/k until the ball rolls, with that part of its speed, and goes back.
    """
    speed, k, mu, part = math.hypot(1.0, aside), 0.4, 0.2, 0.5
    true = found(ball((1.0, aside, 0.0), (-aside / RADIUS, 1.0 / RADIUS, 0.0), f=part * RADIUS), 1.0, 1.5)
    assert "ended" not in true.attrs
    back = ((part - mu) / (k * mu) - 1) * speed  # a times the spin beyond rolling when the centre turns
    slows = G * (mu + (part + mu) / k)
    times, ratio = speed / (mu * G) + back / slows, (part - mu * (1 + k)) / (part + mu * (1 + k))
    way = (speed**2 / (2 * mu * G) - mu * G * (back / slows) ** 2 / 2) / (1 + ratio**2)
    *turns, rest = events_of(true)
    assert (rest.kind, {event.kind for event in turns}) == ("rest", {"turn"})
    assert [event.time for event in turns[:3]] == pytest.approx(
        [times, times * (1 + ratio), times * (1 + ratio + ratio**2)], abs=1e-11
    )
    assert rest.time_low <= times / (1 - ratio) <= rest.time_high
    place = np.array([1.0, aside]) / speed * way
    assert true["p_WB"].to_numpy()[-1, 0, :2] == pytest.approx(place, abs=bar(true))
    assert float(np.abs(true["v_WB"][-1]).max()) <= 1e-20
    assert "energy_gain" not in true  # the moment feeds the back spin


@pytest.mark.drill
def test_a_turntable_resists_the_motion_that_it_sees() -> None:
    """A ball that slips on a plane that turns loses energy by its motion relative to the plane; both routes agree."""
    joint = Joint("turn", "revolute", "world", "table", axis=(0.0, 0.0, 1.0), motion=Formula("3*t"))
    parts = ball((0.5, 0.2, 0.0), (1.0, -30.0, 4.0))
    floor = replace(parts.geometries[1], body="table")
    table = Body("table", 1.0, inertia=(0.01, 0.01, 0.01))
    turning = replace(
        parts,
        bodies=(*parts.bodies, table),
        joints=(*parts.joints, joint),
        geometries=(parts.geometries[0], floor),
    )
    true = found(turning, 0.1)
    still = found(parts, 0.1)
    assert "ended" not in true.attrs
    assert float(true["p_WB"].attrs["error_bar"]) < 1e-11
    assert float(np.abs(true["w_WB"][-1, 0] - still["w_WB"][-1, 0]).max()) > 1e-2


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("kind", [pytest.param("bowl", marks=pytest.mark.drill), "bore"])
def test_curved_walls_take_the_direction_along_the_wall(kind: str) -> None:
    """On a curved wall both routes agree with each other and with the laws while the ball slips."""
    wall = Geometry("floor", "world", kind, radius=0.3, **({"axis": (1.0, 0.2, 0.0)} if kind == "bore" else {}))
    parts = ball((0.6, 0.5, 0.0), (2.0, -40.0, 5.0))
    lowest = (0.0, 0.0, -(0.3 - RADIUS), 1.0, 0.0, 0.0, 0.0)
    joint = replace(parts.joints[0], q0=lowest)
    true = found(replace(parts, joints=(joint,), geometries=(parts.geometries[0], wall)), 0.05, 0.3)
    assert "ended" not in true.attrs
    assert float(true["p_WB"].attrs["error_bar"]) < 1e-10
