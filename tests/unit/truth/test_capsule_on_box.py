"""A capsule and a box: rest and rolling on a face, a slide over a rim, collisions anywhere, and who runs them."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.rotations import to_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.switched_truth import truth_of

RADIUS, MASS, ACROSS, GRAVITY, SPEED = 0.05, 1.0, 0.012, 9.81, 0.9
TURN = Rotation.from_rotvec([0.3, -0.7, 0.5])
BARS = 1e-11  # 5e-13 is seen


def turned(vector: Any) -> tuple[float, float, float]:
    """A vector given in turned axes, in the world's."""
    x, y, z = TURN.apply(np.asarray(vector, dtype=float)).tolist()
    return x, y, z


def on_table(place: Any, v: Any, axis: Any, w: Any = (0, 0, 0), **law: float) -> Mechanism:
    """A free capsule on a fixed box whose upper face ends at x = 0, in turned axes."""
    shapes = (
        Geometry("rod", "rod", "capsule", radius=RADIUS, length=0.3, axis=axis),
        Geometry("table", "world", "box", turned((-0.5, 0, -0.1)), to_rpy(TURN.as_matrix()), size=(1.0, 0.6, 0.2)),
    )
    q = TURN.as_quat(scalar_first=True).tolist()
    return Mechanism(
        (Body("rod", MASS, inertia=(ACROSS, ACROSS, ACROSS)),),
        (Joint("j", "free", "world", "rod", q0=(*turned(place), *q), v0=(*v, *w)),),
        gravity=turned((0, 0, -GRAVITY)),
        geometries=shapes,
        pairs=(Pair("touch", ("rod", "table"), **({"friction": 0.0} | law)),),
    )


def followed(mechanism: Mechanism, times: Any) -> TwoRouteMotion:
    """Truth to the last time, whose bars are narrow."""
    found = truth_of(mechanism, np.array(times))
    assert np.isinf(found.horizon), found.reason
    assert max(float(np.nanmax(found.bars[name])) for name in ("p_WB", "v_WB", "w_WB")) < BARS
    return found


def test_a_capsule_rests_on_a_face() -> None:
    """Both ends bear half of its weight."""
    found = followed(on_table((-0.5, 0, RADIUS), (0, 0, 0), (0, 1, 0)), [0.0, 0.3])
    assert found.events == ()
    assert found.pressed is not None
    loads = found.pressed[-1] @ TURN.as_matrix()[:, 2]
    assert loads[:2] == pytest.approx([MASS * GRAVITY / 2] * 2, abs=1e-11)
    assert not np.nan_to_num(loads[2:]).any()


def over_the_rim(times: Any) -> Any:
    """Places of a rod that slides lengthwise over a rim from where its middle passes it; (times, 2)."""

    def rates(_: float, y: Any) -> list[float]:
        turn, along, w, u = y
        matrix = [[1, RADIUS, 0], [0, -along, -1 / MASS], [0, ACROSS, -along]]
        right = [along * w**2 + GRAVITY * np.sin(turn), (u + RADIUS * w) * w + u * w - GRAVITY * np.cos(turn), 0]
        slide, turning, _force = np.linalg.solve(matrix, right)
        return [w, u, turning, slide]

    turn, along = solve_ivp(rates, (0, times[-1]), [0, 0, 0, SPEED], "DOP853", times, rtol=1e-13, atol=1e-15).y[:2]
    return np.array([along * np.cos(turn) + RADIUS * np.sin(turn), RADIUS * np.cos(turn) - along * np.sin(turn)]).T


@pytest.mark.drill
def test_a_rod_that_slides_over_a_rim_tips_on_it_and_leaves_by_its_end() -> None:
    """Its side crosses the edge where its middle passes; an independent solver moves it so until its end passes."""
    start, since = -0.02, np.array([0.0, 0.05, 0.1, 0.15])
    passes = -start / SPEED
    found = followed(on_table((start, 0, RADIUS), (SPEED, 0, 0), (1, 0, 0)), [0.0, *(passes + since), passes + 0.19])
    assert [event.kind for event in found.events] == ["lift_off", "lift_off"]
    assert found.events[0].time == pytest.approx(passes, abs=1e-12)
    place = found.record.p_WB[1:-1, 0] @ TURN.as_matrix()
    np.testing.assert_allclose(place[:, [0, 2]], over_the_rim(since), rtol=0, atol=1e-11)


@pytest.mark.drill
@pytest.mark.parametrize("seed", [0, 4, 11])
def test_a_capsule_and_a_box_that_tumble_collide_without_overlap(seed: int) -> None:
    """Wherever they meet, they stay apart by MuJoCo's own distance and keep their momentum."""
    rng = np.random.default_rng(seed)
    turns = [Rotation.random(random_state=seed + k) for k in (0, 99)]
    way = rng.normal(size=3)
    way /= np.linalg.norm(way)
    v = turns[1].inv().apply(-3 * way + 0.2 * rng.normal(size=3))
    spins = rng.normal(size=3), 2 * rng.normal(size=3)
    starts = ((0, 0, 0), (0, 0, 0), spins[0]), (0.6 * way, v, spins[1])
    joints = tuple(
        Joint(f"j{name}", "free", "world", name, q0=(*p, *turn.as_quat(scalar_first=True)), v0=(*u, *w))
        for name, turn, (p, u, w) in zip("ab", turns, starts, strict=True)
    )
    bodies = (Body("a", 1.0, inertia=(0.012, 0.013, 0.011)), Body("b", 2.0, inertia=(0.05, 0.03, 0.04)))
    shapes = (
        Geometry("hull", "a", "box", size=(0.4, 0.3, 0.2)),
        Geometry("rod", "b", "capsule", radius=0.06, length=0.5),
    )
    pair = Pair("touch", ("hull", "rod") if seed % 2 else ("rod", "hull"), 0.3, 0.5)
    mechanism = Mechanism(bodies, joints, gravity=(0, 0, 0), geometries=shapes, pairs=(pair,))
    found = followed(mechanism, np.linspace(0.0, 0.13, 27))
    assert {event.kind for event in found.events} <= {"impact", "lift_off"}
    assert found.events
    spec = mujoco.MjSpec()
    for kind, size in (("BOX", (0.2, 0.15, 0.1)), ("CAPSULE", (0.06, 0.25, 0))):
        body = spec.worldbody.add_body()
        body.add_freejoint()
        body.add_geom(type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind}"), size=size)
    model = spec.compile()
    data, apart = mujoco.MjData(model), []
    for places, attitudes in zip(found.record.p_WB, found.record.q_WB, strict=True):
        data.qpos[:] = np.concatenate([places, attitudes], axis=1).ravel()
        mujoco.mj_forward(model, data)
        apart.append(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))
    assert min(apart) > -1e-9
    momentum = found.record.v_WB[:, 0] + 2.0 * found.record.v_WB[:, 1]
    assert np.abs(momentum - momentum[0]).max() < 1e-12


@pytest.mark.drill
@pytest.mark.parametrize(
    "engine", ["mujoco[formulation=geoms,preset=tuned,dt=2e-4]", "pinocchio[formulation=impulses,dt=2e-4]"]
)
def test_engines_agree_on_a_rod_over_a_rim(engine: str) -> None:
    """MuJoCo's own search for contacts, and Pinocchio's impulses at ours, tip the rod as the truth does."""
    scene = Scene("rod", "", (MechanismElement(on_table((-0.02, 0, RADIUS), (SPEED, 0, 0), (1, 0, 0))),))
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.08, every=0.04), scene)
    assert found.agrees, str(found)
