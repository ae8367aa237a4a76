"""Minimal coordinates: distance from the surface, its two coordinates, and the spin in the local frame.

Lagrange's equations of the translation and Euler's equation of an isotropic body in a frame that turns with the
surface; the wall is one constraint on a coordinate and rolling two rows that are linear in the velocities with
constant coefficients. This tests Exudyn's integration of a system with multipliers, not its bodies or joints.
"""

import math
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample, terms_held
from proofroll.engines.exudyn.ball.friction import KineticFriction, Touch, needed_function
from proofroll.engines.exudyn.ball.generic_forces import SIZE, base, force_function, weight_function, weight_turns
from proofroll.engines.exudyn.ball.local_frame import local_geometry
from proofroll.engines.exudyn.ball.stick_slip import SwitchedIntegration
from proofroll.engines.exudyn.integration import BallRun, Integration, initial_matrices
from proofroll.engines.exudyn.native import exu, items
from proofroll.engines.exudyn.settings import ExudynSettings


class Generic(BallRun):
    """An ``ObjectGenericODE2`` with velocity-level constraints."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises; raises Refused if the surface is not homogeneous."""
        self._body = body
        self.local = local_geometry(body.surface, body.u0)
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
        self.friction = KineticFriction(body.contact.mu_kinetic) if math.isfinite(body.contact.mu_static) else None
        mass = np.diag([m, 0.0, 0.0, J, J, J])
        mass[1:3, 1:3] = m * self.local.tangents.T @ self.local.tangents
        self.object = self.system.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=[node], massMatrix=mass, forceUserFunction=force_function(body, self.local, self.friction)
            )
        )
        self.rolling = self._constrain(node, body.ball.radius)
        self.system.Assemble()
        self._gravity, self._resistance, self._mu_kinetic = self._probe(settings)
        if self.friction is None:
            self.integration = Integration(self.system, settings)
        else:
            # True if the contact forces depend on the coordinates, False if on their rates alone.
            self.place_matters = weight_turns(body, self.local)
            self._needed, self._local_gravity = needed_function(body), weight_function(body, self.local, np.eye(3))
            self._steady_gravity = None if self.place_matters else self._local_gravity([])[:3]
            self._tangents: tuple[float, ...] = tuple(self.local.tangents[1:].ravel().tolist())
            self.integration = SwitchedIntegration(self, body, settings)

    def _probe(self, settings: ExudynSettings) -> tuple[FloatArray, float | None, float | None]:
        """Gravity in the world [m/s²], f [m] and μk [1], from the forces that Exudyn computes without spin."""
        data, initial = self.system.systemData, exu.ConfigurationType.Initial
        q, q_t = data.GetODE2Coordinates(initial), data.GetODE2Coordinates_t(initial)
        # Without spin, the only moment is that of the rolling resistance, and the force along the distance is N.
        moving = np.array([0.0, *(q_t[1:3] if np.any(q_t[1:3]) else (1.0, 1.0)), 0.0, 0.0, 0.0])

        def forces(rates: FloatArray) -> tuple[float, FloatArray, FloatArray, FloatArray]:
            """Mass, force and moment in the local frame at these rates, and the force that kinetic friction adds."""
            data.SetODE2Coordinates_t(rates, initial)
            mass, _, rolling = initial_matrices(self.system, settings)
            slipping = rolling
            if self.friction is not None:
                self.friction.direction = 0.6, 0.8
                slipping = initial_matrices(self.system, settings)[2]
                self.friction.direction = None
            to_force = np.linalg.inv(base(self.local)).T
            return mass[0, 0], to_force @ rolling[:3], rolling[3:], to_force @ (slipping - rolling)[:3]

        mass, weight, _, _ = forces(np.zeros(SIZE))
        _, press, moment, friction = forces(moving)
        data.SetODE2Coordinates_t(q_t, initial)
        N = abs(float(press[0]))
        f, mu = (float(np.linalg.norm(x)) / N if N > 0 else None for x in (moment, friction))
        return self._body.surface.frame(q[1:3]) @ weight / mass, f, None if self.friction is None else mu

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
        """See :class:`proofroll.core.engine.Engine`.

        The spin is a quasi-velocity, so there is no orientation. While the ball slips, N is the wall's multiplier and
        the friction is the force that Exudyn was given for this state.
        """
        data = self.system.systemData
        q, q_t, multipliers = data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetAECoordinates()
        frame = self._body.surface.frame(q[1:3])
        velocity = self.local.tangents @ q_t[1:3] + np.array([q_t[0], 0.0, 0.0])
        force = -multipliers
        if self.friction is not None and self.friction.applied is not None:
            force[1:] = self.friction.force(self.friction.applied, self.touch(q, q_t).N)
        return BallSample(
            p_WB=self._body.surface.position(q[1:3]) + q[0] * frame[:, 0],
            v_WB=frame @ velocity,
            w_WB=frame @ q_t[3:],
            force=frame @ force,
            sticking=None if self.friction is None else self.friction.applied is None,
        )

    def needed(self, q: FloatArray, q_t: FloatArray) -> tuple[float, float, float]:
        """Normal force, and friction along e2 and e3 needed to keep the slip velocity [N]; see :class:`Touch`."""
        _, rate1, rate2, w1, _, _ = q_t.tolist()
        t2u, t2v, t3u, t3v = self._tangents
        g1, g2, g3 = self._steady_gravity or self._local_gravity(q)[:3]
        return self._needed(t2u * rate1 + t2v * rate2, t3u * rate1 + t3v * rate2, w1, g1, g2, g3)

    def touch(self, q: FloatArray, q_t: FloatArray) -> Touch:
        """Contact forces and slip at these coordinates and rates."""
        _, rate1, rate2, _, w2, w3 = q_t.tolist()
        (t2u, t2v, t3u, t3v), radius = self._tangents, self._body.ball.radius
        slip2 = t2u * rate1 + t2v * rate2 + radius * w3
        slip3 = t3u * rate1 + t3v * rate2 - radius * w2
        return Touch(*self.needed(q, q_t), slip2, slip3)

    def hold(self, direction: tuple[float, float] | None) -> None:
        """Switches to slip along the unit ``direction`` (e2, e3), or to rolling for None."""
        assert self.friction is not None
        if (direction is None) != (self.friction.direction is None):
            self.system.SetObjectParameter(self.rolling, "activeConnector", direction is None)
        self.friction.direction = direction

    def reached(self) -> None:
        """Records that the present state was computed with the present direction of slip."""
        assert self.friction is not None
        self.friction.applied = self.friction.direction

    def without_slip(self, q_t: FloatArray) -> FloatArray:
        """Rates after the impulse of the rolling constraint that ends the slip, by Exudyn's mass matrix."""
        rows = self._rows()
        by_impulse = np.linalg.solve(self._mass_matrix(), rows.T)
        return np.asarray(q_t - by_impulse @ np.linalg.solve(rows @ by_impulse, rows @ q_t))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`. Gravity, f and μk stem from the forces Exudyn computed."""
        mass, data = self._mass_matrix(), self.system.systemData
        slips = isinstance(self.integration, SwitchedIntegration)
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
            mu_static=self.integration.mu_static if slips else None,
            mu_kinetic=self._mu_kinetic,
            gap=-float(q[0]),
            acceleration=frame @ acceleration,
            angular_acceleration=frame @ angular_acceleration,
            terms=terms_held(resists=self._resistance, slips=slips),
        )
