"""Bodies that touch in Pinocchio: impulses of its solver of contact with friction, step by step."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from proofroll.core.errors import Diverged, InputError, Refused
from proofroll.core.plugins import load_engine
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.contacts.geometry import Geometry, Pair
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.sampling import mechanism_of
from proofroll.files.scene_file import load_scene

pytest.importorskip("pinocchio")

PINOCCHIO = load_engine("pinocchio")
PRESETS = PINOCCHIO.presets["impulses"]
REST = (0.458107051786, 0.048503949880)  # of the sled [m], by two routes


@pytest.mark.parametrize(
    ("preset", "options", "low", "high"),
    [
        ("matched", {}, 4e-4, 1.6e-3),  # 8.4e-4, as all half-implicit steps
        ("tuned", {}, 1e-5, 2e-4),  # 5e-5 in the middle of the step
        ("matched", {"convex": True}, 6e-3, 2.6e-2),  # hops at friction times its slip
        ("matched", {"convex": True, "dt": 2.5e-4}, 6e-3, 2.6e-2),  # at every step: another limit
    ],
)
def test_a_sled_comes_as_near_as_its_law_and_its_steps_allow(
    preset: str, options: dict[str, Any], low: float, high: float
) -> None:
    """Coulomb's law leaves an error of steps; the convex problem another path, the same at a quarter of the step."""
    scene = load_scene("sled")
    run = PINOCCHIO.build(scene, replace(PRESETS[preset], **options))
    run.advance(0.05)
    risen = abs(float(run.sample().p_WB[0, 2]) - 0.1)
    run.advance(0.7)
    off = float(np.hypot(*(run.sample().p_WB[0, :2] - REST)))
    assert low < max(risen, off) < high


def test_normal_forces_are_those_at_rest() -> None:
    """Three feet at rest share the weight as the levers say."""
    run = PINOCCHIO.build(load_scene("sled"), PRESETS["matched"])
    run.advance(0.7)
    x, y = (0.15, 0.15, -0.20), (0.10, -0.10, 0.03)
    N = np.linalg.solve([np.ones(3), x, y], (2 * 9.81, 0, 0))
    np.testing.assert_allclose(run.sample().contact_force[:, 2], N, rtol=1e-6)


@pytest.mark.parametrize("name", ["sled", "eccentric_sphere", "free_turntable", "rattleback", "tilted_disc", "ladder"])
@pytest.mark.parametrize("preset", ["default", "matched", "tuned"])
def test_a_start_is_certified(name: str, preset: str) -> None:
    """Geometry, friction and first accelerations of every shape are the scene's, also on a plane that moves."""
    (element,) = load_scene(name).elements
    assert isinstance(element, MechanismElement)
    run = PINOCCHIO.build(load_scene(name), PRESETS[preset])
    lines = element.certify(run.built(), run.sample())
    assert [str(line) for line in lines if not line.holds] == []
    told = {line.quantity for line in lines if line.difference is not None}
    assert {"gaps", "normals of contact", "places of contact", "friction of contacts"} <= told
    assert "law of contact: hard contact by Coulomb's law" in told
    # what runs over a surface begins with J̇v alone, which a step finds one step late: softened to nothing
    assert "acceleration" in told or name in {"free_turntable", "tilted_disc"}


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


def test_a_ball_rebounds_by_its_restitution() -> None:
    """A ball that falls by half a metre leaves the floor with 0.8 of its speed, to a step of gravity."""
    scene = load_scene("spinning_bounce")
    run = PINOCCHIO.build(scene, PRESETS["matched"])
    assert run.built().contact_restitution.tolist() == [0.8]
    run.advance(0.33)
    speed = 0.8 * np.sqrt(2 * 9.81 * 0.5) - 9.81 * (0.33 - 0.319275)
    assert run.sample().v_WB[0, 2] == pytest.approx(speed, abs=3 * 9.81e-3)


def test_pgs_is_refused_where_it_returns_wrong_impulses() -> None:
    """A rod's foot gives way much more in one direction than across it; a ball's in all alike, where PGS is right."""
    pgs = replace(PRESETS["matched"], solver="pgs")
    with pytest.raises(Refused, match=r"PGS returns a wrong impulse .* set solver=admm"):
        PINOCCHIO.build(load_scene("falling_rod"), pgs)
    run = PINOCCHIO.build(load_scene("spinning_bounce"), pgs)
    run.advance(0.33)


def test_a_solver_that_gives_up_ends_the_run() -> None:
    """A solver that does not find the impulses ends the run, and its time is said."""
    run = PINOCCHIO.build(load_scene("free_turntable"), replace(PRESETS["matched"], solver="pgs"))
    with pytest.raises(Diverged, match=r"pgs solver did not reach .* at 1"):
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


@pytest.mark.parametrize(
    "options", [{"solver": None}, {"integrator": "rk4"}, {"projection": True}, {"formulation": "null_space"}]
)
def test_settings_that_do_nothing_here_are_refused(options: dict[str, Any]) -> None:
    """Options of other formulations are one line."""
    with pytest.raises(InputError, match="pinocchio"):
        replace(PRESETS["matched"], **options)
