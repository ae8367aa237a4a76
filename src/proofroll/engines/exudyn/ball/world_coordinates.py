"""``generic`` in world coordinates: for walls that no rigid motion slides along themselves.

Two mass points stand for the ball: one with its mass at its centre, one with its inertia, whose velocity is the angular
velocity (Euler's equation of a ball is J ω̇ = M). Rolling, v + a ω × e1 = 0, is a constraint on velocities
by user functions (``CoordinateVectorConstraint``); its component along e1 is the wall. As in :mod:`generic`, this tests
Exudyn's integration of a system with multipliers.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, cross
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.exudyn.ball.ball import resisting
from proofroll.engines.exudyn.integration import BallRun, Integration, initial_matrices
from proofroll.engines.exudyn.native import Output, items
from proofroll.engines.exudyn.settings import ExudynSettings


class WorldCoordinates(BallRun):
    """Two ``MassPoint`` and a ``CoordinateVectorConstraint`` with user functions; needs no generators of the wall."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises; raises Refused if friction is bounded."""
        if math.isfinite(body.contact.mu_static):
            raise Refused(
                "generic lets a ball slip only on a wall that slides along itself, in whose coordinates its friction "
                "is built; use contact"
            )
        super().__init__()
        add = self.system
        m, J = body.ball.mass, body.ball.inertia
        centre, spin = (
            add.AddNode(items.NodePoint(referenceCoordinates=p.tolist(), initialVelocities=v.tolist()))
            for p, v in ((body.p0, body.v0), (np.zeros(3), body.w0))
        )
        self._nodes = centre, spin
        self._objects = tuple(
            add.AddObject(items.MassPoint(mass=inertia, nodeNumber=node)) for inertia, node in ((m, centre), (J, spin))
        )
        marker = add.AddMarker(items.MarkerBodyMass(bodyNumber=self._objects[0]))
        self._weight = add.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=body.gravity.tolist()))
        self._resistance = None
        if body.contact.rolling_resistance:  # a moment is a force on the point whose velocity is ω
            turned = add.AddMarker(items.MarkerNodePosition(nodeNumber=spin))
            self._resistance = add.AddLoad(items.LoadForceVector(**resisting(body, turned, centre)))
        self._rolling = add.AddObject(
            items.CoordinateVectorConstraint(
                markerNumbers=[add.AddMarker(items.MarkerNodeCoordinates(nodeNumber=node)) for node in self._nodes],
                scalingMarker0=np.zeros((3, 1)),  # says how many rows there are
                velocityLevel=True,
                constraintUserFunction=_rolling(body),
                jacobianUserFunction=_along(body),
            )
        )
        self.system.Assemble()
        # Terms of the rows' derivative without p̈ and ω̇, which Exudyn does not compute.
        a, e1_rate = body.ball.radius, body.surface.normal_gradient(body.p0) @ body.v0
        turning = -a * cross(body.w0, e1_rate)
        # The block of ω in the rows is a times a matrix with the singular values 1, 1 and 0.
        _, jacobian, _ = initial_matrices(self.system, settings)
        self._radius = float(np.linalg.norm(jacobian[6:, 3:6])) / math.sqrt(2)
        self.integration = Integration(self.system, settings, {self._rolling: turning})

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. No orientation is integrated from the angular velocity."""
        output, (centre, spin) = self.system.GetNodeOutput, self._nodes
        return BallSample(
            p_WB=output(centre, Output.Position),
            v_WB=output(centre, Output.Velocity),
            w_WB=output(spin, Output.Velocity),
            force=-np.array(self.system.systemData.GetAECoordinates()),
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`. The constraint holds velocities only and knows no distance."""
        mass, inertia = (float(self.system.GetObject(item)["mass"]) for item in self._objects)
        f = 0.0 if self._resistance is None else float(self.system.GetLoad(self._resistance)["loadVector"][0])
        acceleration = self.system.systemData.GetODE2Coordinates_tt()
        return BallBuilt(
            mass=mass,
            inertia=np.full(3, inertia),
            gravity=np.array(self.system.GetLoad(self._weight)["loadVector"]),
            ball_radius=self._radius,
            rolling_resistance=f,
            gap=None,
            acceleration=acceleration[:3],
            angular_acceleration=acceleration[3:],
            terms=terms_held(resists=f),
        )


def _rolling(body: RollingBall) -> Callable[..., FloatArray]:
    """User function for the velocity of the ball at the contact [m/s]."""
    a, normal = body.ball.radius, body.surface.normal

    def constraint(_system: Any, _t: float, _item: int, q: Any, q_t: Any, _velocity_level: bool) -> FloatArray:
        p, rates = np.array(q)[:3], np.array(q_t)
        return rates[:3] + a * cross(rates[3:], normal(p))

    return constraint


def _along(body: RollingBall) -> Callable[..., FloatArray]:
    """User function for the rows' Jacobian with respect to the velocities v and ω: [1, -a [e1]×], shape (3, 6)."""
    a, nearby = body.ball.radius, body.surface.nearby

    def jacobian(_system: Any, _t: float, _item: int, q: Any, _q_t: Any, _velocity_level: bool) -> FloatArray:
        _, x, y, z = nearby(*np.array(q)[:3].tolist())
        return np.array(
            [[1, 0, 0, 0, a * z, -a * y], [0, 1, 0, -a * z, 0, a * x], [0, 0, 1, a * y, -a * x, 0]], dtype=np.float64
        )

    return jacobian
