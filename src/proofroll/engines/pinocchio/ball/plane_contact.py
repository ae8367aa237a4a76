"""A ball, a plane that touches it, and Pinocchio's own frictional contact solver between the two.

The ball has a translation joint followed by a spherical joint. With a free-flyer joint the velocity of the centre would
have components in the ball's turning axes, and a step of semi-implicit Euler would multiply it by the square root of 1
+ (ω dt)², so that a fast ball blows up at any useful step.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pinocchio as pin

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.engines.pinocchio.contact.solver import LARGEST_FRICTION, solver_of


class PlaneContact:
    """Pinocchio's objects, and scratch memory for the pose of the plane.

    Attributes:
        model, data: pin.Model and pin.Data.
        ball: index of the joint that turns the ball.
        turned: rotation from the ball's axes to the world's: a view of Pinocchio's memory, as of its last call.
        q0, v0: joint configuration and velocity at time 0; the first three numbers are the ball's centre [m] and its
        velocity [m/s] in the world.
        inverse: inverse mass matrix, shape (6, 6); constant for a ball in these joints.
        axes: columns e2, -e3, -e1 of the plane where it was last posed; the last one points from the wall into the
            ball.
        point, point_data: Pinocchio's model and data of the contact.
        options: of the solver.
        friction: coefficient of the contact's cone, which stands for unbounded friction [1].
    """

    def __init__(self, body: RollingBall, kind: str, tolerance: float) -> None:
        """Takes the ``kind`` of solver, ``pgs`` or ``admm``, and its ``tolerance``."""
        self._radius = body.ball.radius
        self.model = pin.Model()
        self.model.gravity.linear = body.gravity
        carriage = self.model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "centre")
        self.ball = self.model.addJoint(carriage, pin.JointModelSpherical(), pin.SE3.Identity(), body.ball.name)
        inertia = pin.Inertia(body.ball.mass, np.zeros(3), body.ball.inertia * np.eye(3))
        self.model.appendBodyToJoint(self.ball, inertia, pin.SE3.Identity())
        self.data = self.model.createData()
        self.turned = self.data.oMi[self.ball].rotation
        self.q0 = np.concatenate([body.p0, [0.0, 0.0, 0.0, 1.0]])
        self.v0 = np.concatenate([body.v0, body.w0])
        # Pinocchio fills the upper triangle.
        inverse = np.triu(pin.computeMinverse(self.model, self.data, self.q0))
        self.inverse: FloatArray = inverse + np.triu(inverse, 1).T

        point = pin.PointContactConstraintModel(self.model, 0, pin.SE3.Identity(), self.ball, pin.SE3.Identity())
        self.models, self._datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
        self.models.append(pin.ConstraintModel(point))
        self._datas.append(self.models[0].createData())
        # References to the vectors' elements; extracting them again takes longer than solving for the impulse.
        self.point, self.point_data = self.models[0].extract(), self._datas[0].extract()
        # References to the placements in the contact; new ones would also take longer than solving.
        self._on_wall, self._on_ball = self.point.joint1_placement, self.point.joint2_placement
        self._from_centre, self._foot = np.zeros((3, 4)), np.zeros(3)  # axes and contact point, in the world
        self._entries, self.axes = self._from_centre.reshape(-1), self._from_centre[:, :3]
        self._solver, self.options, self._result = solver_of(kind, tolerance)
        self.point.setFriction(LARGEST_FRICTION[kind])
        self.friction = float(self.point.getFriction())

    def pose(self, place: Sequence[float], triad: Sequence[float]) -> FloatArray:
        """Poses the plane where a ball at ``place`` [m] touches; ``triad``: components of e1, e2, e3.

        Expects the joints' placements and Jacobians in ``data``.

        Returns:
            Jacobian from joint velocities to the velocity of the contact point along :attr:`axes`, shape (3, 6).
        """
        x, y, z = place
        x1, y1, z1, x2, y2, z2, x3, y3, z3 = triad
        a, entries, foot = self._radius, self._entries, self._foot
        ax, ay, az = a * x1, a * y1, a * z1
        entries[0], entries[1], entries[2], entries[3] = x2, -x3, -x1, ax
        entries[4], entries[5], entries[6], entries[7] = y2, -y3, -y1, ay
        entries[8], entries[9], entries[10], entries[11] = z2, -z3, -z1, az
        foot[0], foot[1], foot[2] = x + ax, y + ay, z + az
        self._on_wall.rotation, self._on_wall.translation = self.axes, foot
        on_ball = self.turned.T.dot(self._from_centre)
        self._on_ball.rotation, self._on_ball.translation = on_ball[:, :3], on_ball[:, 3]
        self.point.calc(self.model, self.data, self.point_data)
        return self.point.jacobian(self.model, self.data, self.point_data)  # type: ignore[no-any-return]  # it is an array

    def impulse(self, delassus: Any, free: FloatArray) -> FloatArray | None:
        """Impulse along the axes [N s], shape (3,), overwritten by the next call; None if the solver does not find it.

        ``delassus`` is the contact's pin.DelassusOperatorDense, ``free`` the velocity of the contact point without
        impulse [m/s], along the axes, shape (3,).
        """
        # No warm start: the result must not depend on samples taken in between.
        self._result.reset()
        if not self._solver.solve(delassus, free, self.models, self._datas, self.options, self._result):
            return None
        return self._result.retrieveConstraintImpulses()  # type: ignore[no-any-return]  # it is an array
