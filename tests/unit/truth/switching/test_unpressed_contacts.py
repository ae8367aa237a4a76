"""Contacts that nothing presses or parts: closed or open they move alike, and no route asks which."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Force, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula
from proofroll.truth.truth_of_mechanism import truth_of

TIMES = np.linspace(0.0, 0.5, 6)
G = 9.81


def wheel() -> Mechanism:
    """A balanced wheel that turns into its stop at 0.25 s."""
    axle = Joint("axle", "revolute", "world", "wheel", axis=(0, 1, 0), v0=(2.0,), limits=(-0.5, 0.5))
    return Mechanism((Body("wheel", 1.0, inertia=(0.1, 0.1, 0.2)),), (axle,))


def falling(speed: tuple[float, float, float], friction: float, turn: Rotation) -> Mechanism:
    """A ball on a box, both in free fall, in turned axes; ``speed``: of the ball along the box, and of its spin."""
    q, (along, across, spin) = tuple(turn.as_quat(scalar_first=True).tolist()), speed
    bodies = Body("box", 2.0, inertia=(0.02, 0.02, 0.02)), Body("ball", 1.0, inertia=(0.004, 0.004, 0.004))
    joints = (
        Joint("j", "free", "world", "box", q0=(0.0, 0.0, 0.0, *q)),
        Joint(
            "k",
            "free",
            "world",
            "ball",
            q0=(*turn.apply([0.02, 0.01, 0.2]).tolist(), *q),
            v0=(along, across, 0.0, 0.0, 0.0, spin),
        ),
    )
    shapes = Geometry("cube", "box", "box", size=(0.6, 0.6, 0.2)), Geometry("skin", "ball", "sphere", radius=0.1)
    pairs = (Pair("p", ("skin", "cube"), friction=friction),)
    return Mechanism(bodies, joints, gravity=tuple(turn.apply([0, 0, -G]).tolist()), geometries=shapes, pairs=pairs)


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("sled", [False, True], ids=["alone", "a sled stands by"])
def test_a_balanced_wheel_rests_on_its_stop(sled: bool) -> None:
    """It strikes its stop at the time of its closed form and stays there, whatever else touches the ground."""
    mechanism = wheel()
    if sled:
        block = Joint("block", "free", "world", "block", q0=(3.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0))
        mechanism = replace(
            mechanism,
            bodies=(*mechanism.bodies, Body("block", 1.0, inertia=(0.004, 0.004, 0.004))),
            joints=(*mechanism.joints, block),
            geometries=(Geometry("floor", "world", "plane"), Geometry("skin", "block", "sphere", radius=0.1)),
            pairs=(Pair("stands", ("skin", "floor"), friction=0.3),),
        )
    found = truth_of(mechanism, TIMES)
    assert [(event.kind, event.name) for event in found.events] == [("impact", "axle")]
    assert found.events[0].time == pytest.approx(0.25, abs=1e-13)
    assert (found.ended, found.horizon) == ("", np.inf)
    np.testing.assert_allclose(found.record.q[:, 0], np.minimum(2 * TIMES, 0.5), atol=1e-13)


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.parametrize("friction", [0.0, 0.3])
@pytest.mark.parametrize("speed", [(0.3, 0.0, 0.0), (0.2, -0.1, 2.0), (0.0, 0.0, 2.0), (0.0, 0.0, 0.0)], ids=str)
@pytest.mark.parametrize(
    "seed", [None, pytest.param(1, marks=pytest.mark.nightly), 2], ids=["upright", "turned", "turned again"]
)
def test_a_ball_slides_on_a_falling_box(seed: int | None, speed: tuple[float, float, float], friction: float) -> None:
    """Nothing presses it, so that it goes on at its speed, and no event happens."""
    turn = Rotation.identity() if seed is None else Rotation.random(random_state=seed)
    found = truth_of(falling(speed, friction, turn), TIMES)
    assert (found.ended, found.horizon, found.events) == ("", np.inf, ())
    fall = np.outer(-G / 2 * TIMES**2, [0, 0, 1.0])
    ball = np.array([0.02, 0.01, 0.2]) + np.outer(TIMES, [*speed[:2], 0.0]) + fall
    np.testing.assert_allclose(turn.inv().apply(np.array(found.record.p_WB[:, 0])), fall, atol=1e-13)
    np.testing.assert_allclose(turn.inv().apply(np.array(found.record.p_WB[:, 1])), ball, atol=1e-13)
    assert found.bars["p_WB"].max() < 1e-12


def test_a_contact_is_pressed_later() -> None:
    """A push that begins at rest presses the ball on the box: it takes the box along, without an impact."""
    mechanism = falling((0.0, 0.0, 0.0), 0.0, Rotation.identity())
    centred = replace(mechanism.joints[1], q0=(0.0, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0))
    push = Force("push", "ball", "force", (0.0, 0.0, Formula("-30*t**2")))
    found = truth_of(replace(mechanism, joints=(mechanism.joints[0], centred), forces=(push,)), TIMES)
    assert (found.ended, found.horizon, found.events) == ("", np.inf, ())
    together = -G / 2 * TIMES**2 - 10 / 12 * TIMES**4
    np.testing.assert_allclose(found.record.p_WB[:, 0, 2], together, atol=1e-12)
