"""Descriptions of the ball's rotation: the paper's Euler angles, a quaternion, or the angular velocity alone.

The five velocities are s = [u̇1 u̇2 r1 r2 r3]; here r gives the angular velocity in local axes, ω' = [ω1 ω2 ω3] = A r.
A dot on A means its rate in the world frame.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged
from proofroll.papers.blajer_2006.projection.geometry import Frame, Vector, along, in_world

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

# sin θ below which angles are renewed. The condition number of M̄ grows like 1/sin²θ as θ nears 0 or π. Here, at 30
# degrees, no digit is lost yet; in the paper's own run sin θ stays above 0.75.
_RENEWED = 0.5
# sin θ at which the run ends if angles are not renewed, four digits later. With the tightest tolerance, a ball that
# passes at this distance still has its reactions accurate to 2e-11 N (weight 5 N); at 0.003 to 2e-10 N (measured).
_SMALLEST_SINE = 0.01
# sin θ above which a fixed step never fails: one that turns the ball by more is too coarse everywhere.
_LARGEST_SINE = 0.5


class Orientation(ABC):
    """Description of the rotation: angles (none, three, or a quaternion) and three velocities r.

    Attributes:
        size: number of angles.
        periodic: True for angles that are the same after a whole turn.
    """

    size: ClassVar[int] = 0
    periodic: ClassVar[tuple[bool, ...]] = ()

    @abstractmethod
    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Angles [rad], shape (size,), and velocities r, shape (3,), of the angular velocity ω' [rad/s] at time 0."""

    @abstractmethod
    def pose(self, angles: Sequence[float]) -> tuple[float, ...]:
        """Numbers on which A depends, apart from the frame.

        Raises:
            ArithmeticError: the angles are not finite.
        """

    @abstractmethod
    def angular_velocity(self, pose: tuple[float, ...], r: Sequence[float], frame: Frame) -> Vector:
        """Angular velocity ω' = A r [rad/s]."""

    @abstractmethod
    def solved(self, pose: tuple[float, ...], rate: Vector, frame: Frame) -> Vector:
        """Product of A⁻¹ and a vector along e1, e2, e3.

        Raises:
            ArithmeticError: A is singular.
        """

    @abstractmethod
    def acceleration(
        self, pose: tuple[float, ...], r: Sequence[float], rate: Vector, turned: Vector, frame: Frame
    ) -> Vector:
        """Acceleration ṙ = A⁻¹ (ω̇ - Ȧ r) [rad/s²]; ``rate``: ω̇; ``turned``: its part by the frame's turning alone."""

    def rates(self, angles: Sequence[float], r: Sequence[float], frame: Frame) -> Sequence[float]:  # noqa: ARG002 -- there may be none
        """Rates of the angles [1/s]."""
        return ()

    def check(self, t: float, angles: FloatArray, r: FloatArray, step: float) -> None:  # noqa: B027 -- most never fail
        """Checks the description at time ``t`` [s]; ``step``: size of a fixed step [s], else 0.

        Raises:
            Diverged: the description fails.
        """

    def renewed(self, t: float, angles: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray] | None:  # noqa: ARG002 -- most never fail
        """Other angles and velocities for the same rotation at time ``t`` [s] if these are about to fail; else None.

        Called once, in order of time, with each state from which the motion goes on; never with a state that is only
        sampled.
        """
        return None

    def quaternion(self, angles: FloatArray) -> FloatArray | None:  # noqa: ARG002 -- there may be none
        """Orientation in the world, scalar first, shape (4,), identity at time 0; None if it is not followed."""
        return None


