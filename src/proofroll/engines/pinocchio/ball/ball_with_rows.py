"""Base class of the two formulations that add constraint rows to Pinocchio's equations of a ball."""

import math
import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.elements.ball_on_surface.model import RollingBall

# Largest pull of the wall that is round-off, relative to the ball's weight plus the force that bends its path to the
# ball's radius.
_FAINT = 1e-9
# Round-off of friction, and of its excess over the available friction, relative to the normal force.
NOISE = 1e-13


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


@dataclass(frozen=True, slots=True)
class SlidingContact:
    """Accelerations, forces and slip while the contact point slides.

    Attributes:
        acceleration: of the joints, shape (nv,).
        normal_force: N [N].
        slip: velocity of the contact point in the world [m/s], shape (3,).
        slip_rate: its time derivative along the wall, in the world [m/s²], shape (3,).
        friction: on the ball, in the world [N], shape (3,).
        e1: normal towards the wall, shape (3,).
    """

    acceleration: FloatArray
    normal_force: float
    slip: FloatArray
    slip_rate: FloatArray
    friction: FloatArray
    e1: FloatArray


def unit(vector: FloatArray) -> FloatArray:
    """Unit vector in the same direction; zero stays zero."""
    length = math.sqrt(vector @ vector)
    return vector / length if length > 0 else vector


def left_the_wall(when: str) -> Diverged:
    """Error that ends a run where the wall would have to pull; ``when`` is e.g. ``at 0.2 s``."""
    return Diverged(f"the ball leaves the wall {when}, which this formulation does not model")


class BallWithRows(ABC):
    """A ball on its surface as a Pinocchio model with additional constraint rows.

    Every method takes the ``data`` that it may overwrite, so sampling leaves the running data alone.

    Attributes:
        model: pin.Model.
        ball: index of the joint that carries the ball.
        q0, v0: joint configuration and velocity at time 0.
        q_scale, v_scale: natural sizes of their components, for tolerances.
        faint: normal force that is round-off [N].
    """

    ball: int
    q0: FloatArray
    v0: FloatArray
    q_scale: FloatArray
    v_scale: FloatArray

    def __init__(self, body: RollingBall) -> None:
        self._radius = body.ball.radius
        self._f = body.contact.rolling_resistance
        self._mu_kinetic = body.contact.mu_kinetic
        self.model: Any = pin.Model()
        self.model.gravity.linear = body.gravity
        gravity = float(np.linalg.norm(body.gravity))
        self._speed = float(np.linalg.norm(body.v0)) or float(np.sqrt(gravity * self._radius))
        self.faint = _FAINT * body.ball.mass * (gravity + self._speed**2 / self._radius)

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
    def normal_force(self, data: Any) -> float:
        """Normal force N [N] that the last :meth:`accelerate` left in ``data``."""

    def excess(self, data: Any, q: FloatArray, v: FloatArray, mu_static: float) -> tuple[float, float]:
        """(needed - available) / (needed + available) friction while sticking [1], and normal force N [N].

        Slip starts where the first is positive.
        """
        self.accelerate(data, q, v)
        return self.last_excess(data, mu_static)

    def last_excess(self, data: Any, mu_static: float) -> tuple[float, float]:
        """:meth:`excess` at the state of the last :meth:`accelerate`."""
        *_, F2, F3 = data.lambda_c.tolist()
        needed, normal_force = math.hypot(F2, F3), self.normal_force(data)
        available = mu_static * normal_force
        # Round-off makes the needed friction positive even where it is zero; that must not exceed a friction of zero
        # (mu_static = 0).
        noise = NOISE * abs(normal_force)
        size = max(needed + abs(available) + noise, sys.float_info.min)
        return (needed - available - noise) / size, normal_force

    @abstractmethod
    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration without slip, shape (nv,), and wall force on the ball [N], world axes, shape (3,)."""

    @abstractmethod
    def slide(self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray) -> SlidingContact:
        """Motion on the surface with friction mu_kinetic N opposite to ``direction``, shape (3,), in the world.

        The direction is a unit vector along the wall; zero omits the friction.
        """

    @abstractmethod
    def sliding_reaction(
        self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration and force as :meth:`reaction`, while sliding in ``direction``."""

    @abstractmethod
    def project_sliding(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Configuration and velocity projected onto the surface only; the same arrays if they cannot have left it."""

    def friction(self, normal_force: float, direction: FloatArray) -> FloatArray:
        """Friction [N] while sliding along ``direction``; both as components along e2 and e3, shape (2,)."""
        return -self._mu_kinetic * normal_force * direction

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
