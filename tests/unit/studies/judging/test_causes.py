"""Typical mistakes in trajectories of users are named, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import InputError
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.parts import Point
from proofroll.files.scene_file import load_scene
from proofroll.studies.judging.causes import GivenVariable, causes_of

TIMES = np.linspace(0.0, 2.0, 41)
ONE, TWO = np.sin(3 * TIMES) + 0.3, np.cos(2 * TIMES) - 0.1


def said(one: Any, two: Any, unit: str = "rad") -> list[str]:
    """Causes of two given variables whose true values are ONE and TWO."""
    given = {"q.a": GivenVariable(np.asarray(one), ONE, unit), "q.b": GivenVariable(np.asarray(two), TWO, unit)}
    return causes_of(given, TIMES, [])


@pytest.mark.parametrize(
    ("one", "two", "words"),
    [
        (ONE * 180 / np.pi, TWO, "q.a is 57.3 times the truth: degrees?"),
        (-ONE, TWO, "q.a is the opposite of the truth: its sign?"),
        (ONE, ONE + TWO, "q.b is its sum with q.a: an absolute angle"),
        (TWO, ONE, "q.a and q.b are each the other: swapped columns?"),
        (ONE + 0.2 * np.exp(-TIMES), TWO, "the first row is not the scene's start: q.a 0.5 instead of 0.3 rad"),
    ],
    ids=["degrees", "sign", "absolute", "swapped", "start"],
)
def test_a_mistake_is_named_alone(one: Any, two: Any, words: str) -> None:
    """One clause, with the difference that it closes."""
    (only,) = said(one, two)
    assert only.startswith(words)


def test_a_motion_that_differs_otherwise_has_no_cause() -> None:
    """A wrong amplitude, a late motion and the truth itself are no mistake of this kind."""
    for one in (1.1 * (ONE - 0.3) + 0.3, np.sin(3 * TIMES - 0.3 * TIMES) + 0.3, ONE):
        assert said(one, TWO) == []


def test_millimetres_are_named() -> None:
    """A length in another unit."""
    assert said(1e3 * ONE, TWO, "m")[0].startswith("q.a is a thousand times the truth: millimetres?")


def falling() -> Scene:
    """A body that falls."""
    body, joint = Body("body", 1.0, inertia=(0.1, 0.1, 0.1)), Joint("float", "free", "world", "body")
    made = Mechanism((body,), (joint,), points=(Point("middle", "body"),), gravity=(0, 0, -10))
    return Scene("fall", "", (MechanismElement(made),))


@pytest.mark.parametrize("kept", [0.96, 1.0])
def test_damping_of_a_free_body_is_named(kept: float) -> None:
    """Steps of 1/240 s that keep 96 % of the velocity in a second; without, their first-order error is no damping."""
    h, z, v, rows = 1 / 240, 0.0, 0.0, [0.0]
    for _ in range(240):
        v = (v - 10 * h) * kept**h
        z += v * h
        rows.append(z)
    judged = proofroll.judge({"time": np.arange(241) * h, "middle.z": rows}, falling(), {"middle.z": "1e-3 m"})
    assert not judged.agrees
    assert ["damping of 0.041 1/s" in cause for cause in judged.causes] == ([True] if kept < 1 else [])
    assert ("cause: middle.z is slowed down" in str(judged)) is (kept < 1)


def test_milliseconds_that_are_read_as_seconds_are_named() -> None:
    """Times a thousand times too long are found before a truth of that length is."""
    scene = load_scene("pendulum")
    (hinge,) = (joint.name for joint in scene.elements[0].mechanism.joints)  # type: ignore[attr-defined]  # of a mechanism
    times = np.linspace(0.0, 0.2, 6)
    run: dict[str, Callable[..., Any] | Any] = {"time": 1e3 * times, f"q.{hinge}": truth(scene, times)[f"q.{hinge}"]}
    with pytest.raises(InputError, match=r"with these times in milliseconds it follows the truth"):
        proofroll.judge({name: np.asarray(values) for name, values in run.items()}, scene)
