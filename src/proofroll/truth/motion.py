"""What every route to the truth returns."""

from __future__ import annotations

from dataclasses import dataclass

from proofroll.surfaces import FloatArray


@dataclass(frozen=True)
class Motion:
    """State and contact force at given times.

    Attributes:
        p_WB, v_WB, w_WB: centre [m], its velocity [m/s], angular velocity [rad/s], shape (time, 3).
        force: of the wall on the ball [N], shape (time, 3).
        route: how it was found, for a person.
    """

    p_WB: FloatArray
    v_WB: FloatArray
    w_WB: FloatArray
    force: FloatArray
    route: str
