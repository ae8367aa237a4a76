"""All kinds of surfaces that a scene can name: those here, and those that other packages announce."""

from __future__ import annotations

from functools import cache
from typing import Any

from proofroll.core.announced import announced
from proofroll.elements.ball_on_surface.surfaces.bowl import Bowl
from proofroll.elements.ball_on_surface.surfaces.cylinder import Cylinder
from proofroll.elements.ball_on_surface.surfaces.plane import Plane
from proofroll.elements.ball_on_surface.surfaces.revolved import Cone, Torus

GROUP = "proofroll.surfaces"


@cache
def surface_kinds() -> tuple[type[Any], ...]:
    """The classes: dataclasses that follow :class:`Surface`, most easily by way of :class:`Declared`."""
    return (Cylinder, Plane, Bowl, Cone, Torus, *(point.load() for point in announced(GROUP)))
