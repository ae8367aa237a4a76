"""A ball in a tilted bore: engines that follow its contact agree, the others say why they do not."""

from __future__ import annotations

import pytest

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.contacts.geometry import Geometry, Pair
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Body


@pytest.fixture(scope="module")
def bored() -> Scene:
    """A sphere that slides and spins at the highest place across a bore tilted by 37 degrees."""
    inertia = 0.4 * 0.5 * 0.025**2
    shapes = (
        Geometry("sphere", "ball", "sphere", radius=0.025),
        Geometry("wall", "world", "bore", radius=0.225, axis=(0.6, 0.0, 0.8)),
    )
    joint = Joint("j", "free", "world", "ball", q0=(0, 0.2, 0, 1, 0, 0, 0), v0=(1.6, 0.0, -1.2, 0.0, 0.0, -80.0))
    body = Body("ball", 0.5, inertia=(inertia, inertia, inertia))
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(Pair("contact", ("sphere", "wall"), 0.35),))
    return Scene("bored", "", (MechanismElement(mechanism),))


@pytest.mark.parametrize(
    ("engine", "largest"),
    [("projection[formulation=dependent]", 1e-10), ("pinocchio[formulation=impulses,dt=1e-4]", 1e-4)],
)
def test_a_ball_in_a_bore_agrees(engine: str, largest: float, bored: Scene) -> None:
    """Its path is the truth's within the engine's own errors, and so are speeds and forces within one per cent."""
    run = proofroll.simulate(bored, engine, until=0.03, every=0.01)
    found = proofroll.judge(run, bored)
    assert found.agrees, str(found)
    (place,) = [item.judgement for item in found.compared if item.judgement.observable == "positions"]
    assert place.error < largest


@pytest.mark.parametrize(
    ("engine", "why"),
    [
        (
            "mujoco[formulation=geoms]",
            "contact is in a bore; MuJoCo's shapes are convex, and facets are another surface",
        ),
        ("exudyn[formulation=spheres]", "contact has a shape that is no sphere and no plane"),
    ],
)
def test_who_has_no_bore_says_so(engine: str, why: str, bored: Scene) -> None:
    """Refused, with the reason."""
    with pytest.raises(Refused, match=why):
        proofroll.simulate(bored, engine, until=0.01)
