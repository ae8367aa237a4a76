"""Formulation ``free_flyer``: a free ball, held on the surface without slip by three constraint rows."""

import math
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin
from typing_extensions import override

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.pinocchio.ball.ball_with_rows import BallWithRows, ContactRows

# Writes 18 numbers into an array at once, which is quicker than an assignment for each.
_PACK: Any = struct.Struct("18d").pack_into


class FreeFlyer(BallWithRows):
    """Six degrees of freedom; the rows follow from the signed distance to the surface and its derivatives.

    Velocities are those of the free-flyer joint, in the ball's own axes. The multipliers are the components of the
    wall's force along e1, e2 and e3. If the orientation is not integrated, the ball's axes stay the world's.
    """

    @override
    def __init__(self, body: RollingBall, orientation: bool) -> None:
        super().__init__(body)
        self._surface, self._orientation = body.surface, orientation
        self._matrix = np.zeros((9, 9))
        self._directions = np.zeros((3, 6))
        self._add_ball(body, 0, pin.JointModelFreeFlyer(), pin.SE3.Identity())
        self.q0 = np.concatenate([body.p0, [0.0, 0.0, 0.0, 1.0]])
        self.v0 = np.concatenate([body.v0, body.w0])
        self.q_scale = np.concatenate([np.full(3, self._radius), np.ones(4)])
        self.v_scale = np.concatenate([np.full(3, self._speed), np.full(3, self._speed / self._radius)])

    def _aimed(self, moving: Sequence[float]) -> FloatArray:
        """Matrix from (v, ω) to normal velocity and slip along e2, e3, world axes, shape (3, 6); overwritten.

        The row along e1 is e1·v, along e2 the slip e2·v + a e3·ω, along e3 the slip e3·v - a e2·ω.
        """
        _, x1, y1, z1, x2, y2, z2, x3, y3, z3, *_ = moving
        a = self._radius
        rolling2, rolling3 = (a * x3, a * y3, a * z3), (-a * x2, -a * y2, -a * z2)
        _PACK(self._directions, 0, x1, y1, z1, 0.0, 0.0, 0.0, x2, y2, z2, *rolling2, x3, y3, z3, *rolling3)
        return self._directions

    def _at(
        self, data: Any, q: FloatArray, v: FloatArray
    ) -> tuple[Sequence[float], FloatArray, FloatArray, FloatArray, tuple[float, float, float]]:
        """Distance, triad and ė1 as 13 numbers; rows, drift and resistance of :class:`ContactRows`; ω × v, world axes.

        The surface's row comes first, then the two of rolling. Components are plain floats: adding to array elements
        takes three times as long. Leaves the mass matrix and the bias forces in ``data``.
        """
        pin.crba(self.model, data, q)
        pin.nonLinearEffects(self.model, data, q, v)
        # without orientation the joint's axes are the world's
        turned = pin.Quaternion(q[3:]).toRotationMatrix() if self._orientation else None
        px, py, pz = q[:3].tolist()
        if turned is None:
            vx, vy, vz, wx, wy, wz = v.tolist()
        else:
            (vx, vy, vz), (wx, wy, wz) = turned.dot(v[:3]).tolist(), turned.dot(v[3:]).tolist()
        moving = self._surface.moving_triad(px, py, pz, vx, vy, vz)
        _, x1, y1, z1, x2, y2, z2, x3, y3, z3, x, y, z = moving
        rows = self._aimed(moving)
        if turned is not None:
            rows = rows.reshape(6, 3).dot(turned).reshape(3, 6)  # both halves of each row
        a = self._radius
        # ω × v, the centre's acceleration at zero joint acceleration, and with a ω × ė1
        bx, by, bz = wy * vz - wz * vy, wz * vx - wx * vz, wx * vy - wy * vx
        tx, ty, tz = bx + a * (wy * z - wz * y), by + a * (wz * x - wx * z), bz + a * (wx * y - wy * x)
        normal_drift = x1 * bx + y1 * by + z1 * bz + x * vx + y * vy + z * vz
        drift = np.array((normal_drift, x2 * tx + y2 * ty + z2 * tz, x3 * tx + y3 * ty + z3 * tz))
        resistance = self._rest
        if self._f:
            speed = math.sqrt(vx * vx + vy * vy + vz * vz)
            f = self._f / speed if speed else 0.0
            moment = np.array((f * (y1 * vz - z1 * vy), f * (z1 * vx - x1 * vz), f * (x1 * vy - y1 * vx)))
            resistance = np.zeros(6)
            resistance[3:] = moment if turned is None else moment.dot(turned)
        return moving, rows, drift, resistance, (bx, by, bz)

    def rows(self, data: Any, q: FloatArray, v: FloatArray) -> ContactRows:
        """See :class:`.ball_with_rows.BallWithRows`; surface row, then rolling rows."""
        pin.forwardKinematics(self.model, data, q, v)
        moving, *rest, _ = self._at(data, q, v)
        return ContactRows(np.array(moving[1:10]).reshape(3, 3).T, *rest)

    def _only_rows(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        if self._orientation:
            return super()._only_rows(data, q, v)
        pin.crba(self.model, data, q)
        x, y, z = q[:3].tolist()
        return self._aimed(self._surface.moving_triad(x, y, z, 0.0, 0.0, 0.0))

    def _solve(self, data: Any, rows: FloatArray, drift: FloatArray, resistance: FloatArray) -> FloatArray:
        """Joint acceleration; leaves the multipliers (-N, F2, F3) [N] in ``data``.

        Rolling resistance is proportional to the unknown N: it makes the matrix unsymmetric, which forwardDynamics does
        not allow.
        """
        if not self._f:
            return pin.forwardDynamics(self.model, data, self._rest, rows, drift)  # type: ignore[no-any-return]  # it is an array
        matrix = self._matrix
        matrix[:6, :6], matrix[6:, :6], matrix[:6, 6:] = data.M, rows, -rows.T
        matrix[:6, 6] += resistance
        solution = np.linalg.solve(matrix, np.concatenate([-data.nle, -drift]))
        data.lambda_c = solution[6:]  # where forwardDynamics leaves them
        return solution[:6]

    def accelerate(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """See :class:`~proofroll.engines.pinocchio.ball.ball_with_rows.BallWithRows`.

        Without orientation the acceleration has world components: the joint's acceleration refers to the ball's axes,
        which turn with ω, while the axes held fixed do not.
        """
        _, rows, drift, resistance, (bx, by, bz) = self._at(data, q, v)
        acceleration = self._solve(data, rows, drift, resistance)
        if self._orientation:
            return acceleration
        ax, ay, az, *_ = acceleration.tolist()
        acceleration[0], acceleration[1], acceleration[2] = ax + bx, ay + by, az + bz
        return acceleration

    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, and the wall's force from the multipliers."""
        frame, *rows = self.rows(data, q, v)
        return np.array(self._solve(data, *rows)), frame @ data.lambda_c

    def on_surface(self, q: FloatArray) -> FloatArray:
        """Configuration with the centre moved onto the surface along its normal."""
        q = q.copy()
        px, py, pz = q[:3].tolist()
        gap, x, y, z = self._surface.nearby(px, py, pz)
        q[0], q[1], q[2] = px + gap * x, py + gap * y, pz + gap * z
        return q

    def gap(self, q: FloatArray) -> float:
        """Distance from the surface [m]."""
        return float(self._surface.gap(q[:3]))
