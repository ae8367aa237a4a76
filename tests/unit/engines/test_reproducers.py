"""Programs that show what an engine does with a mechanism, without proofroll, move it as its adapter does."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from proofroll.core.engine_abilities import Reproduces
from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.core.program_text import imported_packages
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene


def kind_of(engine: str) -> Any:
    """The engine's class, if it is installed."""
    pytest.importorskip(engine)
    return load_engine(engine)


def requires_same_places(engine: str, scene: Scene, options: dict[str, Any], until: float) -> None:
    """Asserts that the program needs the engine alone and that its places at the end are those of the adapter."""
    kind = kind_of(engine)
    assert isinstance(kind, Reproduces)
    settings = resolve_settings(kind, options)
    text = kind.reproducer(scene, settings)
    assert "proofroll" not in text
    assert set(imported_packages(text.partition("\n\n")[0])) == {engine, "numpy"}
    program: dict[str, Any] = {}
    exec(compile(text, "program", "exec"), program)
    *_, (places, _, opened) = program["run"]([0.0, until])
    adapter = kind.build(scene, settings)
    adapter.advance(until)
    sample, mechanism = adapter.sample(), scene.elements[0].mechanism  # type: ignore[attr-defined]  # of a mechanism
    turned = Rotation.from_quat(sample.q_WB, scalar_first=True)
    followed = [(mechanism.body_index[body], place) for body, place in mechanism.followed]
    expected = [sample.p_WB[body] + turned[body].apply(place) for body, place in followed]
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-9)
    assert opened < 1e-3


@pytest.mark.parametrize(
    ("engine", "name", "options"),
    [
        ("mujoco", "four_bar", {"formulation": "joints", "preset": "tuned"}),
        ("mujoco", "arm_pd", {"formulation": "joints", "preset": "matched"}),
        ("exudyn", "four_bar", {"formulation": "redundant", "preset": "matched"}),
        ("exudyn", "double_pendulum", {"formulation": "tree", "preset": "matched"}),
        ("exudyn", "stop", {"formulation": "redundant", "preset": "tuned"}),
        ("exudyn", "spring_friction", {"formulation": "redundant", "preset": "tuned"}),
        ("exudyn", "arm_pd", {"formulation": "redundant", "preset": "matched"}),
        ("exudyn", "gear_pair", {"formulation": "redundant", "preset": "matched"}),
    ],
)
def test_the_same_motion(engine: str, name: str, options: dict[str, Any]) -> None:
    """Bodies, joints, loops, laws of joints, actuators and couplings are part of the program."""
    requires_same_places(engine, load_scene(name), options, 0.6)


def test_a_program_has_constant_forces() -> None:
    """Applied forces that do not change in time are part of the program."""
    loaded = load_scene("slung_load")
    (element,) = loaded.elements
    held = [dataclasses.replace(f, value=tuple(f.at(0.1)), reaction="world") for f in element.mechanism.forces]  # type: ignore[attr-defined]
    mechanism = dataclasses.replace(element.mechanism, forces=tuple(held))  # type: ignore[attr-defined]
    scene = dataclasses.replace(loaded, elements=(type(element)(mechanism),))  # type: ignore[call-arg]
    requires_same_places("exudyn", scene, {"formulation": "redundant", "preset": "matched"}, 0.1)


@pytest.mark.parametrize(
    ("engine", "name", "formulation", "words"),
    [
        ("exudyn", "saturated_servo", "redundant", "are functions"),
        ("exudyn", "sphere_in_cylinder", "carrier", "proofroll's"),
        ("mujoco", "sphere_in_cylinder", "chart", "not MuJoCo's alone"),
    ],
)
def test_what_has_no_program(engine: str, name: str, formulation: str, words: str) -> None:
    """Where there is no program of the engine alone, a sentence says why."""
    kind = kind_of(engine)
    with pytest.raises(Refused, match=words):
        kind.reproducer(load_scene(name), resolve_settings(kind, {"formulation": formulation}))
