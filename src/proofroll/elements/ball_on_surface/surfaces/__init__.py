"""Surfaces on which the centre of a ball moves, a file each, and their common protocol."""

from dataclasses import is_dataclass
from functools import cache
from typing import Any

from proofroll.core.entry_points import leave_out, loaded
from proofroll.elements.ball_on_surface.surfaces.bowl import Bowl
from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder
from proofroll.elements.ball_on_surface.surfaces.declared import Declared
from proofroll.elements.ball_on_surface.surfaces.plane import Plane
from proofroll.elements.ball_on_surface.surfaces.revolved import Cone, Revolved, Torus
from proofroll.elements.ball_on_surface.surfaces.surface import Generator, Surface

__all__ = ["Bowl", "Cone", "Cylinder", "Declared", "Generator", "Plane", "Revolved", "Surface", "Torus"]


@cache
def surface_kinds() -> tuple[type[Any], ...]:
    """Kinds of surfaces that a scene can name, of other packages too: dataclasses that follow :class:`Surface`."""
    others = list[Any]()
    for point, kind in loaded("proofroll.surfaces"):
        if is_dataclass(kind):
            others.append(kind)
        else:
            leave_out(point, "is no dataclass")
    return (Cylinder, Plane, Bowl, Cone, Torus, *others)
