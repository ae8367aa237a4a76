"""Mechanisms of one free ball on a plane or a curved wall."""

from __future__ import annotations

import math

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair

RADIUS, MASS, SHARE = 0.025, 0.5, 0.4  # m, kg, J / (m a²)
MOMENT = SHARE * MASS * RADIUS**2
VELOCITY = dict.fromkeys(("shaft", "bowl", "cone", "torus"), (0.0, 0.3, 0.0, 5.0, 0.0, 3.0))
VELOCITY["bore"] = (1.6, 0.0, -1.2, 0.0, 0.0, -80.0)
WALLS = {
    "bore": (Geometry("wall", "world", "bore", radius=0.225, axis=(0.6, 0.0, 0.8)), (0.0, 0.2, 0.0)),
    "shaft": (Geometry("wall", "world", "shaft", radius=0.2, axis=(1.0, 0.0, 0.0)), (0.0, 0.0, 0.225)),
    "bowl": (Geometry("wall", "world", "bowl", (0.0, 0.0, 0.1), radius=0.225), (0.12, 0.0, -0.06)),
    "cone": (Geometry("wall", "world", "cone", (0.0, 0.0, -0.05), slope=0.6435011087932844), (0.04, 0.0, 0.01125)),
    "torus": (Geometry("wall", "world", "torus", radius=0.05, ring_radius=0.2), (0.2, 0.0, 0.075)),
}


def on_wall(kind: str, *, friction: float = 0.3, swapped: bool = False, aside: bool = True) -> Mechanism:
    """A sphere that slides and spins on a wall; ``aside``: of a body whose centre of mass is."""
    wall, place = WALLS[kind]
    joint = Joint("free", "free", "world", "ball", q0=(*place, 1, 0, 0, 0), v0=VELOCITY[kind])
    shapes = (Geometry("sphere", "ball", "sphere", radius=RADIUS), wall)
    names = ("wall", "sphere") if swapped else ("sphere", "wall")
    body = Body("ball", MASS, inertia=(MOMENT, MOMENT, MOMENT))
    if aside:
        body = Body("ball", MASS, com=(0.002, 0.0, 0.001), inertia=(MOMENT, MOMENT, 1.2 * MOMENT))
    return Mechanism((body,), (joint,), geometries=shapes, pairs=(Pair("contact", names, friction),))


def on_plane(
    *, speed: float = 0.2, slip: float = 0.0, com: float = 0.0, gap: float = 0.0, restitution: float = 0.0
) -> Mechanism:
    """A sphere on a sloping plane without bound on its friction, rolling across it but for a slip [m/s]."""
    inertia = 0.4 * 0.5 * 0.1**2
    shapes = (
        Geometry("s", "ball", "sphere", radius=0.1),
        Geometry("floor", "world", "plane", normal=(0.28, 0.0, 0.96)),
    )
    at = [0.28 * (0.1 + gap), 0.0, 0.96 * (0.1 + gap)]
    joint = Joint(
        "j", "free", "world", "ball", q0=(*at, 1, 0, 0, 0), v0=(0, speed + slip, 0, -9.6 * speed, 0, 2.8 * speed)
    )
    body = Body("ball", 0.5, com=(com, 0.0, 0.0), inertia=(inertia, inertia, inertia))
    pairs = (Pair("contact", ("s", "floor"), math.inf, restitution),)
    return Mechanism((body,), (joint,), geometries=shapes, pairs=pairs)
