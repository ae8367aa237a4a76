"""Static friction and tangential restitution of pairs: engines that have them agree, others say why they do not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mechanism_scenes import mechanism_named

import proofroll
from proofroll.core.errors import InputError
from proofroll.core.plugins import load_engine
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene

FILE = """
title = "a puck"
source = "this project"
[gravity]
magnitude = 9.81
[[bodies]]
name = "puck"
mass = 1.0
inertia = [0.01, 0.01, 0.01]
[[joints]]
name = "slide"
kind = "free"
parent = "world"
child = "puck"
q0 = [0, 0, 0.1, 1, 0, 0, 0]
[[geometries]]
name = "ball"
body = "puck"
kind = "sphere"
radius = 0.1
[[geometries]]
name = "floor"
body = "world"
kind = "plane"
[[pairs]]
name = "foot"
geometries = ["ball", "floor"]
"""


def climbing(static: float | None) -> Scene:
    """A foot that presses on a slope and slides up it along a rail."""
    joints = (
        Joint("rail", "prismatic", "world", "cart", axis=(1, 0, 0), v0=(-0.5,)),
        Joint("shaft", "prismatic", "cart", "foot", axis=(0, 0, 1), q0=(0.1,)),
    )
    shapes = (Geometry("sole", "foot", "sphere", radius=0.1), Geometry("floor", "world", "plane"))
    bodies = tuple(Body(name, 0.5, inertia=(0.01, 0.01, 0.01)) for name in ("cart", "foot"))
    pair = Pair("foot", ("sole", "floor"), 0.4, static_friction=static)
    parts = Mechanism(bodies, joints, geometries=shapes, pairs=(pair,), gravity=(2.5, 0.0, -9.5))
    return Scene("climbing", "", (MechanismElement(parts),))


@pytest.mark.drill
def test_static_friction_holds_what_kinetic_would_not() -> None:
    """A foot that slid up a slope stays with more static friction, else it slides back; the projection agrees."""
    ends = {}
    for static in (None, 0.7):
        scene = climbing(static)
        run = proofroll.simulate(scene, "projection[formulation=dependent]", until=0.5, every=0.05)
        ends[static] = float(run["v_WB"].to_numpy().ravel()[-3])
        if static is None:
            continue
        found = proofroll.judge(run, scene)
        assert found.agrees, str(found)
    assert ends[None] > 0.1
    assert abs(ends[0.7]) < 1e-9


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ("friction = {static = 0.5, kinetic = 0.3}", ""),
        ("friction = {static = 0.2, kinetic = 0.3}", "pairs.foot.static_friction = 0.2: kinetic friction, 0.3, must"),
        ("friction = {static = 0.2, kinetic = 0}", "pairs.foot.static_friction = 0.2: kinetic friction, 0, must lie"),
        ("friction = {static = inf, kinetic = 1}", "pairs.foot.static_friction = inf: must be finite"),
        ("friction = {static = 0.5}", "pairs.0.friction = {'static': 0.5}: give static and kinetic, or one number"),
        ("friction = {static = 0.5, dynamic = 0.3}", "pairs.0.friction.dynamic = 0.3: there is no such key here"),
        (
            "friction = {static = 0.5, kinetic = 0.3}\nstatic_friction = 0.5",
            "pairs.0.static_friction = 0.5: friction gives it already; remove one",
        ),
        ("friction = 1\ntangential_restitution = 2", "pairs.foot.tangential_restitution = 2.0: no impact returns more"),
    ],
)
def test_laws_of_a_pair_are_read(law: str, said: str, tmp_path: Path) -> None:
    """A table of two coefficients is read; each impossible law names its field, its value and what to do."""
    (tmp_path / "scene.toml").write_text(FILE + law)
    if not said:
        (pair,) = mechanism_named(str(tmp_path)).pairs
        assert (pair.static, pair.friction) == (0.5, 0.3)
        return
    with pytest.raises(InputError) as error:
        load_scene(str(tmp_path))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(("dt", "largest"), [(1e-3, 1.0), (2.5e-4, 0.02)])
def test_friction_against_spin_in_mujoco_is_that_of_a_pair_that_never_slips(dt: float, largest: float) -> None:
    """A ball that rolls and spins loses s m g / J of its spin each second, to rest; it rolls on as before."""
    mujoco, lost = load_engine("mujoco"), 0.005 * 0.5 * 9.81 / 5e-4
    joint = Joint("free", "free", "world", "ball", q0=(0, 0, 0.05, 1, 0, 0, 0), v0=(0.5, 0, 0, 0, 10, 10))
    shapes = (Geometry("sphere", "ball", "sphere", radius=0.05), Geometry("floor", "world", "plane"))
    pair, body = (
        Pair("contact", ("sphere", "floor"), np.inf, spinning_friction=0.005),
        Body("ball", 0.5, inertia=(5e-4,) * 3),
    )
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,))
    run = mujoco.build(mechanism, replace(mujoco.presets["geoms"]["tuned"], dt=dt))
    lines = MechanismElement(mechanism).certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    for t in (0.1, 0.15, 0.25, 0.4):
        run.advance(t)
        sample = run.sample()
        # a slow spin stops within some steps: friction against it is soft by (50 / s)²
        assert sample.w_WB[0, 2] == pytest.approx(max(10 - lost * t, 0.0), abs=1e-5 if t < 0.2 else largest)
        np.testing.assert_allclose(sample.p_WB[0], (0.5 * t, 0.0, 0.05), atol=20 * dt**2)
