"""Truth of mechanisms with prescribed motions, against equations written by hand and geometry."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from mechanism_scenes import mechanism_named
from scipy.integrate import solve_ivp

from proofroll.core.dataset import ENDED, LAWS
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula, Signal, Table
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.truth.plug_in import MechanismTruth
from proofroll.truth.truth_of_mechanism import truth_of


def shaken(motion: Signal) -> Mechanism:
    """The shaken pendulum with a damped hinge and another motion."""
    mechanism = mechanism_named("shaken_pendulum")
    base, hinge = mechanism.joints
    return replace(mechanism, joints=(replace(base, motion=motion, q0=(), v0=()), replace(hinge, damping=0.01)))


@pytest.mark.nightly_of("True")
@pytest.mark.nightly
@pytest.mark.parametrize("table", [pytest.param(False, marks=pytest.mark.drill), True])
def test_a_shaken_pendulum_is_that_of_its_equation(table: bool) -> None:
    """Angle, place of the base and force of the drive are those of the pendulum's equation by another solver."""
    plain = mechanism_named("shaken_pendulum").joints[0].motion
    assert plain is not None
    motion: Signal = Table((0.05, 0.2, 0.3), (0.0, 0.1, -0.05)) if table else plain
    mechanism, times = shaken(motion), np.linspace(0, 0.4, 9)
    truth = truth_of(mechanism, times)
    m, c, inertia, g = 0.5, 0.2, 0.5 * 0.4**2 / 12, 9.81

    def rates(t: float, y: Any) -> list[float]:
        lift = g + float(moved(motion, t).acceleration)
        return [y[1], (m * c * lift * np.sin(y[0]) - 0.01 * y[1]) / (inertia + m * c * c)]

    states = [np.array([0.3, 0.0])]
    for a, b in itertools.pairwise(times):  # the corners of a table's accelerations are among the times
        states.append(solve_ivp(rates, (a, b), states[-1], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1])
    angle, rate = np.array(states).T
    at, slide = mechanism.place_of("hinge")[0], mechanism.place_of("shaker")[0]
    # DOP853 at 1e-13 over 20 periods of the base keeps 1e-11
    assert np.abs(truth.record.q[:, at] - angle).max() < 1e-11
    assert np.abs(truth.record.q[:, slide] - moved(motion, times).place).max() < 1e-14
    bend = np.array([rates(t, state)[1] for t, state in zip(times, np.array([angle, rate]).T, strict=True)])
    lift = g + moved(motion, times).acceleration
    force = (1.0 + m) * lift - m * c * (bend * np.sin(angle) + rate**2 * np.cos(angle))
    assert np.abs(truth.record.named[:, 0] - force).max() < 1e-10 * np.abs(force).max()
    assert truth.bars["named"][-1] < 1e-9 * np.abs(force).max()


@pytest.mark.nightly
def test_a_driven_four_bar_is_geometry() -> None:
    """The rocker has Freudenstein's angle, and the work of the drive is the change of energy."""
    mechanism, times = mechanism_named("driven_four_bar"), np.linspace(0, 1, 401)
    truth = truth_of(mechanism, times)
    a, b, c, d = 0.2, 0.5, 0.4, 0.5
    x = 2 * np.pi * times
    k = np.array([d / a, d / c, (a * a - b * b + c * c + d * d) / (2 * a * c)])
    one, two, three = np.cos(x) - k[0] - k[1] * np.cos(x) + k[2], -2 * np.sin(x), k[0] - (k[1] + 1) * np.cos(x) + k[2]
    rocker = 2 * np.arctan2(-two - np.sqrt(two**2 - 4 * one * three), 2 * one)
    axis = truth.record.q_WB[:, 2]  # a rotation about z: w, x, y, z
    turned = 2 * np.arctan2(axis[:, 3], axis[:, 0])
    # the body's x axis points from the coupler to the pivot
    off = np.angle(np.exp(1j * (turned - np.pi - rocker)))
    assert np.abs(off).max() < 1e-12
    energy = truth.record.placed(mechanism).energy()
    power = truth.record.named[:, 0] * 2 * np.pi
    h = times[1]
    work = h / 3 * (power[0] + power[-1] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum())
    assert work == pytest.approx(energy[-1] - energy[0], abs=1e-6 * np.abs(energy).max())
    assert np.ptp(power) > 1.0


