"""The equations of motion on a surface that looks the same from every point of it, written out.

There all geometry along the local axes is constant, and what is left of the projections of :mod:`method` are a few
dozen products. As plain floats they cost a fifth of the same in arrays of three to seven numbers. Nothing is modelled
here: the results are those of :class:`~proofroll.engines.projection.method.ProjectedBall` with both rows of rolling
active. Here is what both formulations share, and the rotating frame; the Euler angles are in :mod:`uniform_euler`.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.projection.geometry import Uniform


class Closed(ABC):
    """The equations at a state x = [q, s], with what the centre contributes: constants in the local axes.

    Attributes:
        mass: m TᵀT, shape (2, 2).
        tangents: T, rows e2 and e3, shape (2, 2).
    """

    _coordinates: int

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        local = geometry.at(np.zeros(2))
        self.m, self.J, self.a = body.ball.mass, body.ball.inertia, body.ball.radius
        self.f = body.contact.rolling_resistance
        self.tangents = local.tangents[1:]
        self.mass = self.m * self.tangents.T @ self.tangents
        (self.t2u, self.t2v), (self.t3u, self.t3v) = self.tangents.tolist()
        # d_i = uu u̇² + uv u̇ v̇ + vv v̇²
        self.second = [(float(s[0, 0]), float(s[0, 1] + s[1, 0]), float(s[1, 1])) for s in local.second]
        turning = local.turning
        self.turn_u, self.turn_v = (
            (float(turning[2, 1, k]), float(turning[0, 2, k]), float(turning[1, 0, k])) for k in (0, 1)
        )
        self.column = geometry.column
        # A frame turned by α about k is F0 + sin α F1 + (1 - cos α) F2, and so is gravity along its axes.
        self.frames = [tuple(part.T.ravel().tolist()) for part in geometry.parts]
        self.gravity = [tuple((body.gravity @ part).tolist()) for part in geometry.parts]
        size = 1e-15 * float(np.linalg.norm(body.gravity))
        self.steady = all(abs(x) <= size for part in self.gravity[1:] for x in part)
        self._last: tuple[FloatArray | None, tuple[FloatArray, float]] = (None, (np.empty(0), 0.0))

    def frame(self, sin: float, cos: float) -> tuple[float, ...]:
        """Components of e1, e2, e3 in the world, one after the other."""
        # Written out: a loop over the nine makes a whole evaluation a tenth slower.
        (x1, y1, z1, x2, y2, z2, x3, y3, z3), once, twice = self.frames
        a1, b1, c1, a2, b2, c2, a3, b3, c3 = once
        d1, e1, f1, d2, e2, f2, d3, e3, f3 = twice
        back = 1.0 - cos
        return (
            x1 + sin * a1 + back * d1,
            y1 + sin * b1 + back * e1,
            z1 + sin * c1 + back * f1,
            x2 + sin * a2 + back * d2,
            y2 + sin * b2 + back * e2,
            z2 + sin * c2 + back * f2,
            x3 + sin * a3 + back * d3,
            y3 + sin * b3 + back * e3,
            z3 + sin * c3 + back * f3,
        )

    def weight(self, sin: float, cos: float) -> tuple[float, ...]:
        """Gravity along e1, e2, e3 [m/s²]."""
        start, once, twice = self.gravity
        if self.steady:
            return start
        back = 1.0 - cos
        return tuple([x + sin * y + back * z for x, y, z in zip(start, once, twice, strict=True)])

    def angle(self, x: list[float]) -> tuple[float, float]:
        """Sine and cosine of the angle of the frame."""
        if self.column is None:
            return 0.0, 1.0
        angle = x[self.column]
        if not math.isfinite(angle):
            raise FloatingPointError("the place on the surface is not finite")
        return math.sin(angle), math.cos(angle)

    def drift(self, u: float, v: float) -> tuple[float, float, float]:
        """Second derivative of the place along e1, e2, e3 without accelerations [m/s²]."""
        uu, uv, vv = u * u, u * v, v * v
        (a1, b1, c1), (a2, b2, c2), (a3, b3, c3) = self.second
        return a1 * uu + b1 * uv + c1 * vv, a2 * uu + b2 * uv + c2 * vv, a3 * uu + b3 * uv + c3 * vv

    def moment(self, N: float, v2: float, v3: float) -> tuple[float, float]:
        """M2, M3 of the rolling resistance [N m]."""
        speed = math.hypot(v2, v3)
        lever = N * self.f / speed if speed else 0.0
        return -lever * v3, lever * v2

    @abstractmethod
    def _all(self, x: FloatArray) -> tuple[FloatArray, float]:
        """[q̇, ṡ, λ_nh] and N [N]."""

    def rates(self, x: FloatArray) -> FloatArray:
        """ẋ.

        Raises:
            ArithmeticError: there is none, or the state is not finite.
        """
        found = self._all(x)
        # Whoever watches the reactions asks for them at the state whose rates were found last: it is that very object.
        self._last = x, found
        return found[0][:-2]

    def solve(self, x: FloatArray) -> tuple[FloatArray, float]:
        """[ṡ, λ_nh], shape (7,), and N [N].

        Raises:
            ArithmeticError: as in :meth:`rates`.
        """
        last, found = self._last
        everything, N = found if last is x else self._all(x)
        return everything[self._coordinates :], N

    @abstractmethod
    def eliminated(self, x: FloatArray) -> FloatArray:
        """The state with the violation of C v = 0 removed from s."""


class AlongAxes(Closed):
    """Velocities ω' along the local axes: A = 1, so the matrix is constant, and inverted once.

    What it is multiplied by is a sum of products of velocities with constant factors, so these are multiplied by the
    inverse once and for all too.
    """

    _coordinates = 2

    def __init__(self, body: RollingBall, geometry: Uniform) -> None:
        super().__init__(body, geometry)
        rows = np.zeros((2, 5))
        rows[:, :2] = self.tangents
        rows[0, 4], rows[1, 3] = self.a, -self.a
        matrix = np.zeros((7, 7))
        matrix[:2, :2], matrix[2:5, 2:5] = self.mass, self.J * np.eye(3)
        matrix[:5, 5:], matrix[5:, :5] = rows.T, rows
        inverse = np.linalg.inv(matrix)
        self._by_slip = inverse[:5, 5:] @ rows
        self._by_product = np.zeros((9, 15))
        self._by_product[0, 2] = self._by_product[1, 3] = 1.0  # u̇ = u and v̇ = v
        self._by_product[2:] = inverse @ self._right()

    def _right(self) -> FloatArray:
        """Factors of g2, g3, u, v, u², uv, v², u ω', v ω', M2, M3 on the right side, shape (7, 15)."""
        tangents, right = self.tangents, np.zeros((7, 15))
        second = np.array(self.second[1:])  # of d2, d3 on u², uv, v²
        right[:2, :2] = self.m * tangents.T
        right[:2, 4:7] = -self.m * tangents.T @ second
        (u1, *_), (v1, *_) = self.turn_u, self.turn_v
        right[5:, 4:7] = -second
        for row, (along_u, along_v), sign in ((5, tangents[1], -1.0), (6, tangents[0], 1.0)):
            right[row, 4:7] += sign * np.array([u1 * along_u, u1 * along_v + v1 * along_u, v1 * along_v])
        for first, turn in ((7, self.turn_u), (10, self.turn_v)):
            right[2:5, first : first + 3] = -self.J * np.cross(turn, np.eye(3)).T
        right[3, 13] = right[4, 14] = 1.0
        return right

    def _all(self, x: FloatArray) -> tuple[FloatArray, float]:
        state = x.tolist()
        _, _, u, v, w1, w2, w3 = state
        g1, g2, g3 = self.gravity[0] if self.steady else self.weight(*self.angle(state))
        uu, uv, vv = u * u, u * v, v * v
        a1, b1, c1 = self.second[0]
        N = self.m * (g1 - (a1 * uu + b1 * uv + c1 * vv))
        M2 = M3 = 0.0
        if self.f:
            M2, M3 = self.moment(N, self.t2u * u + self.t2v * v, self.t3u * u + self.t3v * v)
        products = (g2, g3, u, v, uu, uv, vv, u * w1, u * w2, u * w3, v * w1, v * w2, v * w3, M2, M3)
        return self._by_product.dot(np.array(products)), N

    def eliminated(self, x: FloatArray) -> FloatArray:
        """See :class:`Closed`."""
        result = x.copy()
        result[2:] -= self._by_slip.dot(x[2:])
        return result
