"""Surfaces on which the centre of a ball moves: a file for each, and what they have in common."""

from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder
from proofroll.elements.ball_on_surface.surfaces.plane import Plane
from proofroll.elements.ball_on_surface.surfaces.surface import Generator, Surface

AnySurface = Cylinder | Plane

__all__ = ["AnySurface", "Cylinder", "Generator", "Plane", "Surface"]
