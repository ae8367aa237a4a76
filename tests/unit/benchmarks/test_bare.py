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
from proofroll_benchmarks.adapters import CONTACTS, MECHANISMS, VARIANTS
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


@pytest.mark.one_in(4)
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


@pytest.mark.one_in(4)
@pytest.mark.parametrize("scene", MECHANISMS)
@pytest.mark.parametrize(
    ("engine", "formulation", "preset"),
    [
        ("mujoco", "joints", "matched"),
        ("exudyn", "redundant", "matched"),
        ("exudyn", "spheres", "matched"),
        ("pinocchio", "null_space", "matched"),
        ("pinocchio", "constraint_dynamics", "tuned"),
        ("projection", "dependent", "default"),
        ("projection", "dependent", "matched"),
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


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("scene", CONTACTS)
def test_bare_loops_of_bodies_that_touch(scene: str) -> None:
    """Every formulation that represents a scene with contacts has a bare loop, which ends where the adapter does."""
    measured = []
    for engine in ("mujoco", "exudyn", "pinocchio", "projection"):
        kind, loaded = load_engine(engine), load_scene(scene)
        for formulation in (name for name in kind.presets if loaded.requires <= set(kind.provides[name])):
            settings = resolve_settings(kind, {"formulation": formulation})
            try:
                built = kind.build(loaded, settings)
            except Refused:
                continue
            bare = load_bare_loop(engine)(load_scene(scene), settings)
            built.advance(0.02)
            built.advance(0.04)
            assert not bare.lacks
            assert np.linalg.norm(bare.run(np.array([0.0, 0.02, 0.04])) - built.sample().p_WB) <= bare.tolerance
            measured.append(formulation)
    assert {"geoms", "impulses", "dependent"} <= set(measured)


@pytest.mark.parametrize(("engine", "formulation"), [("mujoco", "geoms"), ("exudyn", "spheres")])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_loop_that_lacks_a_part_names_it(engine: str, formulation: str, variant: str) -> None:
    """Neither MuJoCo nor Exudyn has a curved wall or rolling resistance: their own steps go elsewhere."""
    settings = resolve_settings(load_engine(engine), {"formulation": formulation})
    bare = load_bare_loop(engine)(
        load_scene("sphere_in_cylinder", **{"rolling_resistance": 0, **VARIANTS[variant]}), settings
    )
    assert bare.lacks == ("wall and rolling resistance" if VARIANTS[variant] else "wall")
