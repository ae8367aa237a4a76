"""Two boxes: stacks at rest, a slide over a rim, edges that cross, and what is not followed."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.rotations import to_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.switched_truth import truth_of

MASS, GRAVITY, SPEED, HALF = 2.0, 9.81, 0.9, 0.05
TURN = Rotation.from_rotvec([0.3, -0.7, 0.5])
AXES = TURN.as_matrix()
BARS = 1e-11  # 3e-13 is seen
SMALL, LARGE = (0.2, 0.1, 2 * HALF), (1.0, 0.3, 0.2)


def turned(vector: Any) -> tuple[float, float, float]:
    """A vector given in turned axes, in the world's."""
    x, y, z = (AXES @ np.asarray(vector, dtype=float)).tolist()
    return x, y, z


def inertia(size: Any) -> Any:
    """Principal moments of a solid box."""
    a, b, c = size
    return tuple(MASS * (p**2 + q**2) / 12 for p, q in ((b, c), (a, c), (a, b)))


def on_box(
    place: Any, v: Any = (0, 0, 0), size: Any = SMALL, base: Any = LARGE, turn: Any = (0, 0, 0), **law: float
) -> Mechanism:
    """A free box above a fixed one whose upper face ends at x = 0, in turned axes; ``turn``: of the free one."""
    attitude = TURN * Rotation.from_rotvec(turn)
    q = attitude.as_quat(scalar_first=True).tolist()
    velocity = attitude.inv().apply(turned(v)).tolist()
    shapes = (
        Geometry("upper", "box", "box", size=size),
        Geometry("lower", "world", "box", turned((-base[0] / 2, 0, -base[2] / 2)), to_rpy(AXES), size=base),
    )
    return Mechanism(
        (Body("box", MASS, inertia=inertia(size)),),
        (Joint("j", "free", "world", "box", q0=(*turned(place), *q), v0=(*velocity, 0, 0, 0)),),
        gravity=turned((0, 0, -GRAVITY)),
        geometries=shapes,
        pairs=(Pair("touch", ("upper", "lower"), **({"friction": 0.0} | law)),),
    )


def followed(mechanism: Mechanism, times: Any) -> TwoRouteMotion:
    """Truth to the last time, whose bars are narrow."""
    found = truth_of(mechanism, np.array(times))
    assert np.isinf(found.horizon), found.reason
    assert max(float(np.nanmax(found.bars[name])) for name in ("p_WB", "v_WB", "w_WB")) < BARS
    return found


@pytest.mark.parametrize(
    ("size", "base", "closed"),
    [
        (SMALL, LARGE, (0, 1, 2, 3)),  # corners of the upper one
        (LARGE, SMALL, (4, 5, 6, 7)),  # of the lower one
        ((0.8, 0.1, 0.1), (0.2, 0.6, 0.2), (10, 11, 14, 15)),  # a plank across a beam: edges that cross
    ],
)
def test_a_box_on_a_box_rests(size: Any, base: Any, closed: tuple[int, ...]) -> None:
    """The sum of the forces is its weight, and what presses are the corners of where both faces overlap."""
    mechanism = on_box((-base[0] / 2, 0, size[2] / 2), size=size, base=base, friction=0.4)
    found = followed(mechanism, [0.0, 0.5])
    assert found.events == ()
    assert found.sums is not None
    np.testing.assert_allclose(found.sums[-1, 0] @ AXES, [0, 0, MASS * GRAVITY], rtol=0, atol=1e-11)
    np.testing.assert_allclose(found.record.p_WB[1], found.record.p_WB[0], rtol=0, atol=1e-14)
    assert found.pressed is not None
    loose = np.isnan(found.pressed[-1]).any(axis=1)  # of a load that corners share none is determinate
    assert set(np.flatnonzero(loose)) <= set(closed)


