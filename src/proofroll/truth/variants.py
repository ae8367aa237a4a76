"""The same ball with another speed or another contact law: what parameter studies of the truth vary."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from proofroll.elements.ball_on_surface.model import RollingBall


def with_contact(
    body: RollingBall,
    *,
    mu_static: float | None = None,
    mu_kinetic: float | None = None,
    rolling_resistance: float | None = None,
) -> RollingBall:
    """The ball with other contact parameters.

    Args:
        body: the scene's ball.
        mu_static: new static friction [-].
        mu_kinetic: new kinetic friction [-]; by default it keeps its ratio to ``mu_static`` (1 where both are inf).
        rolling_resistance: new f [m].
    """
    contact = body.contact
    if mu_static is not None:
        if mu_kinetic is None:
            bounded = math.isfinite(contact.mu_static) and contact.mu_static > 0
            mu_kinetic = mu_static * (contact.mu_kinetic / contact.mu_static if bounded else 1.0)
        contact = replace(contact, mu_static=mu_static, mu_kinetic=mu_kinetic)
    if rolling_resistance is not None:
        contact = replace(contact, rolling_resistance=rolling_resistance)
    return replace(body, contact=contact)


def at_speed(body: RollingBall, speed: float) -> RollingBall:
    """The ball with another initial speed of its centre [m/s] in the same direction; it rolls, ω1 is unchanged."""
    e1 = body.surface.normal(body.p0)
    v0 = speed * body.v0 / np.linalg.norm(body.v0)
    w0 = (body.w0 @ e1) * e1 - np.cross(e1, v0) / body.ball.radius
    return replace(body, v0=v0, w0=w0, slip0=np.zeros(3))
