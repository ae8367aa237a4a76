"""A ball whose centre stands still under rolling resistance: whether it stays, and how it sets off.

The resistance follows the direction of the centre's velocity (Blajer 2006, section 2.4), which does not exist at rest.
There it is a bound, as static friction is: a moment of at most f N. What must be held is gravity along the surface.
"""

from __future__ import annotations

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall

# A ball sets off with this part of the speed of a fall by one radius: enough for a direction, too little to matter.
_SETTING_OFF = 1e-12


def stands(body: RollingBall, v_WB: FloatArray) -> bool:
    """Whether the resistance has no direction: there is one, and the centre's velocity ``v_WB`` [m/s] is zero."""
    return body.contact.rolling_resistance > 0 and not np.any(v_WB)


def stays(body: RollingBall, p_WB: FloatArray) -> bool:
    """Whether a ball whose centre stands still at ``p_WB`` [m] stays: friction and resistance can both hold it."""
    pull, press = _pull(body, p_WB)
    strength, contact = float(np.linalg.norm(pull)), body.contact
    # Unbounded friction holds whatever presses the ball, also nothing: inf times 0 would be NaN.
    rubs = strength <= contact.mu_static * press if np.isfinite(contact.mu_static) else True
    return bool(press >= 0 and strength * body.ball.radius <= contact.rolling_resistance * press and rubs)


def setting_off(body: RollingBall, p_WB: FloatArray) -> FloatArray:
    """A velocity down the slope at ``p_WB`` [m], too small to matter [m/s], shape (3,): it gives the resistance a way.

    Only where the ball does not stay (:func:`stays`).
    """
    pull, _ = _pull(body, p_WB)
    strength = float(np.linalg.norm(pull))
    return np.asarray(_SETTING_OFF * np.sqrt(body.ball.radius / strength) * pull) if strength else np.zeros(3)


def _pull(body: RollingBall, p_WB: FloatArray) -> tuple[FloatArray, float]:
    """Tangential gravity [m/s²], shape (3,), and the normal force per mass of a ball at rest [m/s²]."""
    e1 = body.surface.normal(p_WB)
    press = float(e1 @ body.gravity)
    return body.gravity - press * e1, press
