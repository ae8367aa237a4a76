"""A rigid ball in contact with a hollow sphere that follows it: Exudyn's penalty contact with regularised friction.

Exudyn has no contact between a ball and a curved wall, but one between a ball and the inside of a sphere
(``ObjectContactSphereSphere``). The hollow sphere is moved along before every Newton residual so that it touches the
wall where the ball does; then its normal and its distance are those of the wall. Its friction is proportional to the
slip velocity up to ``friction_zone`` and constant beyond, so that a ball that sticks creeps.
"""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.engine import Regularised
from proofroll.core.errors import Refused
from proofroll.elements.ball_on_surface.mechanics import natural_acceleration, newton_euler
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample
from proofroll.engines.exudyn.ball.ball import add_ball
from proofroll.engines.exudyn.ball.local_frame import curvature
from proofroll.engines.exudyn.contact.hollow_spheres import ON_A_PLANE
from proofroll.engines.exudyn.integration import ExudynModel, Integration
from proofroll.engines.exudyn.native import Output, items
from proofroll.engines.exudyn.settings import ExudynSettings

# Slip speed, in units of ``friction_zone``, from which the ball counts as slipping: time steps throw the slip velocity
# to and fro across the edge of the zone itself.
SURELY = 2.0
# Looked up once: the functions that Exudyn calls use them at every iterate and step.
POSITION, COORDINATES = Output.Position, Output.Coordinates
# What double precision leaves of any quantity, relative to its scale.
ROUND_OFF = 1e-12


class PenaltyContact(ExudynModel):
    """A rigid ball and one ``ObjectContactSphereSphere`` with a hollow sphere; needs no generators of the surface."""

    def __init__(self, body: RollingBall, settings: ExudynSettings) -> None:
        """Builds and initialises; raises Refused if nothing presses the ball, or rolling needs more than the grip."""
        stiffness, self.zone, mu = settings.penalty
        e1 = body.surface.normal(body.p0)
        force = newton_euler(body, body.p0, body.v0, body.w0)[2]
        N = float(-force @ e1)
        if N <= 0:
            raise Refused("nothing presses the ball against the wall at time 0, so its contact is not closed")
        friction = force + N * e1
        # At this slip velocity the softened friction is the one that rolling needs, from time 0 on.
        needed = float(np.linalg.norm(friction))
        if needed > mu * N:
            raise Refused("rolling needs more friction than grip at time 0; use a larger grip")
        creep = -self.zone * friction / (mu * N)
        sunk = N / stiffness
        if sunk >= body.ball.radius:
            raise Refused(f"the load presses the ball {sunk:.3g} m into so soft a wall; use a larger stiffness")
        super().__init__()
        self.ball = add_ball(self.system, body, body.w0 + np.cross(e1, creep) / body.ball.radius)
        radius = body.ball.radius
        hollow = _hollow_radius(body)
        ground = self.system.AddObject(items.ObjectGround())
        self.follower = self.system.AddMarker(
            items.MarkerBodyRigid(bodyNumber=ground, localPosition=_centre(body, hollow - radius))
        )
        self.data = self.system.AddNode(
            items.NodeGenericData(
                initialCoordinates=[-sunk, float(np.linalg.norm(creep)), 0.0, 0.0],
                numberOfDataCoordinates=4,
            )
        )
        self.contact = self.system.AddObject(
            items.ObjectContactSphereSphere(
                markerNumbers=[self.ball.marker, self.follower],
                nodeNumber=self.data,
                # Ball and hollow sphere overlap by the depth of the first normal force, half of it each, so that at
                # time 0 the ball is where the scene puts it.
                spheresRadii=[radius + sunk / 2, hollow - sunk / 2],
                isHollowSphere1=True,
                dynamicFriction=mu,
                frictionProportionalZone=self.zone,
                contactStiffness=stiffness,
            )
        )
        self.system.SetPreNewtonResidualUserFunction(
            _follower(self.system, self.ball.node, self.follower, body.surface.nearby, hollow - radius)
        )
        self.system.Assemble()
        self._start = body, settings, creep, N, mu, hollow
        self._t = 0.0
        self.system.SetPostStepUserFunction(self._watch)
        self.integration = Integration(self.system, settings)

    def _watch(self, system: Any, t: float) -> bool:
        """Ends a run that leaves the model; Exudyn calls it after each step and once at the start. False ends it."""
        if t <= self._t:
            return True
        self._t = t
        gap, speed, _, _ = system.GetNodeOutput(self.data, COORDINATES).tolist()
        if gap > 0:
            self.integration.complaint = "the ball leaves the wall"
        elif speed > SURELY * self.zone:
            self.integration.complaint = "the ball slips, as rolling needs more friction than grip (use a larger grip),"
        return self.integration.complaint is None

    def sample(self) -> BallSample:
        """See :class:`proofroll.core.engine.Engine`. The force is that of the contact."""
        return self.ball.sample(self.system.GetObjectOutput(self.contact, Output.Force))

    def built(self) -> BallBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        contact = self.system.GetObject(self.contact)
        gap = float(self.system.GetObjectOutput(self.contact, Output.DisplacementLocal))
        built = self.ball.built(float(contact["spheresRadii"][0] + gap / 2), gap)
        mu = float(contact["dynamicFriction"])
        return dataclasses.replace(built, mu_static=mu, mu_kinetic=mu, regularised=_softened(*self._start))


