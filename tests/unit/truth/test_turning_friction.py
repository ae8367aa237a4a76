"""Friction of a contact against rolling and spinning, in both routes of the truth, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from turned_scenes import turned_mechanism

import proofroll
from proofroll.core.dataset import ENDED, LAWS
from proofroll.core.errors import InputError, Refused
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.parts import Force
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.truth_of_mechanism import truth_of

RADIUS, MASS, MOMENT, G = 0.05, 0.7, 0.0009, 9.81


def ball(
    pair: Pair,
    velocity: tuple[float, ...] = (0.0,) * 6,
    height: float = RADIUS,
    inertia: tuple[float, float, float] = (MOMENT, MOMENT, MOMENT),
    slope: float = 0.0,
) -> Scene:
    """A ball on a plane that gravity leans over by ``slope`` [rad] towards +x."""
    shapes = (Geometry("s", "ball", "sphere", radius=RADIUS), Geometry("floor", "world", "plane"))
    joint = Joint("j", "free", "world", "ball", q0=(0, 0, height, 1, 0, 0, 0), v0=velocity)
    pull = (G * math.sin(slope), 0.0, -G * math.cos(slope))
    parts = Mechanism((Body("ball", MASS, inertia=inertia),), (joint,), geometries=shapes, pairs=(pair,), gravity=pull)
    return Scene("ball", "", (MechanismElement(parts),))


def law(friction: float = 0.8, **laws: float) -> Pair:
    """A contact of the ball with the floor."""
    return replace(Pair("contact", ("s", "floor"), friction), **laws)


def at(found: Any, field: str) -> np.ndarray[Any, Any]:
    """Values of a field in time, (times, 3)."""
    return np.asarray(found[field].to_numpy().reshape(found.sizes["time"], -1))


def bar(found: Any, field: str) -> float:
    """Error bar of a field."""
    return float(np.max(found[field].attrs["error_bar"]))


@pytest.mark.nightly
@pytest.mark.parametrize("slope", [0.0, 0.1])
def test_a_ball_that_slides_without_rolling_has_compiled_modes(slope: float) -> None:
    """Rolling resistance above what friction of its slip can turn holds the ball: it slides as a box, to its stop."""
    pytest.importorskip("heyoka")
    pair, times = law(0.3, rolling_resistance=0.02), np.linspace(0.0, 0.4, 5)
    found = truth(ball(pair, (1.2, 0.0, 0.0, 0.0, 0.0, 0.0), slope=slope), times)
    slows = G * (0.3 * math.cos(slope) - math.sin(slope))
    left = np.minimum(times, 1.2 / slows)
    assert at(found, "p_WB")[:, 0] == pytest.approx(1.2 * left - slows * left**2 / 2, abs=1e-13)
    assert np.abs(at(found, "w_WB")).max() < 1e-13
    assert at(found, "torque.contact.y")[1, 0] == pytest.approx(-0.3 * MASS * G * math.cos(slope) * RADIUS, abs=1e-12)
    assert "DOP853" not in found.attrs["route"] + found.attrs["second_route"]


@pytest.mark.drill
def test_a_spin_ends_when_its_friction_says() -> None:
    """A ball that spins about the normal slows by f N/J and stands after J ω/(f N)."""
    f, spin = 2e-3, 30.0
    slows, times = f * MASS * G / MOMENT, np.array([0.0, 0.5, 1.0, 1.9, 2.2])
    found = truth(ball(law(spinning_friction=f), (0, 0, 0, 0, 0, spin)), times)
    expected = np.maximum(spin - slows * times, 0.0)
    assert np.abs(at(found, "w_WB")[:, 2] - expected).max() <= bar(found, "w_WB") <= 1e-10
    assert expected[-1] == 0.0


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("f", "rolls"), [(0.004, True), (0.02, False)])
def test_a_ball_on_a_slope_rolls_where_its_resistance_is_less_than_the_pull(f: float, rolls: bool) -> None:
    """From rest it stays if f cos α ≥ a sin α, and else starts with the acceleration of a ball that resists."""
    slope, time = 0.2, 0.8
    found = truth(ball(law(rolling_resistance=f), slope=slope), np.array([0.0, time]))
    pull = G * math.sin(slope) - f * G * math.cos(slope) / RADIUS
    moved = 0.5 * pull / (1 + MOMENT / (MASS * RADIUS**2)) * time**2 if rolls else 0.0
    assert abs(at(found, "p_WB")[-1, 0] - moved) <= bar(found, "p_WB") <= 1e-11


@pytest.mark.drill
def test_a_ball_that_slips_and_rolls_has_both_laws() -> None:
    """While it slips, its centre slows by μ g, and its back spin by (μ a + f) m g/J."""
    mu, f, speed, spin, time = 0.2, 0.003, 1.0, 60.0, 0.2
    found = truth(ball(law(mu, rolling_resistance=f), (speed, 0, 0, 0, -spin, 0)), np.array([0.0, time]))
    assert abs(at(found, "v_WB")[-1, 0] - (speed - mu * G * time)) <= bar(found, "v_WB")
    slows = (mu * RADIUS + f) * MASS * G / MOMENT
    assert abs(at(found, "w_WB")[-1, 1] + spin - slows * time) <= bar(found, "w_WB") <= 1e-9


@pytest.mark.nightly
def test_both_routes_agree_on_a_ball_of_unequal_moments() -> None:
    """A ball with three moments of inertia lands, slips, rolls and spins with all laws at once."""
    pair = law(0.3, rolling_resistance=1e-3, spinning_friction=2e-3)
    scene = ball(pair, (0.8, 0.3, 0, 4.0, -20.0, 9.0), 0.08, (0.0008, 0.001, 0.0013))
    found = truth(scene, np.linspace(0.0, 0.8, 5))
    assert bar(found, "p_WB") <= 1e-12
    assert np.isfinite(at(found, "p_WB")).all()


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.arithmetic
@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (-1.9, 0.8, 0.6)])
def test_an_impact_with_friction_against_turning_happens_once(rpy: tuple[float, float, float]) -> None:
    """A spinning ball that lands has one impact, whatever the axes are."""
    pair = law(0.3, restitution=0.5, rolling_resistance=1e-3, spinning_friction=2e-3)
    (element,) = ball(pair, (0.8, 0.3, 0, 4.0, -20.0, 9.0), 0.1).elements
    assert isinstance(element, MechanismElement)
    found = truth_of(turned_mechanism(element.mechanism, rpy, (0.0, 0.0, 0.0)), np.array([0.0, 0.15]))
    assert [event.kind for event in found.events] == ["impact"]


@pytest.mark.drill
def test_friction_against_spin_turns_with_the_normal_of_a_bore() -> None:
    """A ball that spins as it slides round a bore keeps the law of the moment against its spin in both routes."""
    bore, out = 0.2, 0.2 - RADIUS
    shapes = (Geometry("s", "ball", "sphere", radius=RADIUS), Geometry("wall", "world", "bore", radius=bore))
    pair = replace(law(0.1, spinning_friction=2e-3), geometries=("s", "wall"))
    joint = Joint("j", "free", "world", "ball", q0=(out, 0, 0, 1, 0, 0, 0), v0=(0.0, 2.0, 0.0, 30.0, 0.0, 2.0 / out))
    parts = Mechanism((Body("ball", MASS, inertia=(MOMENT,) * 3),), (joint,), geometries=shapes, pairs=(pair,))
    found = MechanismTruth.truth(MechanismElement(parts), np.array([0.0, 0.05]), ()).attrs
    assert ENDED not in found
    assert LAWS in found


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.arithmetic
@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.7, -1.1, 2.3)])
def test_a_planar_joint_bears_what_friction_against_spin_would(rpy: tuple[float, float, float]) -> None:
    """A ball on a planar joint, which cannot spin about the floor's normal, rolls as one without that friction."""
    shapes = (Geometry("s", "ball", "sphere", radius=RADIUS), Geometry("floor", "world", "plane"))
    axes = {"axis": (0.0, 1.0, 0.0), "second_axis": (1.0, 0.0, 0.0)}
    joint = Joint("j", "planar", "world", "ball", q0=(0.0, -RADIUS, 0.0), v0=(0.5, 0.0, 0.0), **axes)
    body, times = Body("ball", MASS, inertia=(MOMENT,) * 3), np.array([0.0, 0.1])
    moves = []
    for spinning in (0.0, 2e-3):
        pair = law(0.1, rolling_resistance=1e-3, spinning_friction=spinning)
        planar = Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,))
        moves.append(truth_of(turned_mechanism(planar, rpy, (0.0, 0.0, 0.0)), times).record.v_WB[-1])
    assert np.abs(moves[0] - moves[1]).max() <= 1e-13  # 1e-14 is seen
    assert np.linalg.norm(moves[0]) == pytest.approx(0.5 - 0.1 * G * 0.1, abs=1e-12)


