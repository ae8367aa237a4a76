"""Minimal coordinates: distance from the surface, its two coordinates, and the spin in the local frame.

Lagrange's equations of the translation and Euler's equation of an isotropic body in a frame that turns with the
surface; the wall is one constraint on a coordinate and rolling two rows that are linear in the velocities with
constant coefficients. This tests Exudyn's integration of a system with multipliers, not its bodies or joints.
"""

from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.exudyn.ball.generic_forces import SIZE, base, force_function
from proofroll.engines.exudyn.ball.local_frame import local_geometry
from proofroll.engines.exudyn.integration import ExudynModel, Integration, initial_matrices
from proofroll.engines.exudyn.native import exu, items
from proofroll.engines.exudyn.settings import ExudynSettings


class Generic(ExudynModel):
    """An ``ObjectGenericODE2`` with velocity-level constraints."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises; raises Refused if the surface is not homogeneous."""
        self._body = body
        self.local = local_geometry(body.surface)
        super().__init__()
        m, J = body.ball.mass, body.ball.inertia
        frame = body.surface.frame(body.u0)
        self._rates = [0.0, *body.udot0.tolist(), *(frame.T @ body.w0).tolist()]
        node = self.system.AddNode(
            items.NodeGenericODE2(
                referenceCoordinates=[0.0] * SIZE,
                initialCoordinates=[0.0, *body.u0, 0.0, 0.0, 0.0],
                initialCoordinates_t=self._rates,
                numberOfODE2Coordinates=SIZE,
            )
        )
        mass = np.diag([m, 0.0, 0.0, J, J, J])
        mass[1:3, 1:3] = m * self.local.tangents.T @ self.local.tangents
        self.object = self.system.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[node], massMatrix=mass, forceUserFunction=force_function(body, self.local)
            )
        )
        self.rolling = self._constrain(node, body.ball.radius)
        self.system.Assemble()
        self._gravity, self._resistance = self._probe(settings)
        self.integration = Integration(self.system, settings)

    def _probe(self, settings: ExudynSettings) -> tuple[FloatArray, float | None]:
        """Gravity in the world [m/s²] and f [m], from the forces that Exudyn computes without spin."""
        data, initial = self.system.systemData, exu.ConfigurationType.Initial
        q, q_t = data.GetODE2Coordinates(initial), data.GetODE2Coordinates_t(initial)
        # Without spin, the only moment is that of the rolling resistance, and the force along the distance is N.
        moving = np.array([0.0, *(q_t[1:3] if np.any(q_t[1:3]) else (1.0, 1.0)), 0.0, 0.0, 0.0])

        def forces(rates: FloatArray) -> tuple[float, FloatArray, FloatArray]:
            """Mass, force and moment in the local frame at these rates."""
            data.SetODE2Coordinates_t(rates, initial)
            mass, _, rolling = initial_matrices(self.system, settings)
            return mass[0, 0], np.linalg.inv(base(self.local)).T @ rolling[:3], rolling[3:]

        mass, weight, _ = forces(np.zeros(SIZE))
        _, press, moment = forces(moving)
        data.SetODE2Coordinates_t(q_t, initial)
        N = abs(float(press[0]))
        f = float(np.linalg.norm(moment)) / N if N > 0 else None
        return self._body.surface.frame(q[1:3]) @ weight / mass, f

    def _constrain(self, node: Any, radius: float) -> Any:
        """Adds the constraint of the wall, then those of rolling: the multipliers are N, -F2, -F3."""
        add_marker, add_object = self.system.AddMarker, self.system.AddObject
        ground = self.system.AddNode(items.NodePointGround())
        distance = [
            add_marker(items.MarkerNodeCoordinate(nodeNumber=number, coordinate=0)) for number in (ground, node)
        ]
        all_of = [add_marker(items.MarkerNodeCoordinates(nodeNumber=number)) for number in (ground, node)]
        add_object(items.CoordinateConstraint(markerNumbers=distance))
        # v + a ω × e1 = 0 along e2 and e3
        rows = np.zeros((2, SIZE))
        rows[:, 1:3] = self.local.tangents[1:]
        rows[0, 5], rows[1, 4] = radius, -radius
        return add_object(
            items.CoordinateVectorConstraint(markerNumbers=all_of, scalingMarker1=rows, velocityLevel=True)
        )

    def _mass_matrix(self) -> FloatArray:
        """Mass matrix as Exudyn holds it."""
        return np.array(self.system.GetObject(self.object)["massMatrix"].Convert2DenseMatrix())

    def _rows(self) -> FloatArray:
        """Rows of rolling on the rates, as Exudyn holds them."""
        return np.array(self.system.GetObject(self.rolling)["scalingMarker1"])

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. The spin is a quasi-velocity, so there is no orientation."""
        data = self.system.systemData
        q, q_t, multipliers = data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetAECoordinates()
        frame = self._body.surface.frame(q[1:3])
        velocity = self.local.tangents @ q_t[1:3] + np.array([q_t[0], 0.0, 0.0])
        return BallSample(
            p_WB=self._body.surface.position(q[1:3]) + q[0] * frame[:, 0],
            v_WB=frame @ velocity,
            w_WB=frame @ q_t[3:],
            force=frame @ -multipliers,
        )

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`. Gravity and f stem from the forces Exudyn computed."""
        mass, data = self._mass_matrix(), self.system.systemData
        q, q_t, q_tt = data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetODE2Coordinates_tt()
        tangents, frame = self.local.tangents, self._body.surface.frame(q[1:3])
        acceleration = tangents @ q_tt[1:3] + np.einsum("ijk,j,k->i", self.local.second, q_t[1:3], q_t[1:3])
        acceleration[0] += q_tt[0]
        # The spin is given in a frame that turns.
        angular_acceleration = q_tt[3:] + np.cross(self.local.turn @ q_t[1:3], q_t[3:])
        return BallBuilt(
            mass=float(mass[0, 0]),
            inertia=np.diag(mass)[3:],
            gravity=self._gravity,
            ball_radius=float(self._rows()[0, 5]),
            rolling_resistance=self._resistance,
            gap=-float(q[0]),
            acceleration=frame @ acceleration,
            angular_acceleration=frame @ angular_acceleration,
            terms=terms_held(resists=self._resistance),
        )
