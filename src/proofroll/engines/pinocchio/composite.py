"""Formulation ``composite``: joints that follow the surface, so that the ball cannot leave it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.engines.pinocchio.mechanism import Mechanism, Sliding
from proofroll.engines.pinocchio.rows import (
    BallTerms,
    ball_terms,
    cross,
    own_terms,
    resistance,
    rolling_directions,
    rolling_rows,
)
from proofroll.errors import Refused
from proofroll.scene import RollingBall
from proofroll.surfaces import FloatArray, Generator


class Composite(Mechanism):
    """Two joints along the generators carry a massless carriage; a spherical joint in it carries the ball.

    Coordinates are (u1, u2, orientation of the ball in the carriage), velocities (u̇1, u̇2, spin relative to the
    carriage in the ball's axes). Two rows remain, those of rolling. The normal force is what the spherical joint
    transmits.

    Where the orientation is not integrated, the ball's axes stay the carriage's, which are e1, e2, e3: everything is
    taken from Pinocchio along these, and the directions of rolling are constant.
    """

    def __init__(self, body: RollingBall, orientation: bool) -> None:
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`.

        Raises:
            Refused: the surface has no generators.
        """
        generators = body.surface.generators
        if generators is None:
            raise Refused("composite joints need a surface that slides along itself; use formulation=free_flyer")
        super().__init__(body)
        self._orientation = orientation
        self._along_axes = rolling_directions(self._radius, np.eye(3).ravel().tolist())
        self._frame0 = body.surface.frame(np.zeros(2))
        self._carriage = 0
        for name, generator in zip(body.surface.coordinates, generators, strict=True):
            self._carriage = self.model.addJoint(self._carriage, _joint(generator), pin.SE3.Identity(), name)
        placement = pin.SE3(self._frame0, body.surface.position(np.zeros(2)))
        self._add_ball(body, self._carriage, pin.JointModelSpherical(), placement)

        data = self.model.createData()
        self.q0 = np.concatenate([body.u0, [0.0, 0.0, 0.0, 1.0]])
        if orientation:  # q_WB is the identity at time 0
            pin.forwardKinematics(self.model, data, self.q0)
            self.q0[2:] = pin.Quaternion(data.oMi[self.ball].rotation.T.copy()).coeffs()
        jacobian = ball_terms(self.model, data, self.ball, self.q0, self._rest, self._rest).jacobian
        self.v0 = np.linalg.lstsq(jacobian, np.concatenate([body.v0, body.w0]), rcond=None)[0]
        metres = np.asarray(body.surface.length_scales)
        self.q_scale = np.concatenate([self._radius / metres, np.ones(4)])
        self.v_scale = np.concatenate([self._speed / metres, np.full(3, self._speed / self._radius)])

    def _rows(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[BallTerms, FloatArray, FloatArray, FloatArray]:
        """Terms of the ball, local frame, rows and drift of rolling."""
        terms = ball_terms(self.model, data, self.ball, q, v, self._rest)
        frame = data.oMi[self._carriage].rotation.dot(self._frame0)
        turning = pin.getVelocity(self.model, data, self._carriage, pin.LOCAL_WORLD_ALIGNED).angular
        e1_rate = cross(turning.tolist(), frame[:, 0].tolist())
        return terms, frame, *rolling_rows(terms, self._radius, frame.T.ravel().tolist(), e1_rate)

    def _own_rows(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Rows and drift of rolling, and the ball's Jacobian, all along e1, e2, e3, which are the ball's axes."""
        jacobian, bias = own_terms(self.model, data, self.ball, q, v, self._rest)
        directions = self._along_axes
        drift = directions.dot(bias)
        # a ω × ė1 with ė1 = Ω × e1. The spin relative to the carriage is what ω has more than the carriage's Ω.
        w1, w2, w3 = data.v[self.ball].angular.tolist()
        _, _, _, spin2, spin3 = v.tolist()
        drift[0] += self._radius * w1 * (w2 - spin2)
        drift[1] += self._radius * w1 * (w3 - spin3)
        return directions.dot(jacobian), drift, jacobian

    def _only_rows(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        return (self._rows(data, q, v)[2]) if self._orientation else self._own_rows(data, q, v)[0]

    def _transmitted(self, data: Any, e1: FloatArray) -> float:
        """N [N] from the wrench in the spherical joint that the last pass of Pinocchio left in ``data``."""
        return -float(e1.dot(data.oMi[self.ball].rotation.dot(data.f[self.ball].linear)))

    def accelerate(self, data: Any, q: FloatArray, v: FloatArray) -> FloatArray:
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`; the multipliers are F2, F3."""
        torque = self._rest
        # The joints cannot accelerate the ball along e1, so N follows from the bias pass alone.
        if self._orientation:
            terms, frame, rows, drift = self._rows(data, q, v)
            if self._f:
                torque = resistance(terms, self._f, frame[:, 0]) * self._transmitted(data, frame[:, 0])
        else:
            rows, drift, jacobian = self._own_rows(data, q, v)
            if self._f:
                _, v2, v3 = data.v[self.ball].linear.tolist()
                speed = math.hypot(v2, v3)
                lever = self._f * self.normal_force(data) / speed if speed else 0.0
                torque = jacobian[3:].T.dot(np.array([0.0, -lever * v3, lever * v2]))
        return pin.forwardDynamics(self.model, data, torque, rows, drift)  # type: ignore[no-any-return]  # it is an array

    def normal_force(self, data: Any) -> float:
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`; forwardDynamics leaves the bias pass alone."""
        if not self._orientation:
            return -float(data.f[self.ball].linear[0])
        return self._transmitted(data, data.oMi[self._carriage].rotation.dot(self._frame0[:, 0]))

    def reaction(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Joint acceleration, and the wall's force: N from the joint's wrench, F2 and F3 from the multipliers."""
        acceleration, friction = self.respond(data, q, v)
        frame = data.oMi[self._carriage].rotation @ self._frame0
        pin.rnea(self.model, data, q, v, acceleration)
        return acceleration, frame @ np.array([-self._transmitted(data, frame[:, 0]), *friction])

    def slide(self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray) -> Sliding:
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`; the friction is put to the joints."""
        terms, frame, rows, drift = self._rows(data, q, v)
        e1, along = frame[:, 0], frame[:, 1:]
        # Friction along the wall cannot change N, no more than the joints can.
        normal_force = self._transmitted(data, e1)
        friction = self.friction(normal_force, along.T @ direction)
        torque = rows.T @ friction
        if self._f:
            torque += normal_force * resistance(terms, self._f, e1)
        acceleration = np.array(pin.aba(self.model, data, q, v, torque))
        slip_rate = along @ (rows @ acceleration + drift)
        return Sliding(acceleration, normal_force, along @ (rows @ v), slip_rate, along @ friction, e1)

    def sliding_reaction(
        self, data: Any, q: FloatArray, v: FloatArray, direction: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`; N from the joint's wrench."""
        sliding = self.slide(data, q, v, direction)
        pin.rnea(self.model, data, q, v, sliding.acceleration)
        force = sliding.friction - self._transmitted(data, sliding.e1) * sliding.e1
        return sliding.acceleration, np.asarray(force)

    def project_sliding(self, data: Any, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:  # noqa: ARG002 -- the protocol's
        """See :class:`~proofroll.engines.pinocchio.mechanism.Mechanism`: the joints hold the ball on the surface."""
        return q, v


def _joint(generator: Generator) -> Any:
    axis = np.asarray(generator.axis)
    if generator.kind == "rotation":
        return pin.JointModelRevoluteUnaligned(axis)
    return pin.JointModelPrismaticUnaligned(axis)
