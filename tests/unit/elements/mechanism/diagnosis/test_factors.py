"""Factors on numbers of a mechanism that fit an engine's motion: which of them are causes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from proofroll.core.arrays import FloatArray
from proofroll.core.certificate import Line
from proofroll.core.diagnosis import Evidence, hypotheses_of
from proofroll.core.first_steps import OF_FIRST_STEPS
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.diagnosis.contacts_at_start import _FirstAccelerations, _other_friction
from proofroll.elements.mechanism.diagnosis.equations import Change, MechanismStates
from proofroll.elements.mechanism.diagnosis.joint_laws import _effort
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

ROUGH_ARM = Path(__file__).parents[4] / "drill/proofroll_drill/mutants/rough_arm"


def proven(evidence: Evidence) -> list[str]:
    """Proven causes, before several are compared."""
    hypotheses = hypotheses_of(evidence.element)
    return [cause.says for item in hypotheses for cause in item.test(evidence) if cause.proven]


def accelerations(element: MechanismElement, change: Change) -> FloatArray:
    """Accelerations and turning of the bodies at time 0 with other numbers, shape (bodies, 6)."""
    mechanism = element.mechanism

    def of(rates: Any) -> tuple[FloatArray, MechanismStates]:
        start, which = np.zeros((1, len(mechanism.bodies), 6)), np.zeros(1, dtype=int)
        motion = MechanismStates(mechanism, element.start, start, which).each[0].motion
        found = motion.J[:-1] @ rates + motion.bias[:-1]
        return found, MechanismStates(mechanism, element.start, found[None], which)

    def unbalanced(rates: Any) -> FloatArray:
        inertial, applied, _ = change.balance(of(rates)[1], 0)
        return np.asarray(inertial - applied)

    at = unbalanced(np.zeros(mechanism.nv))
    slopes = np.stack([unbalanced(one) - at for one in np.eye(mechanism.nv)], axis=-1)
    return of(-np.linalg.solve(slopes, at))[0]


def certified(element: MechanismElement, change: Change, when: str = "", tolerance: float = 1e-12) -> list[Any]:
    """Lines of a certificate whose first accelerations are those with other numbers."""
    lines, (own, found) = [], (accelerations(element, model) for model in (Change(element.mechanism), change))
    for name, part in (("acceleration", slice(0, 3)), ("angular acceleration", slice(3, 6))):
        one, other = own[:, part].ravel(), found[:, part].ravel()
        apart = float(np.max(np.abs(other - one)) / (np.max(np.abs(one)) or 1.0))
        told = Line(name + when, "1", tuple(one.tolist()), tuple(other.tolist()), apart, tolerance)
        lines.append(told.as_dict())
    return lines


def all_masses(mechanism: Mechanism, factor: float) -> Change:
    """A factor on the mass of each body."""
    return Change(mechanism, mass=factor * np.array([body.mass for body in mechanism.bodies]))


def last_mass(mechanism: Mechanism, factor: float) -> Change:
    """A factor on the mass of the last body."""
    mass = np.array([body.mass for body in mechanism.bodies])
    return Change(mechanism, mass=mass * [*np.ones(len(mass) - 1), factor])


def limits(mechanism: Mechanism, factor: float) -> Change:
    """A factor on the limits of the actuators."""
    return Change(mechanism, effort=_effort(limit=factor))


@pytest.mark.parametrize(("factor", "named"), [(2.0, True), (-1.0, False)])
@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("double_pendulum", all_masses, "all masses"),
        ("double_pendulum", last_mass, "the body lower with its mass"),
        ("saturated_servo", limits, "the limits of the actuators"),
    ],
)
def test_masses_and_limits_have_no_wrong_sign(
    name: str, change: Callable[[Mechanism, float], Change], words: str, factor: float, named: bool
) -> None:
    """Twice a mass or a limit is told by the first accelerations; minus it, which no engine has, is not."""
    (element,) = load_scene(name).elements
    assert isinstance(element, MechanismElement)
    said = proven(Evidence(element, certified(element, change(element.mechanism, factor))))
    assert any(f"{words} {'counted twice' if named else 'with'}" in each for each in said) is named, said


def arm(friction: float = 0.7, torque: float = 0.0, motor: float = 1.0) -> Scene:
    """Two rods with dry friction in each joint and a motor at the shoulder."""
    scene = load_scene(str(ROUGH_ARM))
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # it has one
    shoulder, elbow = (replace(joint, v0=(4.0,)) for joint in mechanism.joints)
    joints = shoulder, replace(elbow, friction=friction, torque=torque)
    driven = replace(mechanism, joints=joints, actuators=(Actuator("motor", "shoulder", "torque", target=motor),))
    return replace(scene, elements=(MechanismElement(driven),))


@cache
def run(**numbers: float) -> Any:
    """A run of the arm while it turns one way, so that a torque may stand for friction."""
    return simulate(arm(**numbers), "projection", until=0.06, every=0.004)


@pytest.mark.nightly
@pytest.mark.one_in(4)
@pytest.mark.drill_of("friction -1")
@pytest.mark.parametrize(
    ("numbers", "words", "named"),
    [
        ({"friction": 0.0, "torque": 0.7}, "friction of the joint elbow with the wrong sign", True),
        ({"friction": 0.0, "torque": 0.21}, "friction of the joint elbow", False),
        ({"motor": -1.0}, "the torques of the actuators with the wrong sign", True),
        ({"motor": -0.3}, "the torques of the actuators", False),
    ],
    ids=["friction -1", "friction -0.3", "motor -1", "motor -0.3"],
)
def test_a_negative_factor_along_a_run_is_a_wrong_sign_alone(
    numbers: dict[str, float], words: str, named: bool
) -> None:
    """Friction or a torque with the wrong sign is a cause; another negative factor, which nobody makes, is none."""
    (element,) = arm().elements
    said = proven(Evidence(element, [], run(**numbers), run()))
    assert any(words in each for each in said) is named, said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("factor", "tolerance", "named"), [(0.5, 1e-5, True), (0.9, 1e-5, True), (1.0, 1e-5, False), (1.0, 3e-2, True)]
)
def test_first_steps_of_the_scene_contradict_a_cause_of_the_run(factor: float, tolerance: float, named: bool) -> None:
    """Half the friction of a joint, as a run shows it, is named unless the first steps show exactly the scene's."""
    (element,) = arm().elements
    assert isinstance(element, MechanismElement)
    first = Change(element.mechanism, friction=np.array([1.0, factor]))
    lines = certified(element, first, OF_FIRST_STEPS, tolerance)
    said = proven(Evidence(element, lines, run(friction=0.35), run()))
    assert any("friction of the joint elbow halved" in each for each in said) is named, said


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize(
    ("foot", "factor", "words"),
    [("left", 0.5, "halved"), ("right", 0.0, "left out"), ("back", 0.0, "left out"), ("left", -0.02, "left out")],
)
def test_a_foot_without_friction_is_told_and_none_with_a_negative_one(foot: str, factor: float, words: str) -> None:
    """First accelerations without a foot's friction are none; a little beyond it, if the steps leave as much."""
    (element,) = load_scene("sled").elements
    assert isinstance(element, MechanismElement)

    def first(part: float) -> FloatArray:
        pairs = (replace(p, friction=(part if p.name == foot else 1.0) * p.friction) for p in element.mechanism.pairs)
        motion = MechanismElement(replace(element.mechanism, pairs=tuple(pairs))).first_motion
        return np.concatenate([motion.acceleration, motion.angular_acceleration], axis=-1)

    found = first(max(factor, 0.0)) + min(factor, 0.0) * (first(1.0) - first(0.0))
    said = f"friction of {foot} is {words}"
    off = abs(min(factor, 0.0)) > 0
    for allowed, known in ((0.0, [] if off else [said]), (0.02, [said])):
        line = {"quantity": f"acceleration{OF_FIRST_STEPS}", "tolerance": allowed, "holds": False}
        causes = _other_friction(_FirstAccelerations(Evidence(element, [line]), found))
        assert [cause.says for cause in causes if cause.proven] == known
