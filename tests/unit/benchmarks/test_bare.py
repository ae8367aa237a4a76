"""Bare loops reach what the adapters reach."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest
from placed_balls import placed, scene_with

from proofroll.core.engine_abilities import require_provided
from proofroll.core.errors import Refused
from proofroll.core.plugins import load_engine, resolve_settings
from proofroll.files.scene_file import load_scene
from proofroll_benchmarks.adapters import MECHANISMS, VARIANTS
from proofroll_benchmarks.bare import load_bare_loop

FORMULATIONS = [
    (engine, formulation)
    for engine, formulations in {
        "projection": ("euler", "rotating_frame"),
        "exudyn": ("carrier", "rolling_disc"),
        "pinocchio": ("composite",),
        "mujoco": ("chart",),
    }.items()
    for formulation in formulations
]
TIMES = np.arange(7) * 0.02


def centres(
    engine: str, formulation: str, parameters: Mapping[str, float], times: np.ndarray = TIMES, **other: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Of the adapter and of the bare loop, ``other`` changing the latter's scene; and how far they may be apart."""
    kind = load_engine(engine)
    settings = resolve_settings(kind, {"formulation": formulation})
    scene = load_scene("sphere_in_cylinder", **parameters)
    require_provided(kind, formulation, scene)
    adapter = kind.build(scene, settings)
    for t in times[1:].tolist():
        adapter.advance(t)
    bare = load_bare_loop(engine)(load_scene("sphere_in_cylinder", **{**parameters, **other}), settings)
    assert bare.because
    return adapter.sample().p_WB, bare.run(times), bare.tolerance


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize(("engine", "formulation"), FORMULATIONS)
def test_the_bare_loop_ends_where_the_adapter_does(engine: str, formulation: str, variant: str) -> None:
    """Each engine's bare loop gives the adapter's centre to its tolerance, wherever there is the variant."""
    adapter, bare, tolerance = centres(engine, formulation, VARIANTS[variant])
    assert tolerance <= 1e-5
    assert np.linalg.norm(adapter - bare) <= tolerance


@pytest.mark.parametrize(("engine", "formulation"), FORMULATIONS)
def test_another_model_is_noticed(engine: str, formulation: str) -> None:
    """A bare loop of a ball with a hundredth more gravity ends further away than any tolerance allows."""
    adapter, bare, tolerance = centres(engine, formulation, {}, gravity=9.9)
    assert np.linalg.norm(adapter - bare) > tolerance


@pytest.mark.parametrize(("engine", "formulation"), FORMULATIONS)
def test_another_start_is_refused(engine: str, formulation: str) -> None:
    """Bare loops are written for a start at the cylinder's zero of angle and height, and say so of another one."""
    scene = load_scene("sphere_in_cylinder")
    start = dataclasses.replace(placed(scene).start, coordinates=(0.3, 0.1))
    settings = resolve_settings(load_engine(engine), {"formulation": formulation})
    with pytest.raises(Refused, match="cylinder"):
        load_bare_loop(engine)(scene_with(scene, start=start), settings)


@pytest.mark.parametrize("scene", MECHANISMS)
@pytest.mark.parametrize(
    ("engine", "formulation", "preset"),
    [
        ("mujoco", "joints", "matched"),
        ("exudyn", "redundant", "matched"),
        ("pinocchio", "null_space", "matched"),
        ("projection", "dependent", "default"),
    ],
)
def test_bare_mechanisms_end_where_the_adapters_do(engine: str, formulation: str, preset: str, scene: str) -> None:
    """A ratio compares the same motion: the origins of all bodies are where the adapter has them, and have moved."""
    kind = load_engine(engine)
    settings = resolve_settings(kind, {"formulation": formulation, "preset": preset})
    built = kind.build(load_scene(scene), settings)
    before = np.array(built.sample().q_WB)
    bare = load_bare_loop(engine)(load_scene(scene), settings)
    built.advance(0.04)
    after = built.sample()
    assert np.abs(np.array(after.q_WB) - before).max() > 1e-4
    assert np.linalg.norm(bare.run(np.array([0.0, 0.02, 0.04])) - after.p_WB) <= bare.tolerance


def test_a_formulation_without_a_bare_loop_is_refused() -> None:
    """Steps of contacts between bodies have none, and say so."""
    settings = resolve_settings(load_engine("pinocchio"), {"formulation": "impulses"})
    with pytest.raises(Refused, match="no bare loop of contacts"):
        load_bare_loop("pinocchio")(load_scene("pendulum"), settings)
