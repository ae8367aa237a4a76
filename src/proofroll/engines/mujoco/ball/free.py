"""A free ball: on a plane that is re-posed tangent to the wall before each step, or in a ring of boxes."""

import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.mujoco.ball.contact import foreseen_normal_force
from proofroll.engines.mujoco.ball.formulation import Formulation
from proofroll.engines.mujoco.ball.model import pose, quaternion_of, tangent_plane
from proofroll.engines.mujoco.settings import MujocoSettings


class Free(Formulation):
    """Ball on a free joint; the wall is a mocap body, which MuJoCo treats as fixed.

    The plane stands for the wall only to first order: the contact rows lack J̇v (the turning of the normal).
    """

    def __init__(self, model: Any, body: RollingBall, settings: MujocoSettings) -> None:
        super().__init__(model, body, settings)
        self._radius = body.ball.radius
        self._wall = model.geom("wall").id
        self._curvature = settings.curvature
        self._half = settings.velocity_lag
        # MuJoCo's damping of a velocity half a step behind supplies part of -J̇v; this share of it is left to add.
        self._share = 1 - settings.own_share
        self._lead = settings.normal_lead

    @staticmethod
    def write(spec: Any, body: RollingBall) -> None:
        """Puts the ball at its start and the plane tangent to the wall there."""
        spec.body("ball").pos = body.p0
        pose(spec.body("wall"), *tangent_plane(body))

    def run(self, data: Any, steps: int) -> None:
        """Makes ``steps`` steps."""
        if not self._curvature:
            self._run_plainly(data, steps)
            return
        for _ in range(steps):
            motion = self._prepare(data)
            mujoco.mj_step1(self._model, data)
            self._add_curvature(data, *motion)
            mujoco.mj_step2(self._model, data)

    def _run_plainly(self, data: Any, steps: int) -> None:
        """Steps without edits of the contact, hence without lag: :meth:`_prepare` written out in plain floats.

        MuJoCo takes some microseconds for a step of this model, and numpy as long for an operation on three numbers.
        """
        model, nearby, radius = self._model, self._surface.nearby, self._radius
        position, rates, pushed = data.qpos[:3], data.qvel[:3], data.qfrc_constraint[:3]
        place, quaternion, facing = data.mocap_pos[0], data.mocap_quat[0], np.zeros(3)
        normal, torque = data.geom_xmat[self._wall, 2::3], data.xfrc_applied[self._ball, 3:]
        resists = self.resistance.f > 0
        for _ in range(steps):
            x, y, z = position.tolist()
            gap, e1x, e1y, e1z = nearby(x, y, z)
            reach = radius + gap
            place[0], place[1], place[2] = x + reach * e1x, y + reach * e1y, z + reach * e1z
            facing[0], facing[1], facing[2] = -e1x, -e1y, -e1z
            mujoco.mju_quatZ2Vec(quaternion, facing)
            if resists:
                N = foreseen_normal_force(data, float(pushed.dot(normal)))
                self.resistance.apply(torque, N, (e1x, e1y, e1z), rates.tolist())
            mujoco.mj_step(model, data)

    def evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, as a step would."""
        motion = self._prepare(data)
        if not self._curvature:
            mujoco.mj_forward(self._model, data)
            return
        mujoco.mj_fwdPosition(self._model, data)
        mujoco.mj_fwdVelocity(self._model, data)
        self._add_curvature(data, *motion)
        mujoco.mj_fwdActuation(self._model, data)
        mujoco.mj_fwdAcceleration(self._model, data)
        mujoco.mj_fwdConstraint(self._model, data)

    def _prepare(self, data: Any) -> tuple[FloatArray, FloatArray]:
        """Poses the plane and applies rolling resistance.

        Returns:
            Velocities at the time of the positions (m/s, rad/s), and accelerations of the evaluation before.
        """
        p = data.qpos[:3]
        e1 = self._surface.normal(p)
        rates: FloatArray = data.qvel
        normal = data.geom_xmat[self._wall, 2::3]  # still that of the step before, like qacc and qfrc_constraint
        trend = data.qacc.copy()
        if self._half:
            # Along the planes only: velocity and acceleration of the step before have parts across the present one.
            trend[:3] -= (trend[:3] @ normal) * normal
            rates = rates + self._half * trend
            rates[:3] -= (rates[:3] @ e1) * e1
        N = float(data.qfrc_constraint[:3] @ normal)
        data.mocap_pos[0] = p + (self._radius + self._surface.gap(p)) * e1
        mujoco.mju_quatZ2Vec(data.mocap_quat[0], -e1)
        if self.resistance.f:
            torque = data.xfrc_applied[self._ball, 3:]
            self.resistance.apply(torque, foreseen_normal_force(data, N), e1.tolist(), rates[:3].tolist())
        return rates, trend

    def _add_curvature(self, data: Any, rates: FloatArray, trend: FloatArray) -> None:
        """Adds -J̇v to the contact's reference acceleration, less what MuJoCo's damping already gives.

        Differentiating n·v = 0 (n = -e1) and t·(v + a ω × e1) = 0 leaves ė1·v and -a t·(ω × ė1) on the right.
        """
        if data.nefc == 0:
            return
        contact = data.contact[0]
        gradient = self._surface.normal_gradient(data.qpos[:3])
        e1_rate = gradient @ rates[:3]
        w = data.xmat[self._ball].reshape(3, 3) @ rates[3:]
        rows = contact.frame.reshape(3, 3) @ cross(w, e1_rate) * -self._radius
        v = rates[:3] + self._lead * trend[:3]
        rows[0] = v @ gradient @ v
        row = contact.efc_address
        data.efc_aref[row : row + contact.dim] += self._share * rows[: contact.dim]


class Facets(Formulation):
    """The ball on a free joint in a ring of boxes whose faces are tangent to the wall: the obvious concave wall."""

    def __init__(self, model: Any, body: RollingBall, settings: MujocoSettings) -> None:
        super().__init__(model, body, settings)
        wall = model.body("wall")
        axis = np.zeros(9)
        mujoco.mju_quat2Mat(axis, wall.quat)
        # The ring's axis is the body's third: the surface's second direction (``write``).
        self._axis = axis[2::3].copy()
        self._half_length = float(model.geom_size[wall.geomadr[0], 2])

    @staticmethod
    def write(spec: Any, body: RollingBall) -> None:
        """Turns the ring into the surface's axis and makes each face tangent to the wall.

        The file turns the boxes about the ring's axis (``replicate``); MuJoCo applies that to the poses given here.
        How many boxes there are, how thick and how long they are, is the file's.

        Raises:
            Refused: the ring is too short for the ball's way along its axis.
        """
        origin = np.zeros(2)
        frame = body.surface.frame(origin)
        face = frame.T @ body.wall.position(origin)
        spec.body("ball").pos = body.p0
        pose(spec.body("wall"), np.zeros(3), quaternion_of(frame))
        boxes = spec.body("wall").geoms
        half_length, reach = float(boxes[0].size[2]), _reach(body, frame[:, 2])
        if reach > half_length:
            raise Refused(
                f"the ring of boxes ends {half_length:g} m from its middle, and a ball that rolls would get "
                f"{reach:.3g} m far; lengthen the boxes in mujoco_facets.xml"
            )
        for box in boxes:
            thickness, _, height = box.size
            box.pos = face + np.array([thickness, 0.0, 0.0])
            box.size = [thickness, face[0] * math.tan(math.pi / len(boxes)), height]

    def run(self, data: Any, steps: int) -> None:
        """Makes ``steps`` steps."""
        if not self.resistance.f:
            mujoco.mj_step(self._model, data, nstep=steps)
        else:
            resist = self._resister(data)
            for _ in range(steps):
                resist()
                mujoco.mj_step(self._model, data)
        # Rolling resistance and kicks at the edges slow the ball, so it may fall further than ``_reach`` says.
        if abs(float(self._axis @ data.qpos[:3])) > self._half_length:
            raise Diverged(f"the ball has left the ring of boxes, which ends {self._half_length:g} m from its middle")

    def evaluate(self, data: Any) -> None:
        """Computes forces and accelerations of the present state, as a step would."""
        if self.resistance.f:
            self._resister(data)()
        mujoco.mj_forward(self._model, data)

    def _resister(self, data: Any) -> Callable[[], None]:
        nearby, apply = self._surface.nearby, self.resistance.apply
        position, rates, pushed = data.qpos[:3], data.qvel[:3], data.qfrc_constraint[:3]
        torque = data.xfrc_applied[self._ball, 3:]

        def resist() -> None:
            x, y, z = position.tolist()
            _, e1x, e1y, e1z = nearby(x, y, z)
            Fx, Fy, Fz = pushed.tolist()
            apply(torque, -(Fx * e1x + Fy * e1y + Fz * e1z), (e1x, e1y, e1z), rates.tolist())

        return resist


def _reach(body: RollingBall, axis: FloatArray) -> float:
    """Distance from the origin that a ball rolling without losses reaches along the axis of a cylinder [m].

    Rolling round at the constant rate Ω, it moves along the axis as an oscillator of ω² = r Ω² / (1 + r), r = J/(m a²),
    about the place where gravity and the torque of the initial spin about the normal balance.
    """
    r = body.ball.inertia_ratio
    turning = body.surface.normal_gradient(body.p0) @ body.v0
    rate = float(np.linalg.norm(turning))
    if rate == 0:
        return math.inf if axis @ body.gravity else 0.0
    speed, spin = float(axis @ body.v0), float(body.surface.normal(body.p0) @ body.w0)
    square = r / (1 + r) * rate**2
    middle = (abs(float(axis @ body.gravity)) + r * rate * body.ball.radius * abs(spin)) / (1 + r) / square
    return abs(float(axis @ body.p0)) + middle + math.hypot(middle, speed / math.sqrt(square))
