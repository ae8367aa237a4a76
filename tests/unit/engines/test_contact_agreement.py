"""Bodies in contact: engines that have a shape and its law agree with the truth, others say why they do not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from balls_on_walls import WALLS, on_plane, on_wall
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.files.scene_file import load_scene

TURN = Rotation.from_rotvec([0.4, 0.2, -0.9])
SOLE, UP = 0.1, TURN.as_matrix()[:, 2]
AXES = [tuple(axis) for axis in TURN.as_matrix().T.tolist()]
ROD: dict[str, Any] = {"kind": "capsule", "radius": 0.2, "length": 0.6, "axis": AXES[0]}
# Solids whose face, end or side is at height 0, and what slides on them towards their border at x = 0.3 m.
SOLIDS: dict[str, dict[str, Any]] = {
    "box": {"kind": "box", "size": (0.6, 0.4, 0.4), "orientation": tuple(TURN.as_euler("xyz").tolist())},
    "cylinder": {"kind": "cylinder", "radius": 0.3, "length": 0.4, "axis": AXES[2]},
    "capsule": ROD,
    "two capsules": ROD,
}
MOVERS: dict[str, dict[str, Any]] = {
    "two capsules": {"kind": "capsule", "radius": SOLE, "length": 0.4, "axis": AXES[1]}
}


def over(kind: str) -> Mechanism:
    """A body that slides and spins over the border of a fixed solid, its centre of mass aside, in turned axes."""
    place, v = TURN.apply([[0.26, 0.02, SOLE], [0.8, 0.1, 0.0]]).tolist()
    shapes = (
        Geometry("mover", "mover", **({"kind": "sphere", "radius": SOLE} | MOVERS.get(kind, {}))),
        Geometry("solid", "world", position=tuple((-0.2 * UP).tolist()), **SOLIDS[kind]),
    )
    body = Body("mover", 0.5, com=(0.002, 0.0, 0.001), inertia=(0.002, 0.003, 0.0024))
    joint = Joint("j", "free", "world", "mover", q0=(*place, 1, 0, 0, 0), v0=(*v, *(2.0 * UP).tolist()))
    pairs = (Pair("touch", ("mover", "solid"), 0.3),)
    return Mechanism((body,), (joint,), gravity=tuple((-9.81 * UP).tolist()), geometries=shapes, pairs=pairs)


def over_a_rim(shape: Geometry) -> Mechanism:
    """A body that slides without friction over the edge of a box, its middle 2 cm before it."""
    table = Geometry("table", "world", "box", (-0.5, 0, -0.1), size=(1.0, 0.6, 0.2))
    joint = Joint("j", "free", "world", "body", q0=(-0.02, 0, 0.05, 1, 0, 0, 0), v0=(0.9, 0, 0, 0, 0, 0))
    body = Body("body", 2.0, inertia=(0.012, 0.012, 0.012))
    return Mechanism((body,), (joint,), geometries=(shape, table), pairs=(Pair("touch", (shape.name, "table"), 0.0),))


def standing_cylinder(gap: float = 0.0) -> Mechanism:
    """A cylinder that stands on a plane, or above it."""
    shapes = Geometry("can", "can", "cylinder", radius=0.1, length=0.2), Geometry("floor", "world", "plane")
    joint = Joint("j", "free", "world", "can", q0=(0, 0, 0.1 + gap, 1, 0, 0, 0))
    body, pair = Body("can", 1.0, inertia=(0.006, 0.006, 0.005)), Pair("touch", ("can", "floor"), 0.5)
    return Mechanism((body,), (joint,), geometries=shapes, pairs=(pair,))


def falling(**law: float) -> Mechanism:
    """A ball that falls on a plane with spin and speed and hits at 0.0452 s."""
    inertia = 0.4 * 0.5 * 0.1**2
    shapes = (Geometry("s", "ball", "sphere", radius=0.1), Geometry("floor", "world", "plane"))
    joint = Joint("j", "free", "world", "ball", q0=(0, 0, 0.11, 1, 0, 0, 0), v0=(0.3, 0.1, 0, 1.0, 5.0, -8.0))
    body = Body("ball", 0.5, com=(0.01, 0.0, 0.02), inertia=(inertia, inertia, 1.3 * inertia))
    return Mechanism(
        (body,), (joint,), geometries=shapes, pairs=(replace(Pair("contact", ("s", "floor"), 0.8), **law),)
    )


RIMS = {
    "rod": Geometry("rod", "body", "capsule", radius=0.05, length=0.3, axis=(1, 0, 0)),
    "block": Geometry("block", "body", "box", size=(0.2, 0.1, 0.1)),
}
MECHANISMS: dict[str, Mechanism] = {
    **{kind: on_wall(kind) for kind in WALLS if kind != "bore"},
    "bore": on_wall("bore", friction=0.35, aside=False),
    **{kind: over(kind) for kind in SOLIDS},
    **{name: over_a_rim(shape) for name, shape in RIMS.items()},
    "slope": on_plane(),
    "rebound": falling(restitution=0.6, tangential_restitution=0.5),
}
PROJECTION, IMPULSES = "projection[formulation=dependent]", "pinocchio[formulation=impulses,dt=1e-4]"
TUNED, SPHERES = "mujoco[formulation=geoms,preset=tuned,dt=1e-4]", "exudyn[formulation=spheres,dt=1e-4]"
SLOPE = {
    PROJECTION: 1e-10,
    IMPULSES: 1e-3,
    "mujoco[formulation=geoms,cone=elliptic,dt=1e-4,time_constant=2]": 1e-3,
    "exudyn[formulation=spheres]": 1e-5,
}
# Scene, engine, end [s], and the largest error of its path [m].
AGREE = [
    *(("bore", engine, 0.03, error) for engine, error in
      {PROJECTION: 1e-10, IMPULSES: 1e-4, TUNED: 1e-6, SPHERES: 1e-6}.items()),
    *((kind, engine, 0.02, 1e-3) for kind in WALLS if kind != "bore"
      for engine in (PROJECTION, IMPULSES, TUNED, SPHERES)),
    *(("slope", engine, 0.1, error) for engine, error in SLOPE.items()),
    *(("rebound", engine, 0.06, 1e-3) for engine in (PROJECTION, IMPULSES)),
    *((kind, (IMPULSES, TUNED)[place % 2], 0.09, 2e-4) for place, kind in enumerate(SOLIDS)),
]  # fmt: skip
DRILLS = [
    *((kind, PROJECTION, 0.09, 1e-9) for kind in SOLIDS),
    *((kind, (TUNED, IMPULSES)[place % 2], 0.09, 2e-4) for place, kind in enumerate(SOLIDS)),
    *((name, engine.replace("1e-4", "2e-4"), 0.08, 1e-3) for name in RIMS for engine in (IMPULSES, TUNED)),
]
# A quarter of a minute each; these solids are held by the other engine here, and impulses by the rows above.
SLOW, LONG = {IMPULSES.replace("1e-4", "2e-4")}, pytest.mark.nightly


def scene_of(name: str, mechanism: Mechanism) -> Scene:
    """A scene of one mechanism."""
    return Scene(name, "", (MechanismElement(mechanism),))


@pytest.mark.drill
@pytest.mark.one_in(4)
@pytest.mark.nightly_of(
    "rod-mujoco[formulation=geoms,preset=tuned,dt=2e-4]-0.08-0.001",
    "block-mujoco[formulation=geoms,preset=tuned,dt=2e-4]-0.08-0.001",
    "capsule-projection[formulation=dependent]-0.09-1e-09",
    "two capsules-projection[formulation=dependent]-0.09-1e-09",
    "cylinder-pinocchio[formulation=impulses,dt=1e-4]-0.09-0.0002",
    "two capsules-pinocchio[formulation=impulses,dt=1e-4]-0.09-0.0002",
)
@pytest.mark.drill_of(
    "box-pinocchio[formulation=impulses,dt=1e-4]-0.09-0.0002",
    "cylinder-mujoco[formulation=geoms,preset=tuned,dt=1e-4]-0.09-0.0002",
    "capsule-pinocchio[formulation=impulses,dt=1e-4]-0.09-0.0002",
    "two capsules-mujoco[formulation=geoms,preset=tuned,dt=1e-4]-0.09-0.0002",
)
@pytest.mark.parametrize(
    ("name", "engine", "until", "largest"),
    [*AGREE, *(pytest.param(*drill, marks=LONG if drill[1] in SLOW else pytest.mark.drill) for drill in DRILLS)],
)
def test_what_touches_agrees(name: str, engine: str, until: float, largest: float) -> None:
    """Path, speeds and forces are the truth's where a body slides, rolls, rebounds or passes a border."""
    scene = scene_of(name, MECHANISMS[name])
    verdict = proofroll.judge(proofroll.simulate(scene, engine, until=until, every=until / 2), scene)
    assert verdict.agrees, str(verdict)
    (place,) = [item.judgement for item in verdict.compared if item.judgement.observable == "positions"]
    assert place.error < largest


