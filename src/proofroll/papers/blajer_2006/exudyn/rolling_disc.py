"""The ball as a disc that always stands upright on the wall's tangent plane: Exudyn's joint for rolling discs.

``ObjectJointRollingDisc`` constrains the velocity of the contact point of a disc on a plane. Re-aiming the plane's
normal and the disc's axis before every Newton residual makes the disc's lowest point the ball's contact point.
"""

from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.engines.exudyn.integration import ExudynModel, Integration
from proofroll.engines.exudyn.native import Output, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample
from proofroll.papers.blajer_2006.exudyn.ball import add_ball


class RollingDisc(ExudynModel):
    """A rigid ball and one re-aimed ``ObjectJointRollingDisc``; needs no generators of the surface."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        super().__init__()
        ground = self.system.AddObject(items.ObjectGround())
        self.ball = add_ball(self.system, body)
        plane = self.system.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
        frame = body.surface.frame(body.u0)
        self.joint = self.system.AddObject(
            items.ObjectJointRollingDisc(
                markerNumbers=[plane, self.ball.marker],
                discRadius=body.ball.radius,
                discAxis=frame[:, 1],
                planeNormal=-frame[:, 0],
            )
        )
        self.system.SetPreNewtonResidualUserFunction(self._aiming(body))
        self.system.Assemble()
        # d/dt (v + a ω × e1) = v̇ + a ω̇ × e1 + a ω × ė1, in the directions of the joint's rows; the last term comes
        # from the re-aiming, which Exudyn does not differentiate.
        turning = body.ball.radius * np.cross(body.w0, body.surface.normal_gradient(body.p0) @ body.v0)
        self.integration = Integration(self.system, settings, {self.joint: -self._directions().T @ turning})

    def _aiming(self, body: RollingBall) -> Any:
        """User function that turns the joint to the wall's tangent plane at the ball; called at every iterate."""
        frame = body.surface.triad
        node, joint = self.ball.node, self.joint
        position, rotation = Output.Position, Output.RotationMatrix

        def aim(system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG001 -- Exudyn's signature
            x, y, z = system.GetNodeOutput(node, position).tolist()
            x1, y1, z1, x2, y2, z2, _, _, _ = frame(x, y, z)
            xx, xy, xz, yx, yy, yz, zx, zy, zz = system.GetNodeOutput(node, rotation).tolist()
            axis = [x2 * xx + y2 * yx + z2 * zx, x2 * xy + y2 * yy + z2 * zy, x2 * xz + y2 * yz + z2 * zz]
            system.SetObjectParameter(joint, "planeNormal", [-x1, -y1, -z1])
            system.SetObjectParameter(joint, "discAxis", axis)  # e2 in the ball's frame

        return aim

    def _directions(self) -> FloatArray:
        """Lateral, longitudinal and normal direction of the joint in the world, as columns."""
        return np.asarray(self.system.GetObjectOutput(self.joint, Output.RotationMatrix).reshape(3, 3))

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`."""
        return self.ball.sample(self._directions() @ self.system.GetObjectOutput(self.joint, Output.ForceLocal))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`. The joint holds velocities only and knows no distance."""
        return self.ball.built(self.system.GetObject(self.joint)["discRadius"], None)
