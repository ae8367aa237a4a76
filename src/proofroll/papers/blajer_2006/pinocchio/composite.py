"""Formulation ``composite``: joints along the surface, so that the ball cannot leave it."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.papers.blajer_2006.ball.model import RollingBall


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


class _AlongAxes(NamedTuple):
    """Constant terms along e1, e2, e3, from Pinocchio's Jacobian of the ball in these axes.

    Attributes:
        directions: slip along e2 and e3 from (v, ω), shape (2, 6).
        rows: slip along e2 and e3 from the joint velocities, shape (2, 5).
        by_moment: joint torques from a moment on the ball, shape (5, 3).
        tangents: velocity of the centre along e2 and e3 per rate of each coordinate [m/unit].
        turns: angular velocity of the carriage about e1, e2 and e3 per rate of each coordinate [rad/unit].
    """

    directions: FloatArray
    rows: FloatArray
    by_moment: FloatArray
    tangents: tuple[tuple[float, float], ...]
    turns: tuple[Any, ...]


class Composite:
    """A joint about the cylinder's axis and one along it carry a massless carriage; a spherical joint carries the ball.

    Coordinates are (u1, u2, orientation of the ball in the carriage), velocities (u̇1, u̇2, spin relative to the
    carriage in the ball's axes). The two rolling rows are the only constraints. The spherical joint transmits the
    normal force.

    Without integrated orientation the ball's axes are those of the carriage, e1, e2, e3, and all quantities of
    Pinocchio have components along them. As the two motions of the surface commute, Jacobian and rows are constant in
    these axes.

    Every method takes the ``data`` that it may overwrite, so sampling leaves the running data alone.

    Attributes:
        model: pin.Model.
        ball: index of the joint that carries the ball.
        q0, v0: joint configuration and velocity at time 0.
        q_scale, v_scale: natural sizes of their components, for tolerances.
    """

    def __init__(self, body: RollingBall, orientation: bool) -> None:
        """Builds the model; ``orientation``: whether the ball's own axes turn."""
        self._radius = body.ball.radius
        self._f = body.contact.rolling_resistance
        self.model: Any = pin.Model()
        self.model.gravity.linear = body.gravity
        speed = float(np.linalg.norm(body.v0)) or math.sqrt(float(np.linalg.norm(body.gravity)) * self._radius)
        self._frame0 = body.surface.frame(np.zeros(2))
        self._carriage = 0
        self._read: Any = None  # the data to which self._wrench refers
        axis = self._frame0[:, 2]
        joints = pin.JointModelRevoluteUnaligned(axis), pin.JointModelPrismaticUnaligned(axis)
        for name, joint in zip(body.surface.coordinates, joints, strict=True):
            self._carriage = self.model.addJoint(self._carriage, joint, pin.SE3.Identity(), name)
        placement = pin.SE3(self._frame0, body.surface.position(np.zeros(2)))
        self._wrench = np.zeros(3)
        self.ball = self.model.addJoint(self._carriage, pin.JointModelSpherical(), placement, body.ball.name)
        inertia = pin.Inertia(body.ball.mass, np.zeros(3), body.ball.inertia * np.eye(3))
        self.model.appendBodyToJoint(self.ball, inertia, pin.SE3.Identity())
        self._rest = np.zeros(self.model.nv)

        data = self.model.createData()
        self.q0 = np.concatenate([body.u0, [0.0, 0.0, 0.0, 1.0]])
        if orientation:  # q_WB is the identity at time 0
            pin.forwardKinematics(self.model, data, self.q0)
            self.q0[2:] = pin.Quaternion(data.oMi[self.ball].rotation.T.copy()).coeffs()
        pin.computeJointJacobians(self.model, data, self.q0)
        jacobian = pin.getJointJacobian(self.model, data, self.ball, pin.LOCAL_WORLD_ALIGNED)
        self._own = None if orientation else self._along_axes()
        self.v0 = np.linalg.lstsq(jacobian, np.concatenate([body.v0, body.w0]), rcond=None)[0]
        metres = np.asarray(body.surface.length_scales)
        self.q_scale = np.concatenate([self._radius / metres, np.ones(4)])
        self.v_scale = np.concatenate([speed / metres, np.full(3, speed / self._radius)])

    def rows(self, data: Any, q: FloatArray, v: FloatArray) -> ContactRows:
        """Constraint rows of no slip at a state."""
        model, ball, a, axes = self.model, self.ball, self._radius, pin.LOCAL_WORLD_ALIGNED
        # computeAllTerms does not touch data.a, so the bias needs forwardKinematics with a joint acceleration of zero
        pin.forwardKinematics(model, data, q, v, self._rest)
        pin.computeAllTerms(model, data, q, v)
        jacobian, velocity = pin.getJointJacobian(model, data, ball, axes), pin.getVelocity(model, data, ball, axes)
        frame = data.oMi[self._carriage].rotation.dot(self._frame0)
        e1, (x2, y2, z2), (x3, y3, z3) = frame.T.tolist()
        directions = _slip_directions(a, frame)
        # ω × ė1 in plain floats: numpy's overhead would take as long as all computations of Pinocchio here
        turning = pin.getVelocity(model, data, self._carriage, axes).angular
        x, y, z = _cross(velocity.angular.tolist(), _cross(turning.tolist(), e1))
        drift = directions.dot(pin.getClassicalAcceleration(model, data, ball, axes).vector)
        drift[0] += a * (x2 * x + y2 * y + z2 * z)
        drift[1] += a * (x3 * x + y3 * y + z3 * z)
        resistance = self._rest
        if self._f:
            slide = velocity.linear.tolist()
            speed = math.hypot(*slide)
            moment = np.array(_cross(e1, slide)) * (self._f / speed if speed else 0.0)
            resistance = jacobian[3:].T.dot(moment)
        return ContactRows(frame, directions.dot(jacobian), drift, resistance)

    def _along_axes(self) -> _AlongAxes:
        """Slip Jacobian in the ball's axes, which is the same everywhere."""
        here = self._own_jacobian(self.q0)
        directions = _slip_directions(self._radius, np.eye(3))
        (_, _), (t2u, t2v), (t3u, t3v), *turns = here[:, :2].tolist()
        return _AlongAxes(
            directions=directions,
            rows=directions @ here,
            by_moment=here[3:].T.copy(),
            tangents=((t2u, t2v), (t3u, t3v)),
            turns=tuple(turns),
        )

    def _own_jacobian(self, q: FloatArray) -> FloatArray:
        """Jacobian from joint velocities to the ball's (v, ω), in the axes of its joint, shape (6, 5)."""
        return np.array(pin.computeJointJacobian(self.model, self.model.createData(), q, self.ball))

    def project(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """State with velocities projected onto the rows, orthogonally in the mass metric (Blajer 2002)."""
        return q, np.array(pin.impulseDynamics(self.model, data, v, self._only_rows(data, q, v)))

    def _own_bias(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Acceleration of centre and spin at zero joint acceleration, in the joint's axes, shape (6,).

        Leaves kinematics, mass matrix and bias forces in ``data``.
        """
        pin.forwardKinematics(self.model, data, q, v, self._rest)
        pin.crba(self.model, data, q)
        pin.nonLinearEffects(self.model, data, q, v)
        return pin.getClassicalAcceleration(self.model, data, self.ball, pin.LOCAL).vector  # type: ignore[no-any-return]  # it is an array

    def _only_rows(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Constraint rows alone; leaves the mass matrix in ``data``."""
        if self._own is None:
            return self.rows(data, q, v).rows
        pin.crba(self.model, data, q)
        return self._own.rows

    def _accelerate_along(self, terms: _AlongAxes, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Result of :meth:`accelerate`, from constant terms along the ball's axes."""
        drift = terms.directions.dot(self._own_bias(data, q, v))
        # a ω × ė1 with ė1 = Ω × e1, where Ω is the carriage's angular velocity
        rate_1, rate_2, spin, _, _ = v.tolist()
        (x1, y1), (x2, y2), (x3, y3) = terms.turns
        lever = self._radius * (spin + x1 * rate_1 + y1 * rate_2)
        along2, along3 = drift.tolist()  # adding to array elements takes three times as long
        drift[0] = along2 + lever * (x2 * rate_1 + y2 * rate_2)
        drift[1] = along3 + lever * (x3 * rate_1 + y3 * rate_2)
        torque = self._rest
        if self._f:
            (x2, y2), (x3, y3) = terms.tangents
            v2, v3 = x2 * rate_1 + y2 * rate_2, x3 * rate_1 + y3 * rate_2
            speed = math.hypot(v2, v3)
            lever = self._f * self._pressing(data) / speed if speed else 0.0
            torque = terms.by_moment.dot(np.array((0.0, -lever * v3, lever * v2)))
        return pin.forwardDynamics(self.model, data, torque, terms.rows, drift)  # type: ignore[no-any-return]  # it is an array

    def _transmitted(self, data: Any, e1: FloatArray) -> float:
        """Normal force N [N] from the wrench in the spherical joint that Pinocchio's last pass left in ``data``."""
        return -float(e1.dot(data.oMi[self.ball].rotation.dot(data.f[self.ball].linear)))

    def accelerate(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """Joint acceleration without slip, shape (nv,), overwritten by the next call; the multipliers are F2, F3."""
        if self._own is not None:
            return self._accelerate_along(self._own, data, q, v)
        frame, rows, drift, torque = self.rows(data, q, v)
        if self._f:
            # The joints cannot accelerate the ball along e1, so N follows from the bias alone.
            torque = torque * self._transmitted(data, frame[:, 0])
        return pin.forwardDynamics(self.model, data, torque, rows, drift)  # type: ignore[no-any-return]  # it is an array

    def _pressing(self, data: Any) -> float:
        """Normal force N [N] from the bias forces in ``data``, with the ball's axes along e1, e2, e3."""
        if data is not self._read:
            # A view of Pinocchio's memory, looked up once: the look-up takes as long as the dynamics.
            self._read, self._wrench = data, data.f[self.ball].linear
        return -self._wrench.item(0)

    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration without slip, shape (nv,), and wall force on the ball [N], world axes, shape (3,).

        N comes from the joint's wrench, F2 and F3 from the multipliers.
        """
        acceleration, friction = np.array(self.accelerate(data, q, v)), np.array(data.lambda_c)
        frame = data.oMi[self._carriage].rotation @ self._frame0
        pin.rnea(self.model, data, q, v, acceleration)
        return acceleration, frame @ np.array([-self._transmitted(data, frame[:, 0]), *friction])


def _slip_directions(a: float, frame: FloatArray) -> FloatArray:
    """Matrix from (v, ω) to the slip velocity along e2 and e3 of a ball of radius a [m], shape (2, 6).

    Slip is v + a ω × e1, so its components are e2·v + a e3·ω and e3·v - a e2·ω.
    """
    _, (x2, y2, z2), (x3, y3, z3) = frame.T.tolist()
    return np.array([[x2, y2, z2, a * x3, a * y3, a * z3], [x3, y3, z3, -a * x2, -a * y2, -a * z2]])


def _cross(x: Sequence[float], y: Sequence[float]) -> tuple[float, float, float]:
    (x0, x1, x2), (y0, y1, y2) = x, y
    return x1 * y2 - x2 * y1, x2 * y0 - x0 * y2, x0 * y1 - x1 * y0