@pytest.mark.nightly
def test_a_bounce_has_a_bar_for_its_last_instants() -> None:
    """An impact has no moment of friction, so the bar covers the short time of the bounces that are left out."""
    scene = ball(law(0.3, restitution=0.4, rolling_resistance=1e-3), (0.8, 0.3, 0, 4.0, -20.0, 9.0), 0.08)
    found = truth(scene, np.linspace(0.0, 0.5, 3))
    assert bar(found, "w_WB") <= 1e-4
    assert np.isfinite(at(found, "w_WB")).all()


def test_mujoco_says_why_it_has_no_friction_against_spin() -> None:
    """Refused, with the reason."""
    with pytest.raises(Refused, match=r"friction against spin: in MuJoCo \(condim 4\) it shares one cone with sliding"):
        proofroll.simulate(ball(law(0.3, spinning_friction=1e-3)), "mujoco[formulation=geoms]", until=0.01)


def test_a_coefficient_below_zero_is_refused_by_its_name() -> None:
    """The line names field, value and bound."""
    with pytest.raises(InputError, match=r"pairs\.contact\.spinning_friction = -1\.0: must be at least 0"):
        law(spinning_friction=-1.0)


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.nightly_of("laws3-velocity3-0.06-0.0")
@pytest.mark.parametrize(
    ("laws", "velocity", "height", "slope"),
    [
        pytest.param({"rolling_resistance": 0.02}, (0.3, 0.2, 0, -4.0, 6.0, 5.0), RADIUS, 0.0, marks=pytest.mark.drill),
        ({"rolling_resistance": 0.02}, (0.0,) * 6, RADIUS, 0.2),
        ({"friction": 0.2, "rolling_resistance": 0.003}, (1.0, 0, 0, 0, -60.0, 0), RADIUS, 0.0),
        pytest.param(
            {"friction": 0.3, "rolling_resistance": 1e-3, "spinning_friction": 5e-3},
            (0.4, 0, 0, 4, -8, 9),
            0.06,
            0.0,
            marks=pytest.mark.drill,
        ),
    ],
)
def test_the_projection_solver_follows_friction_against_turning(
    laws: dict[str, float], velocity: tuple[float, ...], height: float, slope: float
) -> None:
    """A ball that rolls until it stops, stays on a slope, slips, or lands, moves as its truth says to round-off."""
    scene = ball(law(**laws), velocity, height, slope=slope)
    found = proofroll.judge(proofroll.simulate(scene, "projection", until=0.2, every=0.1), scene)
    assert found.agrees, str(found)
    moved = [item.judgement for item in found.compared if item.judgement.observable in {"p_WB", "w_WB", "positions"}]
    assert moved
    assert max(item.error for item in moved) < 1e-11  # 1e-13 is seen


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of(
    "laws1-velocity1-0.2-exudyn[formulation=spheres]-errors2",
    "laws0-velocity0-0.0-exudyn[formulation=spheres]-errors2",
    "laws3-velocity3-0.0-exudyn[formulation=spheres]-errors2",
)
@pytest.mark.drill_of("laws0-velocity0-0.0-pinocchio[formulation=impulses]-errors0")
@pytest.mark.parametrize(
    ("setting", "errors"),
    [
        ("pinocchio[formulation=impulses]", (2e-4, 1e-8, 1e-6)),
        ("pinocchio[formulation=impulses,preset=tuned]", (1e-6, 1e-8, 1e-6)),
        ("exudyn[formulation=spheres]", (5e-5, 5e-4, 2e-2)),
    ],
)
@pytest.mark.parametrize(
    ("laws", "velocity", "slope"),
    [
        ({"rolling_resistance": 0.02}, (0.3, 0.2, 0, -4.0, 6.0, 5.0), 0.0),
        ({"rolling_resistance": 0.02}, (0.0,) * 6, 0.2),
        ({"friction": 0.2, "rolling_resistance": 0.003}, (1.0, 0, 0, 0, -60.0, 0), 0.0),
        ({"spinning_friction": 0.03}, (0, 0, 0, 0, 0, 30.0), 0.0),
    ],
)
def test_engines_follow_friction_against_turning(
    setting: str, errors: tuple[float, ...], laws: dict[str, float], velocity: tuple[float, ...], slope: float
) -> None:
    """A ball that rolls until it stops, stays on a slope, slips, or spins until it stops, ends as its truth says."""
    scene = ball(law(**laws), velocity, slope=slope)
    run = proofroll.simulate(scene, setting, until=0.2, every=0.1)
    right = proofroll.simulate(scene, "truth", until=0.2, every=0.1)
    for field, error in zip(("p_WB", "v_WB", "w_WB"), errors, strict=True):
        assert np.abs(at(run, field) - at(right, field)).max() < error


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    "friction", [{"rolling_resistance": 0.01}, {"rolling_resistance": 0.01, "spinning_friction": 0.01}]
)
def test_the_projection_solver_holds_what_its_weight_would_turn(friction: dict[str, float]) -> None:
    """A ball whose centre of mass lies 2 mm beside its middle slides without turning: its resistance acts on 10 mm."""
    scene = ball(law(friction=0.0, **friction), (1.0, 0, 0, 0, 0, 0))
    element = scene.elements[0]
    assert isinstance(element, MechanismElement)
    (body,) = element.mechanism.bodies
    heavy = replace(element.mechanism, bodies=(replace(body, com=(0.002, 0.0, 0.0)),))
    run = proofroll.simulate(replace(scene, elements=(MechanismElement(heavy),)), "projection", until=0.2, every=0.1)
    assert np.abs(at(run, "w_WB")).max() < 1e-12  # rad/s; without resistance it turns by 10 rad/s^2
    np.testing.assert_allclose(at(run, "p_WB")[-1], [0.2, 0.0, RADIUS], atol=1e-13)  # m


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("engine", "error"), [("projection", 1e-11), ("pinocchio[formulation=impulses]", 1e-2)])
def test_a_growing_moment_turns_a_ball_once_it_exceeds_its_friction(engine: str, error: float) -> None:
    """Against a moment k t a ball stands until k t = f m g, and then has the spin k (t - f m g/k)²/(2 J)."""
    f, grows, until = 1e-3, 0.1, 0.2
    scene = ball(law(spinning_friction=f))
    element = scene.elements[0]
    assert isinstance(element, MechanismElement)
    twisted = replace(element.mechanism, forces=(Force("twist", "ball", "moment", (0.0, 0.0, Formula(f"{grows}*t"))),))
    run = proofroll.simulate(replace(scene, elements=(MechanismElement(twisted),)), engine, until=until, every=0.05)
    begins = f * MASS * G / grows
    spin = [grows * max(t - begins, 0.0) ** 2 / (2 * MOMENT) for t in run["time"].to_numpy()]
    np.testing.assert_allclose(at(run, "w_WB")[:, 2], spin, atol=error)  # rad/s; of first order 7e-3


