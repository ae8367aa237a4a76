"""Tables of surfaces that a ball touches, and the planes and cylinders that its own mechanics knows."""

from dataclasses import is_dataclass
from functools import cache
from typing import Any

from proofroll.core.entry_points import leave_out, loaded
from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder
from proofroll.elements.ball_on_surface.surfaces.of_revolution import Bowl, Cone, Torus
from proofroll.elements.ball_on_surface.surfaces.plane import Plane
from proofroll.elements.ball_on_surface.surfaces.surface import Generator, Surface
from proofroll.elements.mechanism.scene.shapes.walls.declared import Declared
from proofroll.elements.mechanism.scene.shapes.walls.revolved import Revolved

__all__ = ["Bowl", "Cone", "Cylinder", "Declared", "Generator", "Plane", "Revolved", "Surface", "Torus"]


@cache
def surface_kinds() -> tuple[type[Any], ...]:
    """Tables of surfaces that a scene can name; those of other packages are dataclasses on :class:`Declared`."""
    others = list[Any]()
    for point, kind in loaded("proofroll.surfaces"):
        if is_dataclass(kind):
            others.append(kind)
        else:
            leave_out(point, "is no dataclass")
    return (Cylinder, Plane, Bowl, Cone, Torus, *others)