def over_the_rim(times: Any) -> Any:
    """Place, in the plane of motion, and turn of a box whose centre passes a rim without friction at time 0.

    Coordinates are its turn, and the place of its centre along its lower face from the rim; (times, 3).
    """
    moment = inertia(SMALL)[1]

    def rates(_: float, y: Any) -> list[float]:
        turn, along, w, u = y
        matrix = [[1, HALF, 0], [0, -along, -1 / MASS], [0, moment, -along]]
        right = [along * w**2 + GRAVITY * np.sin(turn), (u + HALF * w) * w + u * w - GRAVITY * np.cos(turn), 0]
        slide, turning, _force = np.linalg.solve(matrix, right)
        return [w, u, turning, slide]

    solved = solve_ivp(rates, (0, times[-1]), [0, 0, 0, SPEED], "DOP853", times, rtol=1e-13, atol=1e-15)
    turn, along = solved.y[:2]
    x, z = along * np.cos(turn) + HALF * np.sin(turn), HALF * np.cos(turn) - along * np.sin(turn)
    return np.array([x, z, turn]).T


@pytest.mark.drill
def test_a_box_that_slides_over_a_rim_tips_when_its_centre_passes_it() -> None:
    """Its leading corners end at the rim, where edges cross; it tips about these as an independent solver says."""
    start, since = -0.12, np.array([0.0, 0.03, 0.06, 0.09])
    passes = -start / SPEED
    found = followed(on_box((start, 0, HALF), (SPEED, 0, 0)), [0.0, *(passes + since)])
    events = [(event.kind, event.name, event.time) for event in found.events]
    assert [event[:2] for event in events] == [("lift_off", f"touch.{k}") for k in (3, 4, 1, 2)]
    assert [event[2] for event in events] == pytest.approx([0.02 / SPEED] * 2 + [passes] * 2, abs=1e-12)
    expected = over_the_rim(since)
    place = found.record.p_WB[1:, 0] @ AXES
    np.testing.assert_allclose(place[:, [0, 2]], expected[:, :2], rtol=0, atol=1e-11)
    attitude = TURN * Rotation.from_rotvec(np.outer(expected[:, 2], [0, 1, 0]))
    measured = Rotation.from_quat(found.record.q_WB[1:, 0], scalar_first=True)
    assert (attitude.inv() * measured).magnitude().max() < 1e-11


def test_edges_that_cross_rebound_from_each_other() -> None:
    """An edge below that falls across an edge above rebounds by its restitution, v' = -e v, without turning."""
    across = Rotation.from_rotvec([np.pi / 4, 0, 0])
    size, side = (0.5, 0.1, 0.1), 0.1 / np.sqrt(2)
    roof = TURN * Rotation.from_rotvec([0, np.pi / 4, 0])
    falling = on_box((0, 0, 2 * side + 0.005), size=size, turn=across.as_rotvec(), restitution=0.5, friction=0.2)
    lower = Geometry("lower", "world", "box", orientation=to_rpy(roof.as_matrix()), size=(0.1, 0.5, 0.1))
    mechanism = Mechanism(
        falling.bodies, falling.joints, gravity=falling.gravity, geometries=(falling.geometries[0], lower),
        pairs=falling.pairs,
    )  # fmt: skip
    hits = np.sqrt(2 * 0.005 / GRAVITY)
    found = followed(mechanism, [0.0, hits + 0.01])
    assert [event.kind for event in found.events] == ["impact"]
    assert found.events[0].time == pytest.approx(hits, abs=1e-12)
    speed = 0.5 * GRAVITY * hits - GRAVITY * 0.01
    np.testing.assert_allclose(found.record.v_WB[-1, 0] @ AXES, [0, 0, speed], rtol=0, atol=1e-12)
    assert np.abs(found.record.w_WB[-1]).max() < 1e-11


def test_a_box_that_meets_a_side_rebounds_from_it() -> None:
    """Faces that come to meet are those of the sides: a box that flies at the side of another one comes back."""
    found = followed(on_box((0.15, 0, -0.1), (-1.0, 0, 0.3), restitution=0.6), [0.0, 0.06])
    assert {event.kind for event in found.events} == {"impact"}
    assert [event.time for event in found.events] == pytest.approx([0.05] * len(found.events), abs=1e-13)
    v = found.record.v_WB[-1, 0] @ AXES
    np.testing.assert_allclose(v, [0.6, 0, 0.3 - GRAVITY * 0.06], rtol=0, atol=1e-12)
    assert np.abs(found.record.w_WB[-1]).max() < 1e-12


