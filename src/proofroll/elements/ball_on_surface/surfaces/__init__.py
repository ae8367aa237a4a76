"""Tables of surfaces that a ball touches, and the cylinder that its own mechanics knows."""

from dataclasses import is_dataclass
from functools import cache
from typing import Any

from proofroll.core.entry_points import leave_out, loaded
from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder, Generator
from proofroll.elements.ball_on_surface.surfaces.tables import Bowl, Cone, Plane, Torus
from proofroll.elements.mechanism.scene.shapes.walls.declared import Declared
from proofroll.elements.mechanism.scene.shapes.walls.revolved import Revolved

__all__ = ["Bowl", "Cone", "Cylinder", "Declared", "Generator", "Plane", "Revolved", "Torus"]


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
