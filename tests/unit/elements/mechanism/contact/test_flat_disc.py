"""Certificate of a disc parallel to its plane."""

from __future__ import annotations

import pytest

from proofroll.core.scene import Scene
from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.running.simulation import simulate


@pytest.mark.parametrize("engine", ["mujoco", "projection"])
def test_any_point_of_the_edge_is_the_nearest_of_a_parallel_disc(engine: str) -> None:
    """An engine that names one of them holds the scene's model, and is not refused."""
    free = Joint("free", "free", "world", "disc", q0=(0, 0, 0.05, 1, 0, 0, 0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("rim", "disc", "circle", radius=0.25))
    pairs = (Pair("touch", ("rim", "floor"), friction=0.3),)
    bodies = (Body("disc", 1.0, inertia=(0.015625, 0.015625, 0.03125)),)
    scene = Scene("disc", "", (MechanismElement(Mechanism(bodies, (free,), geometries=shapes, pairs=pairs)),))
    assert simulate(scene, engine, until=0.02).attrs["status"] == "done"


@pytest.mark.parametrize("engine", ["mujoco", "projection"])
def test_a_cylinder_may_start_on_its_end(engine: str) -> None:
    """What an engine computes of one place of the edge is not held against a model that has no such place."""
    free = Joint("free", "free", "world", "can", q0=(0, 0, 0.06, 1, 0, 0, 0))
    shapes = (Geometry("floor", "world", "plane"), Geometry("wall", "can", "cylinder", radius=0.06, length=0.12))
    pairs = (Pair("touch", ("wall", "floor"), friction=1.0),)
    bodies = (Body("can", 1.0, inertia=(0.003, 0.003, 0.002)),)
    scene = Scene("can", "", (MechanismElement(Mechanism(bodies, (free,), geometries=shapes, pairs=pairs)),))
    assert simulate(scene, engine, until=0.02).attrs["status"] == "done"
