"""Solids that meet: engines that follow their nearest features agree with the truth, the others say why they do not."""

from __future__ import annotations

from typing import Any

import pytest
from scipy.spatial.transform import Rotation

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

TURN = Rotation.from_rotvec([0.4, 0.2, -0.9])
RADIUS, UP = 0.1, TURN.as_matrix()[:, 2]
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
    "two capsules": {"kind": "capsule", "radius": RADIUS, "length": 0.4, "axis": AXES[1]}
}
ENGINES = {
    "projection[formulation=dependent]": 1e-9,
    "pinocchio[formulation=impulses,dt=1e-4]": 2e-4,
    "mujoco[formulation=geoms,preset=tuned,dt=1e-4]": 2e-4,
}


def over(kind: str) -> Scene:
    """A body that slides and spins over the border of a fixed solid, its centre of mass aside, in turned axes."""
    place, v = TURN.apply([[0.26, 0.02, RADIUS], [0.8, 0.1, 0.0]]).tolist()
    shapes = (
        Geometry("mover", "mover", **({"kind": "sphere", "radius": RADIUS} | MOVERS.get(kind, {}))),
        Geometry("solid", "world", position=tuple((-0.2 * UP).tolist()), **SOLIDS[kind]),
    )
    body = Body("mover", 0.5, com=(0.002, 0.0, 0.001), inertia=(0.002, 0.003, 0.0024))
    joint = Joint("j", "free", "world", "mover", q0=(*place, 1, 0, 0, 0), v0=(*v, *(2.0 * UP).tolist()))
    pairs = (Pair("touch", ("mover", "solid"), 0.3),)
    mechanism = Mechanism((body,), (joint,), gravity=tuple((-9.81 * UP).tolist()), geometries=shapes, pairs=pairs)
    return Scene(kind, "", (MechanismElement(mechanism),))


# Each solid in one engine in every run, Pinocchio and MuJoCo in turns.
QUICK = [f"{kind} {list(ENGINES)[1 + place % 2]}" for place, kind in enumerate(SOLIDS)]


@pytest.mark.parametrize(
    ("kind", "engine"),
    [
        pytest.param(kind, engine, marks=[] if f"{kind} {engine}" in QUICK else pytest.mark.drill)
        for kind in SOLIDS
        for engine in ENGINES
    ],
)
def test_what_slides_over_a_border_agrees(kind: str, engine: str) -> None:
    """Path, speeds and forces are the truth's while the nearest features change, which makes the forces jump."""
    scene = over(kind)
    found = proofroll.judge(proofroll.simulate(scene, engine, until=0.09, every=0.03), scene)
    assert found.agrees, str(found)
    (place,) = [item.judgement for item in found.compared if item.judgement.observable == "positions"]
    assert place.error < ENGINES[engine]


def test_who_has_spheres_and_planes_alone_says_so() -> None:
    """Refused, with the reason."""
    with pytest.raises(Refused, match="touch has a shape that is neither sphere nor wall"):
        proofroll.simulate(over("box"), "exudyn[formulation=spheres]", until=0.01)
