"""Surfaces on which the centre of a ball moves: a file for each, and what they have in common."""

from proofroll.elements.ball_on_surface.surfaces.bowl import Bowl
from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder
from proofroll.elements.ball_on_surface.surfaces.declared import Declared
from proofroll.elements.ball_on_surface.surfaces.plane import Plane
from proofroll.elements.ball_on_surface.surfaces.revolved import Cone, Revolved, Torus
from proofroll.elements.ball_on_surface.surfaces.surface import Generator, Surface

__all__ = ["Bowl", "Cone", "Cylinder", "Declared", "Generator", "Plane", "Revolved", "Surface", "Torus"]
