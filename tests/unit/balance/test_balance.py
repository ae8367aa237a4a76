"""Equilibria, efforts that hold them, and eigenvalues, against closed forms; and in engines."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from proofroll.cli import app
from proofroll.core.errors import InputError, Refused
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.files.scene_file import load_scene
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll_balance.balance import balance, stilled
from proofroll_balance.linearised import Apart, InTree, apart, at_rest, spectrum

G = 9.81
FOUR_BAR = """
title = "the moment that holds a four-bar"
source = "google-deepmind/mujoco discussion 1818, rewritten"
[gravity]
magnitude = 9.81
"""
ROD = '[[bodies]]\nname = "{}"\nmass = {}\ncom = [{}, 0, 0]\ninertia = [0.001, {}, {}]\n'
JOINT = '[[joints]]\nname = "{}"\nkind = "{}"\nparent = "{}"\nchild = "{}"\nposition = [{}, 0, 0]\n'
FOUR_BAR += ROD.format("crank", 1.0, 0.5, 0.0833, 0.0833) + ROD.format("coupler", 2.0, 1.0, 0.6667, 0.6667)
FOUR_BAR += ROD.format("rocker", 2.0, 1.0, 0.6667, 0.6667)
FOUR_BAR += JOINT.format("motor", "fixed", "world", "crank", 0) + 'orientation = ["0 deg", "-90 deg", "0 deg"]\n'
FOUR_BAR += JOINT.format("pin", "revolute", "crank", "coupler", 1) + "axis = [0, -1, 0]\nq0 = -1.2\ndependent = true\n"
FOUR_BAR += JOINT.format("ground", "revolute", "world", "rocker", 2) + "axis = [0, -1, 0]\nq0 = 1.4\ndependent = true\n"
FOUR_BAR += """[[loops]]
name = "closing"
kind = "revolute"
body_a = "coupler"
position_a = [2, 0, 0]
axis_a = [0, -1, 0]
body_b = "rocker"
position_b = [2, 0, 0]
axis_b = [0, -1, 0]
"""


def written(folder: Path, text: str) -> str:
    """Path of a scene with this text."""
    folder.joinpath("scene.toml").write_text(text)
    return str(folder)


def named(found: Any) -> dict[str, float]:
    """Values of a balance by name."""
    return {item.name: item.value for item in found.values}


def test_a_fixed_joint_holds_a_four_bar(tmp_path: Path) -> None:
    """A fixed crank carries the moment of virtual work, 2.3810 N m, in the truth and in two engines."""
    engines = ("pinocchio[formulation=null_space]", "projection[formulation=dependent]")
    found = balance(written(tmp_path, FOUR_BAR), {}, engines)
    assert found.freedom == 0
    assert named(found)["torque.motor.y"] == pytest.approx(2.3810, abs=5e-5)
    assert max(item.error_bar for item in found.values) < 1e-12
    for item in found.engines:
        assert item.agrees
        assert item.reactions is not None
        assert item.reactions < 1e-12


def arm(stiffness: float = 0.0, angle: float = 0.5) -> Mechanism:
    """Rod of 2 kg and 1 m on a hinge, angle from the horizontal, with a spring of the joint at rest there."""
    body = Body("rod", 2.0, com=(0.5, 0, 0), inertia=((1e-3, 0, 0), (0, 1 / 6, 0), (0, 0, 1 / 6)))
    hinge = Joint(
        "hinge", "revolute", "world", "rod", axis=(0, -1, 0), q0=(angle,), v0=(3.0,), stiffness=stiffness, damping=0.7
    )
    return Mechanism((body,), (hinge,))


def test_the_effort_of_a_held_joint_is_that_of_its_weight() -> None:
    """A joint that is held where it starts needs the moment of the weight, whatever its velocity was."""
    still = stilled(arm(), ["hinge"])
    q = at_rest(JointCoordinates(still))
    drive = JointCoordinates(still).sample(q, np.zeros(1))["named"][0]
    assert drive == pytest.approx(2.0 * G * 0.5 * np.cos(0.5), rel=1e-14)


def test_an_equilibrium_on_a_spring_has_its_closed_form() -> None:
    """A rod on a sprung hinge comes to rest where spring and weight balance; its eigenvalues are the quadratic's."""
    still = stilled(arm(stiffness=40.0))
    equations = JointCoordinates(still)
    (q,) = at_rest(equations)
    assert 40.0 * q + 2.0 * G * 0.5 * np.cos(q) == pytest.approx(0.0, abs=1e-10)
    inertia, slope = 1 / 6 + 2.0 * 0.25, 40.0 - 2.0 * G * 0.5 * np.sin(q)
    exact = np.sort_complex(np.roots([inertia, 0.7, slope]))
    posed = replace(still, joints=tuple(replace(joint, q0=(q,)) for joint in still.joints))
    for route in (InTree(equations, np.array([q])), Apart(MaximalCoordinates(posed))):
        found = spectrum(route)
        assert apart(found.eigenvalues, exact) < 1e-9
        assert found.left < 1e-9


