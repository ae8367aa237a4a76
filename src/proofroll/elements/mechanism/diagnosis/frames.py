"""Frames and points in which the motion of bodies and the forces on them may be given by mistake."""

from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.dynamics.placed import Placed

BODY, SURFACE = "body axes", "the surface's axes e1, e2, e3"


def surface_axes(element: Any, placed: Placed) -> FloatArray | None:
    """Axes of the wall where its ball is, as columns, (time, 3, 3); None: the element is no ball on a wall."""
    if element.on_wall is None:
        return None
    surface = element.on_wall.surface
    return np.asarray(surface.frame(surface.locate(placed.p_WB[:, element.on_wall.index])))


def frames_of(element: Any, placed: Placed) -> dict[str, FloatArray]:
    """Frames of all bodies by name, (time, bodies, 3, 3); of a body without axes of its wall those of the world."""
    frames, axes = {BODY: placed.R_WB[:, :-1]}, surface_axes(element, placed)
    if axes is not None:
        of_bodies = np.tile(np.eye(3), (*placed.p_WB.shape[:2], 1, 1))
        of_bodies[:, element.on_wall.index] = axes
        frames[SURFACE] = of_bodies
    return frames
