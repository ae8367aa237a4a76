"""Sizes to which percentages refer: the same wherever frames of bodies sit, and for what is steady."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.studies.judging.reference import Reference

TIMES = np.linspace(0.0, 1.0, 21)


def pendulum(at_hinge: bool) -> Scene:
    """A rod whose body frame is at the hinge or at its centre of mass."""
    arm = (0.0, 0.5, 0.0)
    down = (0.0, -0.5, 0.0)
    joint = Joint("pivot", "revolute", "world", "rod", q0=(1.0,), child_position=(0, 0, 0) if at_hinge else arm)
    body = Body("rod", 1.0, down if at_hinge else (0, 0, 0), inertia=(1 / 12, 1e-3, 1 / 12))
    return Scene("rod", "", (MechanismElement(Mechanism((body,), (joint,), gravity=(0, -9.81, 0))),))


@pytest.mark.drill
def test_sizes_hang_on_no_frame() -> None:
    """A frame in the hinge stands still; speeds and ways have the size that they have with one elsewhere."""
    sizes = [Reference.of(scene, truth(scene, TIMES)).sizes for scene in map(pendulum, (True, False))]
    for name in ("p_WB", "v_WB", "w_WB", "positions"):
        assert sizes[0][name] == pytest.approx(sizes[1][name], rel=1e-9), name
    assert sizes[0]["v_WB"] > 0.4 * sizes[0]["w_WB"]


@pytest.mark.parametrize(("faster", "agrees"), [(1.005, True), (1.02, False)])
def test_a_steady_velocity_has_its_own_size(faster: float, agrees: bool) -> None:
    """Of a body that spins and moves steadily half a per cent too fast agrees, two per cent differ."""
    body, joint = (
        Body("body", 1.0, inertia=(1.0, 1.0, 2.0)),
        Joint("free", "free", "world", "body", v0=(2, 0, 0, 0, 0, 5)),
    )
    scene = Scene("spin", "", (MechanismElement(Mechanism((body,), (joint,))),))
    true = truth(scene, TIMES)
    run: dict[str, Any] = {"time": TIMES, "p_WB": true.p_WB, "q_WB": true.q_WB}
    run |= {name: true[name] * faster for name in ("v_WB", "w_WB")}
    found = proofroll.judge({name: np.asarray(values) for name, values in run.items()}, scene)
    assert found.agrees is agrees, str(found)


@pytest.mark.drill
def test_a_verdict_does_not_turn_with_the_axes() -> None:
    """An error of 0.8 % of the speed in each of three axes is more than 1 %, as in axes in which it lies along one."""
    scene = pendulum(False)
    true = truth(scene, TIMES)
    size = Reference.of(scene, true).sizes["v_WB"]
    for off, agrees in (([0.008] * 3, False), ([0.008 * 3**0.5, 0, 0], False), ([0.005] * 3, True)):
        run = {"time": TIMES, "p_WB": true.p_WB.to_numpy(), "q_WB": true.q_WB.to_numpy()}
        run |= {"v_WB": true.v_WB.to_numpy() + size * np.array(off), "w_WB": true.w_WB.to_numpy()}
        assert proofroll.judge(run, scene, {"v_WB": "1 %"}).agrees is agrees


@pytest.mark.parametrize("garbage", [0.0, -1.0, 3.0])
def test_places_alone_do_not_excuse_velocities_of_another_motion(garbage: float) -> None:
    """A tolerance of places alone still compares the velocities that are given with the motion."""
    scene = pendulum(False)
    true = truth(scene, TIMES)
    run = {"time": TIMES} | {name: true[name].to_numpy() for name in ("p_WB", "q_WB", "v_WB", "w_WB")}
    assert proofroll.judge(run, scene, {"p_WB": "1e-3 m"}).agrees
    found = proofroll.judge(run | {"v_WB": garbage * run["v_WB"]}, scene, {"p_WB": "1e-3 m"})
    assert not found.agrees
    assert "v_WB" in {item.judgement.observable for item in found.compared}