def four_bar_moment(times: Array) -> Array:
    """Moment on the crank of the driven four-bar by virtual power, from its geometry alone [N m]."""
    speed, g, ground = 2 * np.pi, 9.81, 0.5
    # length of each link, its mass, distance of its centre of mass from the link's first end, moment of inertia there
    links = ((0.2, 0.32, 0.1, 0.0011093333333333335), (0.5, 0.8, 0.25, 0.01677333333333333))
    links += ((0.4, 0.64, 0.2, 0.008618666666666669),)
    (a, *_), (b, *_), (c, *_) = links
    crank = speed * times
    tip = a * np.exp(1j * crank)
    diagonal = ground - tip
    bend = np.arccos((b**2 + np.abs(diagonal) ** 2 - c**2) / (2 * b * np.abs(diagonal)))
    coupler = np.angle(diagonal) + bend
    rocker = np.angle(ground - tip - b * np.exp(1j * coupler))
    units = np.exp(1j * np.array([crank, coupler, rocker]))
    moment = np.zeros(len(times))
    for k in range(len(times)):
        (p, q, r), lengths = units[:, k], (a, b, c)
        rows = np.array([[(1j * b * q).real, (1j * c * r).real], [(1j * b * q).imag, (1j * c * r).imag]])
        known = 1j * a * p * speed
        w = np.array([speed, *np.linalg.solve(rows, [-known.real, -known.imag])])
        centripetal = -sum(length * u * rate**2 for length, u, rate in zip(lengths, (p, q, r), w, strict=True))
        turning = np.array([0.0, *np.linalg.solve(rows, [-centripetal.real, -centripetal.imag])])
        velocity = acceleration = 0j  # of the first end
        for (length, mass, centre, inertia), u, rate, bent in zip(links, (p, q, r), w, turning, strict=True):
            v, dv = 1j * u * rate, 1j * u * bent - u * rate**2
            moving, pulled = velocity + centre * v, acceleration + centre * dv + 1j * g
            moment[k] += (mass * (pulled * moving.conjugate()).real + inertia * rate * bent) / speed
            velocity, acceleration = velocity + length * v, acceleration + length * dv
    return moment


@pytest.mark.nightly
def test_inverse_dynamics_through_a_loop_is_virtual_power() -> None:
    """The moment that drives a closed linkage is what links take, each by its own acceleration, over the speed."""
    times = np.array([0.0, 0.07, 0.31, 0.5])
    truth = truth_of(mechanism_named("driven_four_bar"), times)
    moment = four_bar_moment(times)
    assert np.ptp(moment) > 1.0
    assert np.abs(truth.record.named[:, 0] - moment).max() < 1e-11 * np.abs(moment).max()


def on_a_moved_plate(kind: str, axis: tuple[float, float, float], motion: str) -> Mechanism:
    """A ball at rest beside a plate that moves under it."""
    bodies = (Body("plate", 2.0, inertia=(0.1, 0.1, 0.1)), Body("ball", 0.5, inertia=(0.002, 0.002, 0.002)))
    joints = (
        Joint("shaker", kind, "world", "plate", axis=axis, motion=Formula(motion)),  # type: ignore[arg-type]
        Joint("free", "free", "world", "ball", q0=(0, 0, 0.1, 1, 0, 0, 0)),
    )
    shapes = (Geometry("floor", "plate", "plane"), Geometry("skin", "ball", "sphere", radius=0.1))
    return Mechanism(bodies, joints, geometries=shapes, pairs=(Pair("p", ("skin", "floor"), friction=0.4),))


