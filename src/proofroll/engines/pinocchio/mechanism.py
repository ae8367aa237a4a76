"""What the two formulations have in common, for the integrators and the adapter."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from proofroll.surfaces import FloatArray


@dataclass(frozen=True, slots=True)
class Sliding:
    """What happens while the contact point slides.

    Attributes:
        acceleration: of the joints, shape (nv,).
        normal_force: N [N].
        slip: velocity of the contact point in the world [m/s], shape (3,).
        slip_rate: its rate along the wall, in the world [m/s²], shape (3,).
        friction: on the ball, in the world [N], shape (3,).
        e1: normal towards the wall, shape (3,).
    """

    acceleration: FloatArray
    normal_force: float
    slip: FloatArray
    slip_rate: FloatArray
    friction: FloatArray
    e1: FloatArray


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

    def needed(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[float, float]:
        """Friction that it takes to keep the slip velocity as it is [N], and N [N]."""

    def slide(self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray) -> Sliding:
        """The ball on its surface with friction mu_kinetic N against ``direction``, shape (3,), in the world.

        The direction is a unit vector along the wall; zero leaves the friction out.
        """

    def sliding_reaction(
        self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """As :meth:`reaction`, while sliding against ``direction``."""

    def project_sliding(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The state put back on the surface alone; the same arrays if it cannot have left it."""
