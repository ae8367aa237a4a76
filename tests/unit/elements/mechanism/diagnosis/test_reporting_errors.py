"""Engines that do not take the scene's start are told so, and nothing about their numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.certificate import Line
from proofroll.core.diagnosis.scene_diagnosis import diagnose_scene
from proofroll.core.first_steps import _CUBIC, OF_FIRST_STEPS
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

TIMES = np.linspace(0.0, 0.24, 13)


def arm(q: Sequence[float], v: Sequence[float]) -> Scene:
    """Two rods on hinges across each other."""
    bodies = tuple(Body(name, 1.0, (0, -0.5, 0), inertia=(1 / 12, 1e-3, 1 / 12)) for name in ("upper", "lower"))
    joints = (
        Joint("one", "revolute", "world", "upper", q0=(q[0],), v0=(v[0],)),
        Joint("two", "revolute", "upper", "lower", position=(0, -1, 0), axis=(1, 0, 0), q0=(q[1],), v0=(v[1],)),
    )
    return Scene("arm", "", (MechanismElement(Mechanism(bodies, joints, gravity=(0, -9.81, 0))),))


@pytest.mark.one_in(2)
@pytest.mark.nightly_of("q0-v0-it begins at rest, without the velocities of the scene")
@pytest.mark.drill
@pytest.mark.parametrize(
    ("q", "v", "said"),
    [
        ((0.7, 0.4), (0.0, 0.0), "it begins at rest, without the velocities of the scene"),
        pytest.param((0.0, 0.0), (2.0, -3.0), "all coordinates begin at zero", marks=pytest.mark.drill),
        pytest.param((0.0, 0.0), (0.0, 0.0), "it begins at rest with all coordinates at zero", marks=pytest.mark.drill),
    ],
)
def test_another_start_is_named(q: Sequence[float], v: Sequence[float], said: str) -> None:
    """A run that reports the scene's start and goes on from another one."""
    scene = arm((0.7, 0.4), (2.0, -3.0))
    true, run = truth(scene, TIMES), truth(arm(q, v), TIMES).copy(deep=True)
    for name in ("p_WB", "v_WB", "w_WB", "q_WB", "positions"):
        run[name][0] = true[name][0]
    causes = diagnose_scene(scene, [], run, true, 1e-3)
    assert [item.cause.id for item in causes] == ["start"]
    assert causes[0].sentence.startswith(f"the start was not taken: {said}")


@pytest.mark.drill
def test_a_start_that_contacts_exclude_is_not_tried() -> None:
    """With all coordinates at zero a grip that never slips would slip: the run is wrong, and no traceback says so."""
    joint = Joint("free", "free", "world", "ball", q0=(0, 0, 0.4, 1, 0, 0, 0), v0=(1, 0, 0, 0, 0, 0))
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=0.1),
        Geometry("floor", "world", "plane", position=(0, 0, -0.1)),
    )
    scene = Scene(
        "ball",
        "",
        (
            MechanismElement(
                Mechanism(
                    (Body("ball", 1.0, inertia=(0.004, 0.004, 0.004)),),
                    (joint,),
                    geometries=shapes,
                    pairs=(Pair("contact", ("sphere", "floor"), friction=math.inf, restitution=0.5),),
                )
            ),
        ),
    )
    true = truth(scene, TIMES)
    run = true.copy(deep=True)
    run["p_WB"] = 1.1 * run["p_WB"]
    assert "start" not in {item.cause.id for item in diagnose_scene(scene, [], run, true, 1e-3)}


def line(quantity: str, expected: Any, found: Any, holds: bool) -> dict[str, Any]:
    """A line of a certificate."""
    numbers: dict[str, Any] = {"expected": tuple(np.ravel(expected)), "found": tuple(np.ravel(found))}
    made = Line(quantity=quantity, unit="1", difference=0.0 if holds else 1e3, tolerance=1e-9, **numbers)
    return made.as_dict()


def test_velocities_that_vanish_in_a_step_are_no_light_masses() -> None:
    """First steps from the scene's velocities to those of rest: the start, not masses of a thousandth."""
    scene = arm((0.7, 0.4), (2.0, -3.0))
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    start, first = element.start, element.first_motion
    resting = replace(element.mechanism, joints=tuple(replace(j, v0=(0.0,)) for j in element.mechanism.joints))
    h, rest = 1e-3, MechanismElement(resting).first_motion
    lines = [line("mass", [1.0, 1.0], [1.0, 1.0], True)]
    for name, velocity, expected, made in (
        ("acceleration", start.v_WB[0], first.acceleration, rest.acceleration),
        ("angular acceleration", start.w_WB[0], first.angular_acceleration, rest.angular_acceleration),
    ):
        sampled = [velocity, *(made * h * steps for steps in (1, 2, 3))]
        lines.append(line(f"{name}{OF_FIRST_STEPS}", expected, np.tensordot(_CUBIC, sampled, 1) / h, False))
    causes = diagnose_scene(scene, lines)
    assert [item.cause.id for item in causes] == ["start"]


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize("given", [True, pytest.param(False, marks=pytest.mark.drill)])
def test_no_cause_contradicts_what_is_read_back(given: bool) -> None:
    """Masses that a model has are no cause; a run alone, of which nothing is read back, may have others."""
    scene = arm((0.7, 0.4), (2.0, -3.0))
    mechanism = scene.elements[0].mechanism  # type: ignore[attr-defined]  # of a mechanism
    weak = replace(mechanism, gravity=(0, -4.9, 0))
    run, true = truth(Scene("arm", "", (MechanismElement(weak),)), TIMES), truth(scene, TIMES)
    lines = [line("gravity", mechanism.gravity, mechanism.gravity, True)] if given else []
    said = " ".join(item.sentence for item in diagnose_scene(scene, lines, run, true, 1e-3))
    assert ("gravity" in said) is not given


@pytest.mark.parametrize(("factor", "said"), [(0.5, ["gravity"]), (0.7, [])])
def test_exact_accelerations_and_a_known_mistake_are_stronger_than_what_is_read_back(
    factor: float, said: list[str]
) -> None:
    """An engine whose accelerations are those of half the gravity moves by that, whatever its adapter reads back."""
    scene = arm((0.7, 0.4), (2.0, -3.0))
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)
    mechanism = element.mechanism
    gravity = np.array(mechanism.gravity)
    true, moved = (
        MechanismElement(replace(mechanism, gravity=tuple((part * gravity).tolist()))).first_motion
        for part in (1.0, factor)
    )
    lines = [
        line("gravity", gravity, gravity, True),
        line("acceleration", true.acceleration, moved.acceleration, False),
        line("angular acceleration", true.angular_acceleration, moved.angular_acceleration, False),
    ]
    assert [item.cause.id for item in diagnose_scene(scene, lines)] == said


@pytest.mark.drill
def test_a_start_beyond_a_stop_is_not_tried() -> None:
    """With all coordinates at zero a hinge would stand beyond its stop: the run is wrong, and no traceback says so."""
    limited = arm((0.7, 0.4), (0.0, 0.0)).elements[0].mechanism  # type: ignore[attr-defined]  # as arm makes it
    joints = (replace(limited.joints[0], limits=(0.2, 0.9)), limited.joints[1])
    scene = Scene("arm", "", (MechanismElement(replace(limited, joints=joints)),))
    true = truth(scene, TIMES)
    run = true.copy(deep=True)
    run["p_WB"] = 1.1 * run["p_WB"]
    assert "start" not in {item.cause.id for item in diagnose_scene(scene, [], run, true, 1e-3)}