@pytest.mark.nightly
def test_the_iteration_around_pinocchios_solver_leaves_no_error_of_its_own() -> None:
    """Along a line the midpoint has no error, and the moments are found closer than the solver finds its impulses."""
    scene = ball(law(rolling_resistance=2e-3), (0.3, 0, 0, 0, 6, 0))
    run, right = (
        proofroll.simulate(scene, engine, until=0.2, every=0.1)
        for engine in ("pinocchio[formulation=impulses,preset=tuned]", "truth")
    )
    assert (
        np.abs(at(run, "p_WB") - at(right, "p_WB")).max() < 3e-13
    )  # m; 3e-14 is seen, and 6e-12 a thousand times looser


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.1, 2.3)])
def test_a_free_joint_bears_nothing_once_a_spin_has_stopped(turn: tuple[float, float, float]) -> None:
    """Forces and moments of a free joint are 0 and determinate, also while friction against spinning holds its ball."""
    scene = ball(law(0.3, rolling_resistance=2e-3, spinning_friction=1e-3), (0.3, 0.1, 0, 0.5, 1.0, 0.4))
    (element,) = scene.elements
    found = truth_of(turned_mechanism(element.mechanism, turn, (0.0, 0.0, 0.0)), np.linspace(0.0, 0.6, 4))  # type: ignore[attr-defined]  # a mechanism
    assert [event.kind for event in found.events] != []
    np.testing.assert_allclose(found.record.wrench[:, 0], 0.0, atol=1e-13)


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (0.4, -1.1, 2.3)])
def test_a_guided_foot_shares_its_load_and_does_not_tear(turn: tuple[float, float, float]) -> None:
    """A foot with friction on a floor along which its guide lies has no determinate normal force: no paradox."""
    scene = ball(law(0.3), slope=0.2)
    (element,) = scene.elements
    slide = Joint("slide", "prismatic", "world", "ball", (0, 0, RADIUS), axis=(1, 0, 0), v0=(0.5,))
    guided = replace(element.mechanism, joints=(slide,))  # type: ignore[attr-defined]  # a mechanism
    with pytest.raises(Refused, match="joints already hold the body of contact off its surface"):
        truth_of(turned_mechanism(guided, turn, (0.0, 0.0, 0.0)), np.linspace(0.0, 0.6, 4))
