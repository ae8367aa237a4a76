"""Descriptions of the ball's rotation: the paper's Euler angles, a quaternion, or its velocity alone.

The five velocities are s = [u̇1 u̇2 r1 r2 r3]; here r gives the angular velocity along the local axes,
ω' = [ω1 ω2 ω3] = A r. A dot on A means its rate seen from the world.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.engines.projection.geometry import Geometry

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_UNIT = np.eye(3)
# The condition of M̄ grows like 1/sin²θ as θ nears 0 or π. Here, at 30 degrees, nothing is lost yet; the paper's own
# run, where sin θ stays above 0.75, does not come so far.
_RENEWED = 0.5
# Where the axes are not renewed the run ends here, four digits later. With the tightest tolerance, a ball that passes
# at this distance still has its reactions to 2e-11 N (weight 5 N); at 0.003 it is 2e-10 N (measured).
_SMALLEST_SINE = 0.01
# A fixed step that turns the ball by more than this is too coarse anywhere, not only near the singularity.
_LARGEST_SINE = 0.5


class Orientation(ABC):
    """Description of the rotation: angles (none, or three, or a quaternion) and three velocities r.

    Attributes:
        size: number of angles.
        periodic: which of them say the same after a whole turn.
    """

    size: ClassVar[int] = 0
    periodic: ClassVar[tuple[bool, ...]] = ()

    @abstractmethod
    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles [rad], shape (size,), and velocities r, shape (3,), of the angular velocity ω' [rad/s] at time 0."""

    @abstractmethod
    def kinematics(
        self, angles: FloatArray, r: FloatArray, frame: FloatArray, turning: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """A, shape (3, 3), and Ȧ r [rad/s²], shape (3,), where ``turning`` = FᵀḞ [1/s], shape (3, 3).

        Raises:
            ArithmeticError: the angles are not finite.
        """

    @abstractmethod
    def rates(self, u: FloatArray, angles: FloatArray, r: FloatArray) -> FloatArray:
        """Rates of the angles [1/s], shape (size,), where the ball is at ``u``."""

    def check(self, t: float, angles: FloatArray, r: FloatArray, step: float) -> None:  # noqa: B027 -- most never fail
        """Raises Diverged if the description fails at time ``t`` [s]; ``step`` [s] is a fixed step's size, else 0."""

    def renewed(self, t: float, angles: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray] | None:  # noqa: ARG002 -- most never fail
        """Other angles and velocities for the same rotation at time ``t`` [s], where these are about to fail; or None.

        Called once, in order of time, with each state from which the motion goes on; never with one that is only
        looked at.
        """
        return None

    def quaternion(self, angles: FloatArray) -> FloatArray | None:  # noqa: ARG002 -- there may be none
        """Orientation in the world, scalar first, shape (4,), identity at time 0; None if it is not followed."""
        return None


class EulerAngles(Orientation):
    """Euler angles z-x-z [φ θ ψ]: rotation, nutation, precession (Blajer 2006), about the axes of the world.

    Near the singularity at θ = 0 and π the body's axes, whose orientation the angles give, are chosen anew with
    θ = π/2. To a ball all axes through its centre are principal ones with the same moment of inertia, so no equation
    of the paper changes, nor does the formulation: only where the angles are counted from. A hand-over to coordinates
    without a singularity would do as well for the motion, but it would leave the formulation that was asked for, and
    two sets of equations behind one answer.

    Attributes:
        renewals: times [s] at which the axes were chosen anew.
    """

    size: ClassVar[int] = 3
    periodic: ClassVar[tuple[bool, ...]] = (True, True, True)

    def __init__(self, *, renews: bool = True) -> None:
        """Without ``renews`` the run ends at the singularity, as the paper's equations do by themselves."""
        from scipy.spatial.transform import Rotation

        self.renewals: list[float] = []
        self._renews = renews
        self._orientation_then = Rotation.identity()  # of the ball, where the present axes were chosen
        self._axes_then = _body_axes(np.array([0.0, math.pi / 2, 0.0]))

    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See :class:`Orientation`. θ = π/2 is as far from the singularity as can be."""
        angles = np.array([0.0, math.pi / 2, 0.0])
        A, _ = self.kinematics(angles, np.zeros(3), frame, np.zeros((3, 3)))
        return angles, np.asarray(np.linalg.solve(A, w), dtype=np.float64)

    def kinematics(
        self,
        angles: FloatArray,
        r: FloatArray,
        frame: FloatArray,
        turning: FloatArray,  # noqa: ARG002 -- the angles are measured in the world, whatever the frame does
    ) -> tuple[FloatArray, FloatArray]:
        """See :class:`Orientation`. The columns of A are the axes about which φ, θ and ψ turn."""
        _, theta, psi = angles.tolist()
        phi_rate, theta_rate, psi_rate = r.tolist()
        if not math.isfinite(theta + psi):
            raise FloatingPointError("the Euler angles overflow inside a step")
        sin, cos, sin_psi, cos_psi = math.sin(theta), math.cos(theta), math.sin(psi), math.cos(psi)
        axes = np.array(
            [
                [sin * sin_psi, cos_psi, 0.0],
                [-sin * cos_psi, sin_psi, 0.0],
                [cos, 0.0, 1.0],
            ]
        )
        # Rates of the axes times r: θ̇ tilts the axis of φ, and ψ̇ turns the axes of φ and θ about the vertical.
        tilted, turned, node = phi_rate * theta_rate, phi_rate * psi_rate * sin, theta_rate * psi_rate
        drift = np.array(
            [
                tilted * cos * sin_psi + turned * cos_psi - node * sin_psi,
                -tilted * cos * cos_psi + turned * sin_psi + node * cos_psi,
                -tilted * sin,
            ]
        )
        return frame.T @ axes, frame.T @ drift

    def rates(self, u: FloatArray, angles: FloatArray, r: FloatArray) -> FloatArray:  # noqa: ARG002 -- r is their rate
        """See :class:`Orientation`."""
        return r

    def check(self, t: float, angles: FloatArray, r: FloatArray, step: float) -> None:
        """See :class:`Orientation`. Looks for the singularity at θ = 0 and π, where φ and ψ turn about one axis.

        One fixed step turns the ball by |ω| step. If the axis of φ is nearer to the vertical than that, φ and ψ turn by
        a radian or so in a step and the result is silently wrong (by as much as the weight in F3, measured).
        """
        if self._renews:
            return
        theta, smallest = angles.item(1), _SMALLEST_SINE
        if step:
            turn = math.sqrt(max(0.0, r @ r + 2.0 * r[0] * r[2] * math.cos(theta))) * step
            smallest = max(smallest, min(turn, _LARGEST_SINE))
        if abs(math.sin(theta)) < smallest:
            raise Diverged(
                f"θ reached {theta:.4g} rad at t = {t:.6g} s, near the Euler-angle singularity; "
                "leave singularity=stop out, or use formulation=rotating_frame"
            )

    def renewed(self, t: float, angles: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """See :class:`Orientation`. The new axis of φ is horizontal, in line with the angular velocity: then θ̇ = 0."""
        if not self._renews or abs(math.sin(angles[1])) >= _RENEWED:
            return None
        still = np.zeros((3, 3))
        A, _ = self.kinematics(angles, r, np.eye(3), still)
        w = A @ r
        psi = math.atan2(w[0], -w[1])
        chosen = np.array([0.0, math.pi / 2, psi])
        A, _ = self.kinematics(chosen, r, np.eye(3), still)
        self._orientation_then = self._orientation(angles)
        self._axes_then = _body_axes(chosen)
        self.renewals.append(t)
        return chosen, np.asarray(np.linalg.solve(A, w), dtype=np.float64)

    def quaternion(self, angles: FloatArray) -> FloatArray:
        """See :class:`Orientation`."""
        return np.asarray(np.roll(self._orientation(angles).as_quat(), 1), dtype=np.float64)

    def _orientation(self, angles: FloatArray) -> Rotation:
        """Orientation of the ball in the world, identity at time 0."""
        return _body_axes(angles) * self._axes_then.inv() * self._orientation_then


def _body_axes(angles: FloatArray) -> Rotation:
    """Orientation of the body's axes in the world."""
    from scipy.spatial.transform import Rotation

    phi, theta, psi = angles
    return Rotation.from_euler("ZXZ", [psi, theta, phi])


class RotatingFrame(Orientation):
    """The angular velocity along the local axes itself, r = ω' (quasi-velocities): no angle, hence no singularity.

    A ball's inertia does not depend on its orientation, so nothing in the equations asks for it.
    """

    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002 -- no angles
        """See :class:`Orientation`."""
        return np.empty(0), w

    def kinematics(
        self,
        angles: FloatArray,  # noqa: ARG002 -- there are none
        r: FloatArray,
        frame: FloatArray,  # noqa: ARG002 -- everything is along its axes already
        turning: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """See :class:`Orientation`. The axes turn with the frame: F ω' has the rate F (ω̇' + FᵀḞ ω')."""
        return _UNIT, turning @ r

    def rates(self, u: FloatArray, angles: FloatArray, r: FloatArray) -> FloatArray:  # noqa: ARG002 -- no angles
        """See :class:`Orientation`."""
        return angles


class FollowedFrame(RotatingFrame):
    """The same, and besides the orientation: a quaternion in the world, a quadrature on which nothing depends."""

    size: ClassVar[int] = 4
    periodic: ClassVar[tuple[bool, ...]] = (False,) * 4

    def __init__(self, geometry: Geometry) -> None:
        self._geometry = geometry

    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002 -- it starts at the identity
        """See :class:`Orientation`."""
        return np.array([1.0, 0.0, 0.0, 0.0]), w

    def rates(self, u: FloatArray, angles: FloatArray, r: FloatArray) -> FloatArray:
        """See :class:`Orientation`. q̇ = ½ ω ∘ q with ω in the world."""
        x, y, z = (self._geometry.at(u).frame @ r).tolist()
        turning = np.array([[0.0, -x, -y, -z], [x, 0.0, -z, y], [y, z, 0.0, -x], [z, -y, x, 0.0]])
        return np.asarray(0.5 * turning @ angles)

    def quaternion(self, angles: FloatArray) -> FloatArray:
        """See :class:`Orientation`."""
        return np.asarray(angles / np.linalg.norm(angles))