def _follower(
    system: Any, node: Any, marker: Any, nearby: Callable[..., tuple[float, ...]], distance: float
) -> Callable[..., None]:
    """User function that moves the hollow sphere to touch the wall where the ball does, see :func:`_centre`.

    Exudyn calls it for every residual, so its own functions are looked up once.
    """
    output, move = system.GetNodeOutput, system.SetMarkerParameter

    def follow(system: Any, t: float, newton_iteration: int, discontinuous_iteration: int) -> None:  # noqa: ARG001 -- Exudyn's signature
        x, y, z = output(node, POSITION).tolist()
        gap, e1x, e1y, e1z = nearby(x, y, z)
        back = gap - distance
        move(marker, "localPosition", [x + back * e1x, y + back * e1y, z + back * e1z])

    return follow


def _hollow_radius(body: RollingBall) -> float:
    """Inner radius of the hollow sphere [m]: that of the wall's largest curvature at the start, or ``ON_A_PLANE``."""
    most = float(np.linalg.eigvalsh(curvature(body.surface, body.u0))[-1])
    return body.ball.radius * ON_A_PLANE if most <= 0 else body.ball.radius + 1 / most


def _softened(
    body: RollingBall, settings: ExudynSettings, creep: FloatArray, press: float, mu: float, hollow: float
) -> dict[str, Regularised]:
    """Certificate tolerances at time 0 for creep, depth, bound of friction, and forces that magnify round-off.

    At time 0 the ball slips with ``creep`` [m/s] under the normal force ``press`` [N]. The contact has the coefficient
    ``mu`` [1] and a hollow sphere of radius ``hollow`` [m].
    """
    a, m, J = body.ball.radius, body.ball.mass, body.ball.inertia
    stiffness, zone, _ = settings.penalty
    spin, fall = float(np.linalg.norm(body.w0)), math.sqrt(a * float(np.linalg.norm(body.gravity)))
    speed = float(np.linalg.norm(body.v0)) or fall or 1.0  # what the certificate measures speeds by
    slip = float(np.linalg.norm(creep))
    crept = "friction is proportional to the slip velocity, so the ball creeps in order to be held"
    # Some roundings of the distance between the centres, and of the velocity at the contact.
    ulp = 8 * float(np.finfo(float).eps)
    distance = ulp * (hollow + float(np.linalg.norm(body.p0)))
    N = stiffness * distance
    F = mu * press / zone * ulp * (speed + a * spin + slip) + N
    natural = natural_acceleration(body)
    stiff = "the stiff contact magnifies the round-off of distance and slip velocity"
    grips = "a finite bound stands for unbounded friction; a run that exceeds it is ended"
    return {
        "gap in the engine": Regularised(
            (press / stiffness + distance) / a + ROUND_OFF, "the contact presses as deep as the ball has sunk in"
        ),
        "slip": Regularised(1.000001 * slip / speed + ROUND_OFF, crept),
        "spin": Regularised(1.000001 * slip / a / max(spin, speed / a) + ROUND_OFF, crept),
        "N": Regularised(N / (m * natural) + ROUND_OFF, stiff),
        **{name: Regularised(F / (m * natural) + ROUND_OFF, stiff) for name in ("F2", "F3", "acceleration")},
        # The moment a F about the centre, over J.
        "angular acceleration": Regularised(m * a**2 / J * F / (m * natural) + ROUND_OFF, stiff),
        **{f"1 / {name} friction": Regularised(1 / mu + ROUND_OFF, grips) for name in ("static", "kinetic")},
    }


def _centre(body: RollingBall, distance: float) -> FloatArray:
    """Centre of the hollow sphere at time 0 [m], shape (3,), ``distance`` [m] from the centre of a touching ball."""
    gap, *e1 = body.surface.nearby(*body.p0.tolist())
    return np.asarray(body.p0 + (gap - distance) * np.array(e1))
