"""What the two formulations have in common, for the integrators and the adapter."""

from __future__ import annotations

from typing import Any, Protocol

from proofroll.surfaces import FloatArray


class Mechanism(Protocol):
    """A ball on its surface as a Pinocchio model with rows on top.

    Every method takes the ``data`` that it may overwrite, so that sampling leaves the running data alone.

    Attributes:
        model: pin.Model.
        ball: index of the joint that carries the ball.
        q0, v0: joint configuration and velocity at time 0.
        q_scale, v_scale: natural sizes of their components, for tolerances.
    """

    model: Any
    ball: int
    q0: FloatArray
    v0: FloatArray
    q_scale: FloatArray
    v_scale: FloatArray

    def respond(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, shape (nv,), and multipliers of the rows [N]."""

    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, shape (nv,), and force of the wall on the ball in the world [N], shape (3,)."""

    def project(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The state put back on the constraints, velocities orthogonally in the metric of the mass (Blajer 2002)."""

    def rolling_row(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Row of slip along e2, shape (nv,)."""

    def resistance(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray | None:
        """Rolling resistance on the joints per unit of normal force [m], shape (nv,); None if none was built."""
