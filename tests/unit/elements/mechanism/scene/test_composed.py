"""Screws, gimbals, cylindrical joints: bad input and closed forms; test_composed_joints.py runs them in engines."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_body_scenes import one_body, refusal
from scipy.integrate import solve_ivp

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.truth.plug_in import MechanismTruth

TIMES = np.linspace(0.0, 1.0, 6)
MASS, INERTIA, LEAD, WEIGHT = 1.0, 1.0, -0.2, 3.0
PUSH = f'[[forces]]\nname = "f"\nbody = "b"\nkind = "force"\nvalue = [0, 0, {-WEIGHT}]\n'
START = "orientation = [0.3, -0.2, 0.1]\nq0 = [0.5, 0.4, -0.3]\n"


def of_truth(mechanism: Mechanism) -> Any:
    """Dataset of the truth."""
    return MechanismTruth.truth(MechanismElement(mechanism), TIMES, ())


@pytest.mark.parametrize(
    ("kind", "lines", "words"),
    [
        ("screw", "", "joints.0.lead is missing: this key is required"),
        ("screw", "lead = 0", "joints.j.lead = 0.0: a screw without lead is a revolute joint"),
        ("screw", "led = 0.1", "joints.0.led"),
        ("screw", 'lead = "3 mm"', "joints.0.lead"),
        ("screw", "lead = 0.1\nlimits = [1, 0]", "joints.j.limits"),
        ("screw", "lead = 0.1\nq0 = [0, 1]", "joints.j.q0"),
        ("gimbal", "q0 = 0.3", "joints.j.q0"),
        ("gimbal", "stiffness = [1, 2]", "joints.j.stiffness"),
        ("gimbal", "second_axis = [1, 0, 1]", "joints.j.second_axis"),
        ("gimbal", "torque = 1", "joints.0.torque"),
        ("gimball", "", "choose one of"),
        ("cylindrical", "q0 = 0.3", "joints.j.q0"),
        ("cylindrical", "limits = [0, 1]", "joints.j.limits"),
        ("cylindrical", "motion = 1", "a cylindrical joint has none"),
    ],
)
def test_a_wrong_composed_joint_gets_one_line(tmp_path: Path, kind: str, lines: str, words: str) -> None:
    """A wrong screw, gimbal or cylindrical joint is refused by one line that names the field that the file has."""
    assert words in refusal(tmp_path, kind, lines)


def screw(folder: Path, more: str) -> Mechanism:
    """A body on a screw along z, with further tables."""
    return one_body(folder, "screw", f"lead = {LEAD}\n{more}")


@pytest.mark.drill
def test_a_nut_turns_as_it_falls(tmp_path: Path) -> None:
    """A nut under a force F along a screw of lead r has the acceleration F / (m + I/r²), in both directions of r."""
    content = of_truth(screw(tmp_path, f"q0 = 0.7\nv0 = -0.4\n{PUSH}"))
    pull = -WEIGHT / (MASS + INERTIA / LEAD**2)
    place = LEAD * 0.7 - LEAD * 0.4 * TIMES + 0.5 * pull * TIMES**2
    assert np.max(np.abs(content["q.j.slide"].to_numpy() - place)) < 1e-13
    assert np.max(np.abs(content["q.j.turn"].to_numpy() - place / LEAD)) < 1e-13
    thread = MASS * pull + WEIGHT
    assert np.max(np.abs(content["coupling.j"].to_numpy() - thread)) < 1e-12


@pytest.mark.nightly
def test_what_a_screw_has_along_its_angle_acts_there(tmp_path: Path) -> None:
    """A spring about the axis swings the nut with the inertia I + m r²; a motion carries it along the axis."""
    content = of_truth(screw(tmp_path, "q0 = 0.5\nstiffness = 9\nrest = 0.1\n"))
    rate = np.sqrt(9.0 / (INERTIA + MASS * LEAD**2))
    assert np.max(np.abs(content["q.j.turn"].to_numpy() - 0.1 - 0.4 * np.cos(rate * TIMES))) < 1e-12
    moved = of_truth(screw(tmp_path, 'motion = "= 1 + 0.3*sin(2*t)"\n'))
    assert np.max(np.abs(moved["q.j.slide"].to_numpy() - LEAD * (1 + 0.3 * np.sin(2 * TIMES)))) < 1e-13


def test_a_body_on_an_inclined_cylindrical_joint_slides_and_swings(tmp_path: Path) -> None:
    """Along its axis it falls by a parabola, about it it swings as the pendulum of the weight across it."""
    lean, arm, start = 0.6, 0.4, 1.0
    lines = f"orientation = [0, {lean}, 0]\nchild_position = [0, {arm}, 0]\nq0 = [0.2, {start}]\nv0 = [0.3, 0]\n"
    content = of_truth(one_body(tmp_path, "cylindrical", lines + PUSH))
    axis = np.array([np.sin(lean), 0, np.cos(lean)])
    along = 0.2 + 0.3 * TIMES - 0.5 * WEIGHT * np.cos(lean) / MASS * TIMES**2
    places = content["p_WB"].to_numpy()[:, 0]
    assert np.max(np.abs(places @ axis - along)) < 1e-13
    # From the axis to the centre of mass; the weight across the axis pulls along -x of the joint.
    pull = WEIGHT * np.sin(lean) * arm / (INERTIA + MASS * arm**2)
    x, y = places @ [np.cos(lean), 0, -np.sin(lean)], places[:, 1]
    swing = np.arctan2(y, x)
    first = np.arctan2(-arm * np.cos(start), arm * np.sin(start))
    turn = solve_ivp(
        lambda _, s: [s[1], -pull * np.sin(s[0])], (0, 1), [first, 0.0], "DOP853", TIMES, rtol=1e-12, atol=1e-13
    )
    assert np.max(np.abs(swing - turn.y[0])) < 1e-11


@pytest.mark.drill
def test_a_gimbal_is_a_ball_joint(tmp_path: Path) -> None:
    """A heavy body that a gimbal holds off its centre moves as on a ball joint, from the pose of its three angles."""
    push = PUSH.replace("value", "position = [0.2, 0.1, 0.4]\nvalue")
    gimbal = one_body(tmp_path, "gimbal", f"axis = [0, 0, 1]\nsecond_axis = [1, 0, 0]\n{START}v0 = [1, 2, 3]\n{push}")
    mine = of_truth(gimbal)
    turn, spin = mine["q_WB"].to_numpy()[0, 0], mine["w_WB"].to_numpy()[0, 0]
    R = MechanismElement(gimbal).start.R_WB[0, 0]
    ball = of_truth(
        one_body(tmp_path, "spherical", f"q0 = {list(map(float, turn))}\nv0 = {list(map(float, R.T @ spin))}\n{push}")
    )
    assert np.max(np.abs(mine["w_WB"].to_numpy()[:, 0] - ball["w_WB"].to_numpy()[:, 0])) < 1e-11
    about = [np.array(gimbal.joints[k].axis) for k in range(3)]
    assert np.allclose(about, [(0, 0, 1), (0, 1, 0), (1, 0, 0)])


@pytest.mark.drill
def test_springs_of_a_gimbal_act_about_its_axes(tmp_path: Path) -> None:
    """Near its rest a ball of moment 1 on a gimbal swings about each axis by that axis' spring and damper."""
    size, stiffness = 1e-6, np.array([4.0, 9.0, 16.0])
    start = f"q0 = [{size}, {size}, {size}]\nstiffness = {stiffness.tolist()}\n"
    content = of_truth(one_body(tmp_path, "gimbal", start))
    for name, rate in zip(("outer", "middle", "inner"), np.sqrt(stiffness), strict=True):
        # products of two angles are 1e-12
        assert np.max(np.abs(content[f"q.j.{name}"].to_numpy() - size * np.cos(rate * TIMES))) < 1e-11