@pytest.mark.drill
def test_a_box_that_tips_by_more_than_half_a_right_angle_ends_the_truth_with_the_reason() -> None:
    """A box that does not slip on the rim turns on until other faces meet, and the line says so."""
    found = truth_of(on_box((0.02, 0, HALF), friction=np.inf), np.array([0.0, 0.5]))
    assert [event.kind for event in found.events] == []
    assert "have turned so far at t = 0." in found.ended


@pytest.mark.drill
@pytest.mark.parametrize("seed", [1, 4, 8])
@pytest.mark.parametrize("swapped", [False, True])
def test_boxes_that_tumble_collide_without_overlap(seed: int, swapped: bool) -> None:
    """Boxes that meet anywhere, corner or edge first, stay apart by MuJoCo's own distance and keep their momentum."""
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
    bodies = (
        Body("a", 1.0, com=(0.01, 0, 0.02), inertia=(0.012, 0.013, 0.011)),
        Body("b", 2.0, inertia=(0.05, 0.03, 0.04)),
    )
    sizes = {"a": (0.4, 0.3, 0.2), "b": (0.3, 0.3, 0.5)}
    shapes = tuple(Geometry(f"hull_{name}", name, "box", size=size) for name, size in sizes.items())
    pair = Pair("touch", ("hull_b", "hull_a") if swapped else ("hull_a", "hull_b"), 0.3, 0.5)
    mechanism = Mechanism(bodies, joints, gravity=(0, 0, 0), geometries=shapes, pairs=(pair,))
    found = followed(mechanism, np.linspace(0.0, 0.13, 27))
    assert {event.kind for event in found.events} == {"impact"}
    spec = mujoco.MjSpec()
    for name, size in sizes.items():
        body = spec.worldbody.add_body(name=name)
        body.add_freejoint()
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=np.array(size) / 2)
    model = spec.compile()
    data, apart = mujoco.MjData(model), []
    for places, attitudes in zip(found.record.p_WB, found.record.q_WB, strict=True):
        data.qpos[:] = np.concatenate([places, attitudes], axis=1).ravel()
        mujoco.mj_forward(model, data)
        apart.append(mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None))
    assert min(apart) > -1e-9
    arm = Rotation.from_quat(found.record.q_WB[:, 0], scalar_first=True).apply(bodies[0].com)
    speeds = found.record.v_WB[:, 0] + np.cross(found.record.w_WB[:, 0], arm)
    momentum = speeds + 2.0 * found.record.v_WB[:, 1]
    assert np.abs(momentum - momentum[0]).max() < 1e-12


@pytest.mark.drill
@pytest.mark.parametrize(
    "engine", ["mujoco[formulation=geoms,preset=tuned,dt=2e-4]", "pinocchio[formulation=impulses,dt=2e-4]"]
)
def test_engines_agree_on_a_slide_over_a_rim(engine: str) -> None:
    """MuJoCo's own search for contacts, and Pinocchio's impulses at ours, tip the box as the truth does."""
    scene = Scene("rim", "", (MechanismElement(on_box((-0.02, 0, HALF), (SPEED, 0, 0))),))
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.08, every=0.04), scene)
    assert found.agrees, str(found)


@pytest.mark.parametrize(
    ("engine", "why"),
    [
        ("projection[formulation=dependent]", "begin and end at borders of faces"),
        ("exudyn[formulation=spheres]", "neither sphere nor wall"),
    ],
)
def test_who_has_no_boxes_says_so(engine: str, why: str) -> None:
    """Refused, with the reason."""
    scene = Scene("rest", "", (MechanismElement(on_box((-0.5, 0, HALF))),))
    with pytest.raises(Refused, match=why):
        proofroll.simulate(scene, engine, until=0.01)
