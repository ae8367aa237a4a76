"""Coefficients of friction that MuJoCo changes or softens, and the edge of its cone."""

from collections.abc import Iterable

from proofroll.core.errors import Refused
from proofroll.engines.mujoco.settings import LARGEST_PYRAMIDAL_FRICTION, MujocoSettings

# MuJoCo silently raises a smaller coefficient to this (mjMINMU), unless the contact has no friction at all.
SMALLEST_FRICTION = 1e-5
# The correction vanishes with the slip, so it may begin a little inside the cone: then all stages of RK4 apply it.
NEAR_CONE = 1 - 1e-3


def check_coefficients(coefficients: Iterable[float], settings: MujocoSettings, softened: str) -> None:
    """Rejects coefficients of friction that MuJoCo would silently change, or that would make ``softened`` soft.

    Raises:
        Refused: the first such coefficient.
    """
    for mu in coefficients:
        if 0 < mu < SMALLEST_FRICTION:
            raise Refused(f"MuJoCo raises a coefficient of friction of {mu:g} to {SMALLEST_FRICTION:g}; 0 is exact")
        if settings.cone == "pyramidal" and mu > LARGEST_PYRAMIDAL_FRICTION:
            limit = f"{LARGEST_PYRAMIDAL_FRICTION:g}"
            raise Refused(f"cone=pyramidal with friction above {limit} makes {softened} soft; set cone=elliptic")