ONE_COEFFICIENT = "this formulation gives a contact one coefficient"


@pytest.mark.parametrize(
    ("mechanism", "engine", "why"),
    [
        (on_wall("bore"), "mujoco[formulation=geoms,integrator=RK4]", "posed once a step, and RK4 needs it"),
        (on_plane(), "exudyn[formulation=discs]", "contact of spheres, and Exudyn's joint rolls discs on planes"),
        (on_plane(), "mujoco[formulation=geoms,cone=pyramidal]", "friction above 1 makes a contact soft"),
        (over("box"), "exudyn[formulation=spheres]", "contact of boxes, and Exudyn's contacts are of spheres"),
        (over_a_rim(RIMS["block"]), PROJECTION, "begin and end at borders of faces"),
        (standing_cylinder(), "pinocchio[formulation=impulses]", "of which this formulation has one point"),
        (falling(static_friction=0.9), "mujoco[formulation=geoms]", ONE_COEFFICIENT),
        (falling(static_friction=0.9), "pinocchio[formulation=impulses]", ONE_COEFFICIENT),
        (falling(static_friction=0.9), "exudyn[formulation=spheres]", ONE_COEFFICIENT),
        (falling(tangential_restitution=0.5), "mujoco[formulation=geoms]", "sets restitution along the normal alone"),
        (falling(tangential_restitution=0.5), "exudyn[formulation=spheres]", "this formulation has no rebounds"),
        (falling(spinning_friction=1e-3), "mujoco[formulation=geoms]", "give cone = .shared., or friction = inf"),
    ],
)
def test_who_lacks_a_shape_or_a_law_says_so(mechanism: Mechanism, engine: str, why: str) -> None:
    """Refused, with the reason."""
    with pytest.raises(Refused, match=why):
        proofroll.simulate(scene_of("refused", mechanism), engine, until=0.01)


def test_a_cylinder_that_lands_on_its_end_ends_a_run_with_one_point() -> None:
    """Impulses have one point of the edge on which it stands, and say so where it lands."""
    falling_can = scene_of("landing", standing_cylinder(0.01))
    run = proofroll.simulate(falling_can, "pinocchio[formulation=impulses]", until=0.2, every=0.02)
    assert (run.attrs["status"], float(run["time"][-1])) == ("diverged", 0.04)
    assert "has one point" in run.attrs["message"]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("e", [0.0, 1.0])
def test_dead_and_perfect_impacts(e: float) -> None:
    """With e = 0 the ball stays where it lands, with 1 it comes back to its height, in impulses as in truth."""
    scene = load_scene("bouncing_ball", restitution=e, height=0.3)
    true, found = (
        proofroll.simulate(scene, name, until=0.6, every=0.02) for name in ("truth", "pinocchio[formulation=impulses]")
    )
    assert float(abs(found["gap"] - true["gap"]).max()) < 5e-3
