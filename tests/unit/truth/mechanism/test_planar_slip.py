"""Slips that start from rest in any direction of a surface."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from proofroll.elements.ball_on_surface.element import rolling_ball
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contacts.geometry import Geometry, Pair
from proofroll.elements.mechanism.drives import Actuator
from proofroll.elements.mechanism.signal import Formula
from proofroll.files.scene_file import load_scene
from proofroll.truth.mechanism.switched_truth import truth_of
from proofroll_drill.referee.random_contacts import random_contacts

# s: of a ball that starts with 3 m/s in a cylinder, by its own truth
SLIPS, STICKS = 0.3220872132861903, 0.4999850902951998
NEAR = 2e-12  # s: error bars of that truth


def ball_in_a_bore(speed: float) -> Mechanism:
    """The ball of the founding scene as body, sphere and bore."""
    scene = load_scene("sphere_in_cylinder", mu_static=0.35, speed=speed)
    found, wall = rolling_ball(scene), scene.elements[0].surface  # type: ignore[attr-defined]
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
    return Mechanism((body,), (free,), geometries=shapes, pairs=(Pair("touch", ("sphere", "wall"), 0.35),))


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


@pytest.mark.arithmetic
@pytest.mark.parametrize(
    ("seed", "sticks", "beyond"), [(38, 0.04395707855805324, 0.0), (43, 0.044611843815633004, 3e-13)]
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


def reference(mass: np.ndarray, hold: float, until: float) -> np.ndarray:
    """Velocity at the end of a slip against friction ``hold`` under a pull (4 t, 6 t²), by ln|u| and its direction."""

    def pull(t: float) -> np.ndarray:
        return np.array([4 * t, 6 * t**2])

    begins = brentq(lambda t: np.linalg.norm(pull(t)) - hold, 0.1, 2.0, xtol=1e-15)
    early = 1e-4  # s: after the start, where the direction of the slip is that of the pull but for its turn
    angle = np.arctan2(*pull(begins)[::-1])

    def rates(_: float, y: np.ndarray) -> list[float]:
        size, way = np.exp(y[0]), np.array([np.cos(y[1]), np.sin(y[1])])
        rate = (pull(y[2]) - hold * way) / mass
        return [rate @ way, rate @ np.array([-way[1], way[0]]), size]  # by τ with dt = |u| dτ

    def ends(_: float, y: np.ndarray) -> float:
        return float(y[2] - until)

    ends.terminal = True  # type: ignore[attr-defined]
    way = np.array([np.cos(angle), np.sin(angle)])
    growth = way @ (np.array([4.0, 12 * begins]) / mass)
    first = [np.log(growth * early**2 / 2), angle, begins + early]
    done = solve_ivp(rates, (0, 1e9), first, "LSODA", rtol=1e-12, atol=1e-12, events=ends)
    size, angle, _ = done.y_events[0][0]
    return np.asarray(np.exp(size) * np.array([np.cos(angle), np.sin(angle)]))


@pytest.mark.drill
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
    right = reference(np.array([1.75, 1.25]), hold, until)
    assert found.record.v[1, :2] == pytest.approx(right, abs=1e-6)
