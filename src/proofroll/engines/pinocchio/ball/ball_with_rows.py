"""Base class of the two formulations that add constraint rows to Pinocchio's equations of a ball."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall


class ContactRows(NamedTuple):
    """Constraint rows of the contact at a state; mass matrix and bias forces are then in ``data``.

    The next evaluation may overwrite the arrays: copy them to keep them.

    Attributes:
        frame: e1, e2, e3 as columns, in the world, shape (3, 3).
        rows: Jacobian for joint velocities, shape (n, nv); the last two rows are the slip along e2 and e3.
        drift: time derivative of the constrained velocities at zero joint acceleration, shape (n,).
        resistance: generalised force of rolling resistance per unit of normal force [m], shape (nv,); from the moment f
            e1 × v/V about the centre (Blajer 2006, section 2.4), zero at V = 0, where it has no direction.
    """

    frame: FloatArray
    rows: FloatArray
    drift: FloatArray
    resistance: FloatArray


class BallWithRows(ABC):
    """A ball on its surface as a Pinocchio model with additional constraint rows.

    Every method takes the ``data`` that it may overwrite, so sampling leaves the running data alone.

    Attributes:
        model: pin.Model.
        ball: index of the joint that carries the ball.
        q0, v0: joint configuration and velocity at time 0.
        q_scale, v_scale: natural sizes of their components, for tolerances.
    """

    ball: int
    q0: FloatArray
    v0: FloatArray
    q_scale: FloatArray
    v_scale: FloatArray

    def __init__(self, body: RollingBall) -> None:
        self._radius = body.ball.radius
        self._f = body.contact.rolling_resistance
        self.model: Any = pin.Model()
        self.model.gravity.linear = body.gravity
        gravity = float(np.linalg.norm(body.gravity))
        self._speed = float(np.linalg.norm(body.v0)) or float(np.sqrt(gravity * self._radius))

    def _add_ball(self, body: RollingBall, parent: int, joint: Any, placement: Any) -> None:
        self.ball = self.model.addJoint(parent, joint, placement, body.ball.name)
        inertia = pin.Inertia(body.ball.mass, np.zeros(3), body.ball.inertia * np.eye(3))
        self.model.appendBodyToJoint(self.ball, inertia, pin.SE3.Identity())
        self._rest = np.zeros(self.model.nv)

    def _own_bias(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration of centre and spin at zero joint acceleration, in the joint's axes, shape (6,).

        Leaves kinematics, mass matrix and bias forces in ``data``.
        """
        pin.forwardKinematics(self.model, data, q, v, self._rest)
        pin.crba(self.model, data, q)
        pin.nonLinearEffects(self.model, data, q, v)
        return pin.getClassicalAcceleration(self.model, data, self.ball, pin.LOCAL).vector  # type: ignore[no-any-return]  # it is an array

    @abstractmethod
    def rows(self, data: Any, q: FloatArray, v: FloatArray) -> ContactRows:
        """Constraint rows at a state."""

    @abstractmethod
    def accelerate(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Joint acceleration without slip, shape (nv,), overwritten by the next call; ``data`` has the reactions."""

    @abstractmethod
    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration without slip, shape (nv,), and wall force on the ball [N], world axes, shape (3,)."""

    def on_surface(self, q: FloatArray) -> FloatArray:
        """Configuration with the centre projected onto the surface; here unchanged, as the joints hold it there."""
        return q

    def gap(self, q: FloatArray) -> float | None:  # noqa: ARG002 -- for those that have one
        """Distance from the surface [m]; None if no row constrains it."""
        return None

    def project(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """State projected onto the constraints, velocities orthogonally in the mass metric (Blajer 2002).

        The centre moves along the normal; an impulse at the contact removes slip, and any normal velocity.
        """
        q = self.on_surface(q)
        return q, np.array(pin.impulseDynamics(self.model, data, v, self._only_rows(data, q, v)))

    def _only_rows(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Constraint rows alone; leaves the mass matrix in ``data``."""
        return self.rows(data, q, v).rows
