"""A body that rolls or slips inside an upright cylinder, as the ball of the article."""

from __future__ import annotations

import numpy as np

from proofroll.core.element import Element
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.surfaces import Cylinder
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.shapes.walls.of_revolution import Bore

# Angle between directions, and distance of an axis from the world's origin in radii of the wall, that are round-off.
_ROUND_OFF = 1e-12


def ball_of(element: Element) -> RollingBall | None:
    """Ball in a cylinder at rest about a line through the world's origin along gravity; None: it is another element."""
    on_wall = element.on_wall if isinstance(element, MechanismElement) else None
    if on_wall is None or on_wall.flies or on_wall.wall_rate is not None or len(element.bodies) != 1:
        return None
    place, gravity = on_wall.surface, on_wall.gravity
    bore = getattr(getattr(place, "chart", None), "wall", None)
    if not isinstance(bore, Bore) or place.axis[1]:
        return None
    off_axis, leaning = (float(np.linalg.norm(np.cross(vector, place.axis))) for vector in (place.origin, gravity))
    if off_axis > _ROUND_OFF * bore.radius or leaning > _ROUND_OFF * float(np.linalg.norm(gravity)):
        return None
    x, _, z = place.axis.tolist()
    wall = Cylinder(on_wall.contact.surface, radius=bore.radius, tilt=float(np.arctan2(x, z)))
    surface, p0 = wall.offset(on_wall.ball.radius), place.position(on_wall.u0)
    return RollingBall(
        ball=on_wall.ball,
        contact=on_wall.contact,
        surface=surface,
        wall=wall,
        gravity=gravity,
        u0=surface.locate(p0),
        p0=p0,
        v0=on_wall.v0,
        w0=on_wall.w0,
    )
