"""Random balls on every wall: rolling, with resistance, slipping from the start or later, falling and bouncing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.gravity import Gravity
from proofroll.elements.balls.surfaces import Bowl, Cone, Cylinder, Plane, Torus
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion

WALLS = ("plane", "cylinder", "bowl", "cone", "torus")
STYLES = ("rolls", "resisted", "may slip", "starts slipping", "falls")


@dataclass(frozen=True)
class RandomBall:
    """A ball with its wall, the law of their contact, its start, and gravity."""

    ball: Ball
    surface: Any
    contact: Contact
    start: InitialMotion
    gravity: Gravity


def random_ball(seed: int) -> tuple[str, RandomBall]:
    """A wall with a style, and a ball on it, the same for the same number."""
    rng = np.random.default_rng(seed)
    wall, style = WALLS[seed % len(WALLS)], STYLES[seed // len(WALLS) % len(STYLES)]
    radius = float(rng.uniform(0.02, 0.1))
    surface, coordinates, gravity = _wall(rng, wall, radius, moves=style == "rolls" and rng.random() < 0.5)
    mu = float(rng.uniform(0.1, 0.8))
    bounded = {"mu_static": mu, "mu_kinetic": mu * float(rng.choice([1.0, 0.7]))}
    law: dict[str, Any] = {}
    if style == "resisted":
        law = {"rolling_resistance": radius * float(rng.uniform(0.001, 0.02))}
    elif style in {"may slip", "starts slipping"} or (style == "falls" and rng.random() < 0.7):
        law = bounded
    fast = 0.3 if wall == "torus" else 2.0  # on which it would leave the wall at once
    start: dict[str, Any] = {"velocity": tuple(rng.uniform(-fast, fast, 2)), "spin": float(rng.uniform(-10, 10))}
    if style == "starts slipping" or (style == "falls" and law):
        start["tangential_spin"] = tuple(rng.uniform(-20, 20, 2))
    if style == "falls":
        start["gap"] = float(rng.uniform(0.01, 0.1))
        law["restitution"] = float(rng.choice([0.0, rng.uniform(0.2, 0.9)]))
        law["tangential_restitution"] = float(rng.uniform(-0.5, 0.9))
    ball = Ball("ball", radius, float(rng.uniform(0.1, 2)), float(rng.choice([0.4, 2 / 3, rng.uniform(0.1, 0.9)])))
    contact, motion = Contact("ball", "wall", **law), InitialMotion("ball", coordinates, **start)
    return f"{wall} {style}", RandomBall(ball=ball, surface=surface, contact=contact, start=motion, gravity=gravity)


def _wall(rng: Any, kind: str, radius: float, *, moves: bool) -> tuple[Any, tuple[float, float], Gravity]:
    """A wall large enough for a ball of this radius, where on it, and gravity that presses it there."""
    leans = rng.uniform(-0.3, 0.3, 2)
    gravity = Gravity(float(rng.uniform(1, 15)), (float(leans[0]), float(leans[1]), -1.0))
    angle, size = float(rng.uniform(-3, 3)), float(rng.uniform(4, 12)) * radius
    if kind == "plane":
        turning = float(rng.uniform(-5, 5)) if moves else 0.0
        return Plane("wall", float(rng.uniform(-0.6, 0.6)), turning=turning), tuple(rng.uniform(-1, 1, 2)), gravity
    if kind == "cylinder":
        tilt = float(rng.choice([1, -1]) * rng.uniform(0.8, 2.2))
        low = 0.0 if tilt > 0 else np.pi  # towards -e1 tilted: the lower side
        return Cylinder("wall", size, tilt), (float(low + rng.uniform(-0.8, 0.8)), float(rng.uniform(-1, 1))), gravity
    if kind == "bowl":
        return Bowl("wall", size), tuple(rng.uniform(-0.8, 0.8, 2) * size), gravity
    if kind == "cone":
        return Cone("wall", float(rng.uniform(0.3, 1.2))), (angle, float(rng.uniform(6, 15)) * radius), gravity
    return Torus("wall", size + 4 * radius, 2 * radius), (angle, float(rng.uniform(-0.5, 0.5))), gravity
