"""Curved walls that spheres touch, each given by the distance of a place from it, in its own axes."""

from proofroll.elements.mechanism.scene.shapes.walls.curved import CurvedWall
from proofroll.elements.mechanism.scene.shapes.walls.declared import Declared, DeclaredWall
from proofroll.elements.mechanism.scene.shapes.walls.of_revolution import (
    Bore,
    BowlWall,
    ConeWall,
    EdgeLine,
    Shaft,
    TorusWall,
)

__all__ = ["Bore", "BowlWall", "ConeWall", "CurvedWall", "Declared", "DeclaredWall", "EdgeLine", "Shaft", "TorusWall"]