def test_what_has_no_single_equilibrium_is_refused(tmp_path: Path) -> None:
    """Contacts, dry friction, a fall and an unknown joint have one line each."""
    scene: Any = load_scene("pendulum_friction")
    with pytest.raises(Refused, match="dry friction in joint"):
        stilled(scene.elements[0].mechanism)
    with pytest.raises(Refused, match="contacts may hold"):
        balance("sled", {})
    with pytest.raises(InputError, match="--hold = 'knee': there is no such joint"):
        balance(written(tmp_path, FOUR_BAR), {}, hold=["knee"])
    falls = Mechanism((Body("b", 1.0, inertia=((1, 0, 0), (0, 1, 0), (0, 0, 1))),), (Joint("j", "free", "world", "b"),))
    with pytest.raises(Refused, match="no equilibrium near the start"):
        at_rest(JointCoordinates(falls))


@pytest.mark.nightly
def test_every_engine_finds_the_balance_of_an_arm_under_servos() -> None:
    """Efforts and eigenvalues of an arm on two servos are the truth's in each engine that has servos."""
    answer = CliRunner().invoke(app, ["balance", "arm_pd"])
    assert answer.exit_code == 0, answer.output
    found = balance("arm_pd", {})
    assert found.stable
    assert len(found.engines) >= 3
    for item in found.engines:
        assert not item.refused
        assert item.efforts is not None
        assert item.eigenvalues is not None
        assert max(item.efforts, item.eigenvalues) < 1e-6


def test_a_robot_is_balanced_under_its_controller(tmp_path: Path) -> None:
    """An arm of 2 kg at 0.25 m sinks from its target of 45 degrees until 20 (target - q) = m g l cos(q)."""
    inertia = '<inertia ixx="0.002" iyy="0.02" izz="0.02"/>'
    (tmp_path / "arm.urdf").write_text(
        f'<robot name="arm"><link name="base"/><link name="upper"><inertial><origin xyz="0.25 0 0"/><mass value="2"/>'
        f'{inertia}</inertial></link><joint name="j1" type="continuous"><parent link="base"/><child link="upper"/>'
        f'<axis xyz="0 -1 0"/></joint></robot>'
    )
    control = tmp_path / "hold.toml"
    control.write_text('[[gains]]\njoints = "*"\nkp = 20\nkd = 2.75\n[targets]\nj1 = "45 deg"\n')
    arguments = [str(tmp_path / "arm.urdf"), "--control", str(control), "--engine", "projection", "--json"]
    answer = CliRunner().invoke(app, ["balance", *arguments])
    assert answer.exit_code == 0, answer.output
    values = {item["name"]: item["value"] for item in json.loads(answer.stdout)["values"]}
    assert values["q.j1"] == pytest.approx(0.580295411627, abs=1e-11)
    assert values["effort.j1"] == pytest.approx(2 * 9.81 * 0.25 * np.cos(values["q.j1"]), rel=1e-12)