@pytest.mark.drill
def test_a_ball_follows_a_plate_that_shakes_until_it_would_pull() -> None:
    """A ball on a plate at A (1 − cos ωt) presses with m (g + A ω² cos ωt), and leaves where that is zero."""
    size, pace = 0.02, 30.0
    mechanism = on_a_moved_plate("prismatic", (0, 0, 1), f"{size}*(1 - cos({pace}*t))")
    leaves = float(np.arccos(-9.81 / (size * pace**2)) / pace)
    times = np.linspace(0.0, 0.9 * leaves, 4)
    found = truth_of(mechanism, np.append(times, 1.05 * leaves))
    height = 0.1 + size * (1 - np.cos(pace * times))
    assert np.abs(found.record.p_WB[:4, 1, 2] - height).max() <= 1e-13
    assert found.pressed is not None
    force = 0.5 * (9.81 + size * pace**2 * np.cos(pace * times))
    assert np.abs(found.pressed[:4, 0, 2] - force).max() <= 1e-10
    (event,) = [event for event in found.events if event.kind == "lift_off"]
    assert abs(event.time - leaves) <= 1e-12


@pytest.mark.drill
def test_a_belt_drags_a_ball_until_it_rolls() -> None:
    """On a belt that moves at v a ball slides with μ g until its place of contact has the belt's speed."""
    mechanism, mu, speed = on_a_moved_plate("prismatic", (1, 0, 0), "0.7*t"), 0.4, 0.7
    rolls = speed / (mu * 9.81 * (1 + 0.5 * 0.1**2 / 0.002))
    times = np.array([0.0, 0.5 * rolls, 2 * rolls])
    found = truth_of(mechanism, times)
    expected = mu * 9.81 * np.minimum(times, rolls)
    assert np.abs(found.record.v_WB[:, 1, 0] - expected).max() <= 1e-12
    (event,) = [event for event in found.events if event.kind == "stick"]
    assert abs(event.time - rolls) <= 1e-12


@pytest.mark.drill
def test_friction_and_stops_beside_a_motion_switch_alike() -> None:
    """Both routes and the projection method find the same impacts and slips of a hinge on a moved base."""
    mechanism, times = mechanism_named("shaken_pendulum"), np.linspace(0, 1, 11)
    base, hinge = mechanism.joints
    slow = replace(base, motion=Formula("0.05*(1 - cos(15*t))"), q0=(), v0=())
    rubbing = replace(hinge, friction=0.05, limits=(-1.2, 1.2))
    switching = replace(mechanism, joints=(slow, rubbing))
    truth = truth_of(switching, times)
    assert {"impact", "lift_off", "turn"} <= {event.kind for event in truth.events}
    assert truth.bars["q"][-1] < 1e-11
    scene: Any = load_scene("shaken_pendulum")
    changed = replace(scene, elements=(replace(scene.elements[0], mechanism=switching),))
    run = simulate(changed, "projection", until=1.0, every=0.1)
    # the method's own tolerance is 2e-14, its switches are found to 1e-12
    assert np.abs(run["q.hinge"].to_numpy() - truth.record.q[:, 1]).max() < 1e-10
    assert np.abs(run["drive.shaker"].to_numpy() - truth.record.named[:, 0])[1:].max() < 1e-8


@pytest.mark.nightly_of("3.0")
@pytest.mark.nightly
@pytest.mark.parametrize("angle", [0.3, pytest.param(3.0, marks=pytest.mark.drill)])
def test_a_motion_that_leaves_nothing_free_holds_its_laws(angle: float) -> None:
    """Where all is prescribed no state bounds the steps, and yet each law is held over the whole turn."""
    body = Body("arm", mass=1.0, com=(0.3, 0.0, 0.0), inertia=((0.03, 0, 0), (0, 0.02, 0), (0, 0, 0.02)))
    motion = Table((0.0, 0.1), (0.0, angle))
    joint = Joint("hinge", "revolute", "world", "arm", axis=(0.0, 1.0, 0.0), motion=motion)
    mechanism = Mechanism(bodies=(body,), joints=(joint,), gravity=(0.0, 0.0, -9.81))
    truth = MechanismTruth.truth(MechanismElement(mechanism), np.linspace(0, 0.1, 3), ())
    assert (ENDED in truth.attrs, "stretch" in truth.attrs[LAWS]) == (False, True)
    assert truth["q.hinge"][1] == pytest.approx(angle / 2, rel=1e-14)  # the spline is symmetric
