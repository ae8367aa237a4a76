"""Rates of quaternions, which old versions of Pinocchio lack."""

import pinocchio as pin

from proofroll.core.errors import Refused


def require_tangent_map() -> None:
    """Refuses versions of Pinocchio without rates of quaternions.

    Raises:
        Refused: ``tangentMap`` is missing.
    """
    if not hasattr(pin, "tangentMap"):
        raise Refused(f"the rates of quaternions need tangentMap of pinocchio 4.0, and this is {pin.__version__}")
