"""A rigid ball held by a massless carrier whose only motions slide the wall along itself.

The carrier's joint with the ground frees exactly the wall's two generators, and the ball turns about a point of the
carrier. Rolling is two constraints between rates of relative coordinates. Everything is a built-in item of Exudyn;
without rolling resistance no Python runs while it integrates. The carrier has no mass and no inertia at all.
"""

from typing import Any, NamedTuple

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample
from proofroll.elements.ball_on_surface.surfaces import Generator
from proofroll.engines.exudyn.ball.ball import add_ball, add_body
from proofroll.engines.exudyn.ball.local_frame import LocalGeometry, local_geometry
from proofroll.engines.exudyn.integration import BallRun, Integration
from proofroll.engines.exudyn.native import Output, exu, items
from proofroll.engines.exudyn.settings import ExudynSettings


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


class Carrier(BallRun):
    """Ball, carrier, two ``GenericJoint`` and two ``CoordinateConstraint`` at velocity level."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises; raises Refused if the generators do not fit one joint."""
        local = local_geometry(body.surface, body.u0)
        super().__init__()
        add_marker, add_object = self.system.AddMarker, self.system.AddObject
        self.ground = add_object(items.ObjectGround())
        self.ball = add_ball(self.system, body)
        rates = {kind: np.zeros(3) for kind in ("rotation", "translation")}
        for generator, rate in zip(local.generators, body.udot0, strict=True):
            rates[generator.kind] += rate * np.asarray(generator.axis)
        self.velocity, self.spin = rates["translation"], rates["rotation"]
        self.node, self.carrier = add_body(self.system, 0.0, 0.0, np.zeros(3), self.velocity, self.spin)
        self.axes, self.constrained = _joint_axes(local.generators)
        ends, transform = (self.ground, self.carrier), exu.HT(rotation=self.axes)
        guide = [add_marker(items.MarkerBodyRigid(bodyNumber=end, localHT=transform)) for end in ends]
        add_object(items.GenericJoint(markerNumbers=guide, constrainedAxes=self.constrained))
        # The carrier is not turned at time 0, so the ball's centre in it is its place in the world.
        self.centre, self.normal = body.p0, body.surface.frame(body.u0)[:, 0]
        pivot = add_marker(items.MarkerBodyRigid(bodyNumber=self.carrier, localPosition=self.centre))
        self.joint = add_object(
            items.GenericJoint(markerNumbers=[pivot, self.ball.marker], constrainedAxes=[1, 1, 1, 0, 0, 0])
        )
        self.rolling = self._constrain(body, local)
        self.system.Assemble()
        self.integration = Integration(self.system, settings, self._turning(body))

    def _constrain(self, body: RollingBall, local: LocalGeometry) -> list[RollingRow]:
        """Adds rolling along e2 and e3: K u̇ ± a (spin of the ball relative to the carrier) = 0.

        Raises:
            Refused: rolling along one direction involves both coordinates of the carrier.
        """
        frame, a = body.surface.frame(body.u0), body.ball.radius
        result = []
        for direction, about, sign in ((1, 2, 1.0), (2, 1, -1.0)):
            row = local.tangents[direction] + sign * a * local.turn[about]
            (columns,) = np.nonzero(np.abs(row) > 1e-12 * np.max(np.abs(row)))
            if len(columns) != 1:
                raise Refused("rolling along one direction needs both of the carrier's coordinates at once")
            k = int(columns[0])
            generator, axis = local.generators[k], frame[:, about]
            coordinate = getattr(items, f"MarkerBodiesRelative{generator.kind.capitalize()}Coordinate")
            rate = coordinate(bodyNumbers=[self.ground, self.carrier], axis0=generator.axis)
            spin = items.MarkerBodiesRelativeRotationCoordinate(
                bodyNumbers=[self.carrier, self.ball.body], axis0=axis, localPosition0=self.centre
            )
            # Exudyn's constraint is factor1 value1 - value0 = 0.
            item = items.CoordinateConstraint(
                markerNumbers=[self.system.AddMarker(marker) for marker in (rate, spin)],
                factor1=-sign * a / row[k],
                velocityLevel=True,
            )
            result.append(RollingRow(self.system.AddObject(item), float(row[k]), axis))
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


def _joint_axes(generators: tuple[Generator, Generator]) -> tuple[FloatArray, list[int]]:
    """Axes of the carrier's joint, as columns, and 1 for each translation and rotation that it locks.

    Raises:
        Refused: the generators are two rotations, or skew, so that no single joint frees them.
    """
    if all(generator.kind == "rotation" for generator in generators):
        raise Refused("one joint cannot guide the carrier about two axes")
    axis_1, axis_2 = (np.asarray(generator.axis) for generator in generators)
    parallel = bool(abs(axis_1 @ axis_2) > 1 - 1e-12)
    if not parallel and abs(axis_1 @ axis_2) > 1e-12:
        raise Refused("one joint cannot guide the carrier along skew axes")
    side = np.eye(3)[np.argmin(np.abs(axis_1))] if parallel else axis_2
    side = side - (side @ axis_1) * axis_1
    side = side / np.linalg.norm(side)
    axes = np.stack([np.cross(side, axis_1), side, axis_1], axis=-1)
    constrained = [1] * 6
    for generator, axis in zip(generators, (2, 2 if parallel else 1), strict=True):
        constrained[axis + (3 if generator.kind == "rotation" else 0)] = 0
    return axes, constrained
