"""Bodies that touch in Pinocchio: impulses of its solver of contact with friction, step by step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import Diverged, Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.sampling import mechanism_of
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene
from proofroll.running.simulation import simulate
from proofroll.truth.natural_units import Units

pytest.importorskip("pinocchio")

PINOCCHIO = load_engine("pinocchio")
PRESETS = PINOCCHIO.presets["impulses"]


@pytest.mark.one_in(3)
@pytest.mark.parametrize("units", [Units(1.0, 2.0**20, 1.0), Units(2.0**-10, 1.0, 1.0), Units(1.0, 1.0, 2.0**7)])
@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
def test_an_error_of_the_solver_does_not_hang_on_units(preset: str, units: Units) -> None:
    """A light, a large and a slow sled slide as the one on the slope does: tolerances know no kilogram and no metre."""
    scene, steps = load_scene("sled_on_slope"), 20
    (element,) = scene.elements
    other = replace(scene, elements=(replace(element, mechanism=units.mechanism(mechanism_of(scene))),))
    places = []
    for each, unit in ((scene, Units(1.0, 1.0, 1.0)), (other, units)):
        dt = 1e-3 / unit.time
        run = PINOCCHIO.build(each, replace(PRESETS[preset], dt=dt))
        run.advance(steps * dt)
        places.append(run.sample().p_WB[0] * unit.length)
    np.testing.assert_allclose(*places, rtol=0, atol=1e-12)


def test_the_first_body_may_be_the_world() -> None:
    """A pair written the other way round has the opposite force on its first body, and the same motion."""
    mechanism = mechanism_of(load_scene("sled"))
    turned = replace(
        mechanism, pairs=tuple(replace(pair, geometries=pair.geometries[::-1]) for pair in mechanism.pairs)
    )
    one, other = (PINOCCHIO.build(each, PRESETS["matched"]) for each in (mechanism, turned))
    for run in (one, other):
        run.advance(0.1)
    np.testing.assert_allclose(one.sample().p_WB, other.sample().p_WB, atol=1e-9)
    np.testing.assert_allclose(one.sample().contact_force, -other.sample().contact_force, atol=1e-5)


def test_a_wheel_that_creeps_by_less_than_a_float_squares_rests() -> None:
    """Dry friction takes no impulse of a speed of which no unit can be made; the wheel stays."""
    wheel = Body("wheel", 1.0, inertia=(2e-3, 2e-3, 2e-3))
    axle = Joint("axle", "revolute", "world", "wheel", v0=(1e-320,), friction=0.1)
    run = PINOCCHIO.build(Mechanism((wheel,), (axle,), gravity=(0.0, 0.0, 0.0)), PRESETS["matched"])
    run.advance(0.01)
    assert abs(run.sample().w_WB[0, 2]) < 1e-100


def test_pgs_is_refused_where_it_returns_wrong_impulses() -> None:
    """A rod's foot gives way much more in one direction than across it; a ball's in all alike, where PGS is right."""
    pgs = replace(PRESETS["matched"], solver="pgs")
    with pytest.raises(Refused, match=r"PGS returns a wrong impulse .* set solver=admm"):
        PINOCCHIO.build(load_scene("falling_rod"), pgs)
    run = PINOCCHIO.build(load_scene("spinning_bounce"), pgs)
    run.advance(0.33)


@pytest.mark.drill
def test_a_solver_that_gives_up_ends_the_run() -> None:
    """A solver that does not find the impulses ends the run, and its time is said."""
    run = PINOCCHIO.build(load_scene("free_turntable"), replace(PRESETS["matched"], solver="pgs"))
    with pytest.raises(Diverged, match=r"pgs solver did not reach .* at 1.*; a larger one may do"):
        run.advance(3.0)


def test_loops_beside_contacts_are_refused() -> None:
    """A loop has rows that these steps do not have, and the refusal says so."""
    bodies = (Body("a", mass=1.0, inertia=(0.1, 0.1, 0.1)), Body("b", mass=1.0, inertia=(0.1, 0.1, 0.1)))
    assert "redundant constraints" not in PINOCCHIO.provides["impulses"]
    assert not any("loops" in item for item in PINOCCHIO.provides["impulses"])
    floor, ball = Geometry("floor", "world", "plane"), Geometry("ball", "b", "sphere", radius=0.1)
    joints = (Joint("j", "revolute", "world", "a"), Joint("k", "free", "world", "b", q0=(0, 0, 0.1, 1, 0, 0, 0)))
    mechanism = Mechanism(bodies, joints, geometries=(floor, ball), pairs=(Pair("p", ("ball", "floor"), 0.3),))
    PINOCCHIO.build(mechanism, PRESETS["matched"])  # a tree with contacts is one


def _on_a_guide(**law: Any) -> Mechanism:
    """A mass of 1 kg on a vertical guide."""
    joint = Joint("guide", "prismatic", "world", "mass", **law)
    return Mechanism((Body("mass", 1.0, inertia=(0.1, 0.1, 0.1)),), (joint,))


@pytest.mark.one_in(2)
@pytest.mark.parametrize(("dt", "error"), [(1e-2, 4.5e-2), (1e-3, 4.4e-3)])
def test_dry_friction_is_of_first_order(dt: float, error: float) -> None:
    """A mass on a spring that rubs is off by as much as an impulse a step leaves, and samples change nothing."""
    scene = load_scene("spring_friction")
    run, alone = (PINOCCHIO.build(scene, replace(PRESETS["matched"], dt=dt)) for _ in range(2))
    found, times = [], np.arange(1, 31) * 0.05
    for t in times:
        run.sample()
        run.advance(float(t))
        found.append(run.sample().p_WB[0, 0])
    n = np.floor(times * 10 / np.pi)  # half swings are pi/10 s, and each ends 0.06 m nearer
    true = (-1.0) ** n * 0.03 + (0.97 - 0.06 * n) * np.cos(10 * times)
    assert 0.3 * error < np.abs(found - true).max() < 1.3 * error
    alone.advance(float(times[-1]))
    assert alone.sample().p_WB[0, 0] == run.sample().p_WB[0, 0]


def test_an_impulse_of_a_stop_is_no_friction() -> None:
    """A mass that rubs and falls on a stop has its friction up to the step in which it hits, and no more."""
    run = PINOCCHIO.build(_on_a_guide(q0=(0.1,), limits=(0.0, 2.0), friction=5.0), PRESETS["matched"])
    hit = np.sqrt(2 * 0.1 / (9.81 - 5.0))
    found = []
    for t in np.arange(1, 1000 * hit) / 1000:
        run.advance(float(t))
        found.append(run.sample().friction[0])
    np.testing.assert_allclose(found, 5.0, atol=1e-6)
    assert run.sample().stop[0] == 0.0


@pytest.mark.drill
def test_a_fast_ball_on_a_curved_wall_keeps_its_rolling_resistance():
    """Where the wall turns away faster than gravity pulls, a step's approach is no impact, which has no such moment."""
    scene = load_scene("sphere_in_cylinder", speed=8.0, rolling_resistance=5e-4)
    run, true = (
        simulate(scene, engine, until=0.2, every=0.1)
        for engine in ("pinocchio[formulation=impulses,preset=tuned]", "truth")
    )
    lost = float(true.energy[0] - true.energy[-1])
    assert lost > 1.0
    assert float(run.energy[0] - run.energy[-1]) == pytest.approx(lost, rel=1e-2)