class EulerAngles(Orientation):
    """Euler angles z-x-z [φ θ ψ]: rotation, nutation, precession (Blajer 2006), about the axes of the world.

    Near the singularity at θ = 0 and π the body axes, whose orientation the angles give, are renewed with θ = π/2. All
    axes through a ball's centre are principal axes with the same moment of inertia, so no equation of the paper
    changes, only the reference of the angles. Coordinates without a singularity would give the same motion, but by
    another formulation than the one requested, with two sets of equations for one result.

    Attributes:
        renewals: times [s] at which the axes were renewed.
    """

    size: ClassVar[int] = 3
    periodic: ClassVar[tuple[bool, ...]] = (True, True, True)

    def __init__(self, *, renews: bool = True) -> None:
        """Starts with renewal; without ``renews`` the run ends at the singularity, as the paper's equations do."""
        from scipy.spatial.transform import Rotation

        self.renewals: list[float] = []
        self._renews = renews
        self._orientation_then = Rotation.identity()  # of the ball, when the present axes were chosen
        self._back = _body_axes(np.array([0.0, math.pi / 2, 0.0])).inv()

    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See :class:`Orientation`. θ = π/2 is farthest from the singularity."""
        angles = [0.0, math.pi / 2, 0.0]
        return np.array(angles), np.array(_about_the_axes(self.pose(angles), *(frame @ w).tolist()))

    def pose(self, angles: Sequence[float]) -> tuple[float, ...]:
        """See :class:`Orientation`: sine and cosine of θ and of ψ."""
        _, theta, psi = angles
        if not math.isfinite(theta + psi):
            raise FloatingPointError("the Euler angles overflow inside a step")
        return math.sin(theta), math.cos(theta), math.sin(psi), math.cos(psi)

    @override
    def angular_velocity(self, pose: tuple[float, ...], r: Sequence[float], frame: Frame) -> Vector:
        return along(frame, *_turning(pose, r))

    @override
    def solved(self, pose: tuple[float, ...], rate: Vector, frame: Frame) -> Vector:
        return _about_the_axes(pose, *in_world(frame, *rate))

    def acceleration(
        self,
        pose: tuple[float, ...],
        r: Sequence[float],
        rate: Vector,
        turned: Vector,  # noqa: ARG002 -- the angles are measured in the world, whatever the frame does
        frame: Frame,
    ) -> Vector:
        """See :class:`Orientation`. θ̇ tilts the axis of φ, and ψ̇ turns the axes of φ and θ about the vertical."""
        sin, cos, sin_psi, cos_psi = pose
        phi_rate, theta_rate, psi_rate = r
        x, y, z = in_world(frame, *rate)
        level, across = phi_rate * psi_rate * sin, phi_rate * theta_rate * cos - theta_rate * psi_rate
        x, y = x - level * cos_psi - across * sin_psi, y - level * sin_psi + across * cos_psi
        return _about_the_axes(pose, x, y, z + phi_rate * theta_rate * sin)

    @override
    def rates(self, angles: Sequence[float], r: Sequence[float], frame: Frame) -> Sequence[float]:
        return r

    def check(self, t: float, angles: FloatArray, r: FloatArray, step: float) -> None:
        """See :class:`Orientation`. Detects the singularity at θ = 0 and π, where φ and ψ turn about one axis.

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
        """See :class:`Orientation`. The new axis of φ is horizontal, along the angular velocity, so θ̇ = 0."""
        if not self._renews or abs(math.sin(angles[1])) >= _RENEWED:
            return None
        w = _turning(self.pose(angles.tolist()), r.tolist())
        chosen = [0.0, math.pi / 2, math.atan2(w[0], -w[1])]
        self._orientation_then = self._orientation(angles)
        self._back = _body_axes(chosen).inv()
        self.renewals.append(t)
        return np.array(chosen), np.array(_about_the_axes(self.pose(chosen), *w))

    @override
    def quaternion(self, angles: FloatArray) -> FloatArray:
        return np.asarray(self._orientation(angles).as_quat(scalar_first=True), dtype=np.float64)

    def _orientation(self, angles: FloatArray) -> Rotation:
        """Orientation of the ball in the world, identity at time 0."""
        return _body_axes(angles) * self._back * self._orientation_then


def _turning(pose: tuple[float, ...], r: Sequence[float]) -> Vector:
    """Angular velocity in the world from the rates r of φ, θ and ψ [rad/s]; the columns of A are their axes."""
    sin, cos, sin_psi, cos_psi = pose
    phi_rate, theta_rate, psi_rate = r
    level = phi_rate * sin
    return level * sin_psi + theta_rate * cos_psi, theta_rate * sin_psi - level * cos_psi, phi_rate * cos + psi_rate


def _about_the_axes(pose: tuple[float, ...], x: float, y: float, z: float) -> Vector:
    """Rates of φ, θ and ψ from an angular velocity in the world: inverse of :func:`_turning`."""
    sin, cos, sin_psi, cos_psi = pose
    if not sin:
        raise ArithmeticError("the equations of motion are singular")
    phi_rate = (x * sin_psi - y * cos_psi) / sin
    return phi_rate, x * cos_psi + y * sin_psi, z - phi_rate * cos


def _body_axes(angles: FloatArray | Sequence[float]) -> Rotation:
    """Orientation of the body axes in the world."""
    from scipy.spatial.transform import Rotation

    phi, theta, psi = angles
    return Rotation.from_euler("ZXZ", [psi, theta, phi])


class RotatingFrame(Orientation):
    """Angular velocity in local axes, r = ω' (quasi-velocities): no angles, hence no singularity.

    A ball's inertia is the same in all orientations, so the equations do not need the orientation.
    """

    @override
    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.empty(0), w

    @override
    def pose(self, angles: Sequence[float]) -> tuple[float, ...]:
        return ()

    @override
    def angular_velocity(self, pose: tuple[float, ...], r: Sequence[float], frame: Frame) -> Vector:
        w1, w2, w3 = r
        return w1, w2, w3

    @override
    def solved(self, pose: tuple[float, ...], rate: Vector, frame: Frame) -> Vector:
        return rate

    def acceleration(
        self,
        pose: tuple[float, ...],  # noqa: ARG002 -- there are no angles
        r: Sequence[float],  # noqa: ARG002 -- known by what it turns
        rate: Vector,
        turned: Vector,
        frame: Frame,  # noqa: ARG002 -- everything is along its axes already
    ) -> Vector:
        """See :class:`Orientation`. The axes turn with the frame: F ω' has the rate F (ω̇' + FᵀḞ ω')."""
        (a1, a2, a3), (b1, b2, b3) = rate, turned
        return a1 - b1, a2 - b2, a3 - b3


class FollowedFrame(RotatingFrame):
    """:class:`RotatingFrame` with the orientation as a quaternion, by a quadrature that affects nothing else."""

    size: ClassVar[int] = 4
    periodic: ClassVar[tuple[bool, ...]] = (False,) * 4

    @override
    def start(self, frame: FloatArray, w: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.array([1.0, 0.0, 0.0, 0.0]), w

    def rates(self, angles: Sequence[float], r: Sequence[float], frame: Frame) -> Sequence[float]:
        """See :class:`Orientation`. q̇ = ½ ω ∘ q with ω in the world."""
        x, y, z = (0.5 * w for w in in_world(frame, *r))
        q0, q1, q2, q3 = angles
        return (-x * q1 - y * q2 - z * q3, x * q0 - z * q2 + y * q3, y * q0 + z * q1 - x * q3, z * q0 - y * q1 + x * q2)

    @override
    def quaternion(self, angles: FloatArray) -> FloatArray:
        return np.asarray(angles / np.linalg.norm(angles))
