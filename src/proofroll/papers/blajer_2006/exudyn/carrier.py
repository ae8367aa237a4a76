"""A rigid ball held by a massless carrier whose only motions slide the wall along itself.

The carrier's joint with the ground frees turning about the cylinder's axis and sliding along it, and the ball turns
about a point of the carrier. Rolling is two constraints between rates of relative coordinates. Everything is a built-in
item of Exudyn; without rolling resistance no Python runs while it integrates. The carrier has no mass and no inertia at
all.
"""

from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.engines.exudyn.integration import ExudynModel, Integration
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample
from proofroll.papers.blajer_2006.exudyn.ball import add_ball, add_body


class RollingRow(NamedTuple):
    """One constraint of rolling, between a rate of the carrier and the spin of the ball relative to it.

    Attributes:
        item: number of the constraint in Exudyn.
        along: motion of the ball along e2 or e3 per unit of that coordinate [m/unit].
        axis: axis of the spin, in the world at time 0.
    """

    item: Any
    along: float
    axis: FloatArray


class Carrier(ExudynModel):
    """Ball, carrier, two ``GenericJoint`` and two ``CoordinateConstraint`` at velocity level."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises."""
        super().__init__()
        add_marker, add_object = self.system.AddMarker, self.system.AddObject
        self.ground = add_object(items.ObjectGround())
        self.ball = add_ball(self.system, body)
        frame, (turning, rise) = body.surface.frame(body.u0), body.udot0
        axis = frame[:, 2]
        self.velocity, self.spin = rise * axis, turning * axis
        self.node, self.carrier = add_body(self.system, 0.0, 0.0, np.zeros(3), self.velocity, self.spin)
        self.axes, self.constrained = frame, [1, 1, 0, 1, 1, 0]
        ends, transform = (self.ground, self.carrier), exu.HT(rotation=self.axes)
        guide = [add_marker(items.MarkerBodyRigid(bodyNumber=end, localHT=transform)) for end in ends]
        add_object(items.GenericJoint(markerNumbers=guide, constrainedAxes=self.constrained))
        # The carrier is not turned at time 0, so the ball's centre in it is its place in the world.
        self.centre, self.normal = body.p0, frame[:, 0]
        pivot = add_marker(items.MarkerBodyRigid(bodyNumber=self.carrier, localPosition=self.centre))
        self.joint = add_object(
            items.GenericJoint(markerNumbers=[pivot, self.ball.marker], constrainedAxes=[1, 1, 1, 0, 0, 0])
        )
        self.rolling = self._constrain(body, frame)
        self.system.Assemble()
        self.integration = Integration(self.system, settings, self._turning(body))

    def _constrain(self, body: RollingBall, frame: FloatArray) -> list[RollingRow]:
        """Adds rolling along e2 and e3: K u̇ ± a (spin of the ball relative to the carrier) = 0."""
        a, result = body.ball.radius, []
        around, along = items.MarkerBodiesRelativeRotationCoordinate, items.MarkerBodiesRelativeTranslationCoordinate
        # The ball is carried round on a radius longer by its own: the carrier turns it, too.
        for coordinate, way, about, sign in ((around, body.surface.radius + a, 2, 1.0), (along, 1.0, 1, -1.0)):
            rate = coordinate(bodyNumbers=[self.ground, self.carrier], axis0=frame[:, 2])
            spin = around(bodyNumbers=[self.carrier, self.ball.body], axis0=frame[:, about], localPosition0=self.centre)
            # Exudyn's constraint is factor1 value1 - value0 = 0.
            item = items.CoordinateConstraint(
                markerNumbers=[self.system.AddMarker(marker) for marker in (rate, spin)],
                factor1=-sign * a / way,
                velocityLevel=True,
            )
            result.append(RollingRow(self.system.AddObject(item), way, frame[:, about]))
        return result

    def _factor(self, row: RollingRow) -> float:
        """Factor of the spin in a rolling constraint, as Exudyn holds it."""
        return float(self.system.GetObject(row.item)["factor1"])

    def _turning(self, body: RollingBall) -> dict[Any, FloatArray]:
        """-Ċ q̇ of the rolling constraints: the axis e of the relative spin turns with the carrier, ė = ω × e."""
        relative = body.w0 - self.spin
        return {
            row.item: np.array([-self._factor(row) * relative @ cross(self.spin, row.axis)]) for row in self.rolling
        }

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. The pivot transmits the whole force of the wall."""
        turn = self.system.GetNodeOutput(self.node, Output.RotationMatrix).reshape(3, 3)
        return self.ball.sample(-turn @ self.system.GetObjectOutput(self.joint, Output.ForceLocal))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        row = self.rolling[1]
        # Distance of the ball's centre from its place in the carrier, whose axes are the world's at time 0.
        off = self.system.GetObjectOutput(self.joint, Output.DisplacementLocal)
        return self.ball.built(abs(self._factor(row) * row.along), -float(off @ self.normal))
