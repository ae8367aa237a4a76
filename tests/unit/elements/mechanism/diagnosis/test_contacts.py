"""Causes of contacts: laws of friction other than Coulomb's, of real engines, and no accusation of an honest one."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from proofroll.core.diagnosis import Evidence, diagnose, hypotheses_of
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.mechanism.diagnosis.contacts import convex_cone_from_rest, friction_factor
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate

EVERY = 0.01
STEPS = {"default": 2e-3, "matched": 1e-3, "tuned": 1e-3}


@functools.cache
def followed(name: str, until: float, every: float) -> tuple[Scene, xr.Dataset]:
    """A scene and its truth."""
    scene = load_scene(name)
    grid = simulate(scene, "mujoco", until=until, every=every, formulation="geoms")["time"].to_numpy()
    return scene, truth(scene, grid)


def said(
    engine: str, formulation: str, preset: str, name: str = "sled", until: float = 0.1, every: float = EVERY
) -> list[str]:
    """Causes of an engine's run."""
    scene, true = followed(name, until, every)
    run = simulate(scene, engine, until=until, every=every, formulation=formulation, preset=preset)
    element = scene.elements[0]
    return [cause.says for cause in diagnose(Evidence(element, [], run, true, STEPS[preset]), hypotheses_of(element))]


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize(
    ("preset", "words"),
    [("default", "friction pyramid"), ("matched", "convex cone: the sliding contact hops at u_n = μ|u_t|")],
)
def test_mujocos_laws_of_friction_are_named(preset: str, words: str) -> None:
    """The pyramid and the convex cone are each the one cause, proven by the run's own forces and flights."""
    (only,) = said("mujoco", "geoms", preset)
    assert only.startswith(words)


@pytest.mark.nightly_of("2.0-0.05")
@pytest.mark.nightly
@pytest.mark.slow
@pytest.mark.parametrize(("until", "every"), [(2.0, 0.05), (0.6, 0.01)])
def test_a_pyramid_whose_slip_hardly_turns_is_named(until: float, every: float) -> None:
    """An eccentric sphere slips along the diagonal of MuJoCo's pyramid, while its friction turns by half a radian."""
    (only,) = said("mujoco", "geoms", "default", "eccentric_sphere", until, every)
    assert only.startswith("friction pyramid")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "formulation", "preset"), [("mujoco", "geoms", "tuned"), ("exudyn", "spheres", "matched")]
)
def test_engines_with_coulombs_law_are_accused_of_nothing(engine: str, formulation: str, preset: str) -> None:
    """A corrected cone and a penalty law have small errors, and no cause."""
    assert said(engine, formulation, preset) == []


@pytest.mark.drill
@pytest.mark.slow
def test_creep_of_a_regularised_law_is_named_with_its_speed() -> None:
    """A sled on a slope creeps in Exudyn by its regularised friction, the cause of no force beside a right path."""
    still = load_scene("sled_on_slope", speed=0.0, cross_speed=0.0, spin=0.0)
    run = simulate(still, "exudyn", until=0.2, every=EVERY, formulation="spheres", preset="matched")
    true, element = truth(still, run["time"].to_numpy()), still.elements[0]
    for settled in (frozenset[str](), frozenset({"positions"})):
        causes = diagnose(Evidence(element, [], run, true, 1e-3, settled), hypotheses_of(element))
        assert any("stick creep at 0.0001 m/s" in cause.says for cause in causes) == (not settled), causes


@pytest.mark.one_in(2)
@pytest.mark.drill
@pytest.mark.parametrize(("unexplained", "proven"), [(0.0, True), (0.03, False)])
def test_a_factor_of_friction_leaves_no_more_than_a_step_does(unexplained: float, proven: bool) -> None:
    """Halved friction is named from the forces of a run; a factor that leaves 3 % of the difference is by chance."""
    scene, times = load_scene("sled"), np.linspace(0, 0.1, 11)
    run, true = truth(load_scene("sled", friction=scene.parameters["friction"] / 2), times), truth(scene, times)
    force = run["contact_forces"].to_numpy().copy()
    across = np.linspace(-1, 1, force[..., 0].size).reshape(force.shape[:-1])  # along the floor, in no law
    force[..., 0] += unexplained * across * np.abs(force[..., :2]).max()
    run["contact_forces"] = (run["contact_forces"].dims, force, run["contact_forces"].attrs)
    causes = list(friction_factor.test(Evidence(scene.elements[0], [], run, true, 1e-3)))
    assert [cause.says for cause in causes if cause.proven][:1] == ["friction of all contacts is halved"] * proven


BOX = """
title = "A box that starts to slide"
source = "this project"
duration = 1.0
gravity = { magnitude = 9.81, direction = [0.5, 0, -0.8660254037844387] }
bodies = [{ name = "box", mass = 1.0, inertia = [0.0017, 0.0017, 0.0017] }]
joints = [{ name = "float", kind = "free", parent = "world", child = "box", q0 = [0, 0, 0.05, 1, 0, 0, 0] }]
pairs = [{ name = "rub", geometries = ["shape", "slope"], friction = 0.3 }]

[[geometries]]
name = "slope"
body = "world"
kind = "plane"

[[geometries]]
name = "shape"
body = "box"
kind = "box"
size = [0.1, 0.1, 0.1]
"""


@pytest.mark.drill
@pytest.mark.slow
@pytest.mark.parametrize("corrects", [False, pytest.param(True, marks=pytest.mark.nightly)])
def test_a_convex_cone_is_named_from_rest_with_a_remedy_that_holds(tmp_path: Path, corrects: bool) -> None:
    """A box that starts to slide rises at μ times its acceleration in MuJoCo; with the remedy it follows the truth."""
    folder = tmp_path / "box"
    folder.mkdir()
    (folder / "scene.toml").write_text(BOX)
    scene = load_scene(str(folder))
    engine, (element,) = load_engine("mujoco"), scene.elements
    settings = replace(engine.presets["geoms"]["matched"], cone_correction=corrects)
    built = engine.build(scene, settings)
    lines = [line.as_dict() for line in element.certify(built.built(), built.sample())]
    causes = list(convex_cone_from_rest.test(Evidence(element, lines)))
    if not corrects:
        (cause,) = causes
        assert cause.proven
        assert "cone_correction=true" in cause.remedy
        return
    assert not any(cause.proven for cause in causes)
    options = {"formulation": "geoms", "preset": "matched", "cone_correction": True}
    run = simulate(scene, "mujoco", until=0.1, every=0.02, **options)
    true = simulate(scene, "truth", until=0.1, every=0.02)
    for name, allowed in (("p_WB", 4e-4), ("v_WB", 2e-5), ("w_WB", 1e-7)):
        assert float(np.abs(run[name].to_numpy() - true[name].to_numpy()).max()) < allowed, name
