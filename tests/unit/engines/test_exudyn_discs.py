"""Exudyn's formulation ``discs``: circles that never slip on planes, by its joint for rolling discs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

pytest.importorskip("exudyn")

DISCS = "exudyn[formulation=discs]"
RADIUS, LEAN, SLOPE = 0.1, 0.3, 0.2
UP = (math.sin(SLOPE), 0.0, math.cos(SLOPE))


def rolling(*, order: tuple[str, str] = ("rim", "floor"), gap: float = 0.0, friction: float = math.inf) -> Scene:
    """A leaning disc, heavier on one side, that rolls on a slope, its axis along x of its body."""
    lean = np.array([[math.cos(LEAN), 0, math.sin(LEAN)], [0, 1, 0], [-math.sin(LEAN), 0, math.cos(LEAN)]])
    across = np.array(UP) - lean[:, 0] * (lean[:, 0] @ UP)
    arm = RADIUS * across / np.linalg.norm(across)
    w = np.array([-6.0, 0.5, 1.0])
    joint = Joint(
        "flight",
        "free",
        "world",
        "disc",
        q0=(*(arm + gap * np.array(UP)), math.cos(LEAN / 2), 0, math.sin(LEAN / 2), 0),
        v0=(*(lean.T @ np.cross(lean @ w, arm)), *w),
    )
    shapes = (
        Geometry("rim", "disc", "circle", radius=RADIUS, normal=(1.0, 0.0, 0.0)),
        Geometry("floor", "world", "plane", normal=UP),
    )
    body = Body("disc", 0.5, com=(0.0, 0.01, 0.02), inertia=(2.5e-3, 1.3e-3, 1.2e-3))
    mechanism = Mechanism((body,), (joint,), geometries=shapes, pairs=(Pair("edge", order, friction),))
    return Scene("slope", "", (MechanismElement(mechanism),))


@pytest.mark.drill
def test_a_heavy_sided_disc_rolls_with_its_forces() -> None:
    """Path and force on the edge are the truth's; the force is that on the first geometry, whichever it is."""
    true = proofroll.simulate(rolling(), "truth", until=0.1, every=0.02)
    for order, sign in ((("rim", "floor"), 1.0), (("floor", "rim"), -1.0)):
        run = proofroll.simulate(rolling(order=order), DISCS, until=0.1, every=0.02)
        assert np.abs(run["p_WB"] - true["p_WB"]).max() < 1e-5
        for name in ("force.edge.x", "force.edge.y", "force.edge.z"):
            assert np.abs(sign * run[name] - true[name]).max() < 2e-4


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"friction": 0.5}, "needs friction of contacts between bodies, and its joint never slips"),
        ({"friction": 0.0}, "edge has no friction, and its joint never slips"),
        ({"gap": 0.01}, r"edge starts 0\.01 m above its plane"),
    ],
)
def test_what_does_not_roll_from_the_start_is_refused(changes: dict[str, Any], why: str) -> None:
    """A number of friction and a gap are refused, each with its reason."""
    with pytest.raises(Refused, match=why):
        proofroll.simulate(rolling(**changes), DISCS, until=0.01)
