"""Ball, weight and rolling resistance, shared by the formulations with a rigid body."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.engines.exudyn.native import Output, add_rigid_body, items, loads, rigid_body
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample, terms_held

# Speed, in units of sqrt(a g), below which the moment of rolling resistance falls to zero with the speed: Newton's
# method fails at the jump of its direction at rest. It lets a ball roll too far by the square of this, 4e-6.
_SLOW = 2e-3


@dataclass(frozen=True)
class RigidBall:
    """Item numbers of one ball in an Exudyn system.

    Attributes:
        node: rigid-body node with Euler parameters; with the rotation-vector Lie-group node the same time step leaves
            one and a half times the error.
        body, weight: the rigid body and its weight.
        marker: at its centre.
        resistance: load with the moment of the rolling resistance, None where there is none.
    """

    system: Any
    node: Any
    body: Any
    weight: Any
    marker: Any
    resistance: Any

    def sample(self, force: FloatArray) -> BallSample:
        """State from the node, with the force of the wall on the ball [N]."""
        output = self.system.GetNodeOutput
        q_WB = output(self.node, Output.CoordinatesTotal)[3:]
        return BallSample(
            p_WB=output(self.node, Output.Position),
            v_WB=output(self.node, Output.Velocity),
            w_WB=output(self.node, Output.AngularVelocity),
            q_WB=q_WB / np.linalg.norm(q_WB),
            force=force,
        )

    def built(self, ball_radius: float | None, gap: float | None) -> BallBuilt:
        """Model read back from Exudyn, with the radius [m] and the gap [m], which the caller reads from its joint."""
        body = rigid_body(self.system, self.body)
        return BallBuilt(
            mass=body["mass"],
            inertia=np.array(body["inertia"][:3]),
            gravity=np.array(self.system.GetLoad(self.weight)["loadVector"]),
            ball_radius=ball_radius,
            rolling_resistance=(
                0.0 if self.resistance is None else float(self.system.GetLoad(self.resistance)["loadVector"][0])
            ),
            gap=gap,
            acceleration=self.system.GetNodeOutput(self.node, Output.Acceleration),
            angular_acceleration=self.system.GetNodeOutput(self.node, Output.AngularAcceleration),
            terms=terms_held(
                resists="TorqueVector" in loads(self.system),
                turns=self.system.GetNode(self.node)["nodeType"] == "RigidBodyEP",
            ),
        )


def add_body(system: Any, mass: float, inertia: float, p: FloatArray, v: FloatArray, w: FloatArray) -> tuple[Any, Any]:
    """Adds a rigid body in world axes at time 0: centre [m], velocity [m/s], angular velocity [rad/s].

    Returns:
        Its node and its body.
    """
    node = system.AddNode(
        items.NodeRigidBodyEP(
            referenceCoordinates=[*p, 1.0, 0.0, 0.0, 0.0],
            initialVelocities=[*v, 0.0, *(w / 2)],  # rates of the Euler parameters of a body in world axes
        )
    )
    body = add_rigid_body(system, mass, [inertia, inertia, inertia, 0.0, 0.0, 0.0], node)
    return node, body


def add_ball(system: Any, rolling: RollingBall, spin: FloatArray | None = None) -> RigidBall:
    """Adds the ball with its weight and any rolling resistance.

    ``spin`` is the initial angular velocity [rad/s]; by default the scene's.
    """
    ball, w0 = rolling.ball, rolling.w0 if spin is None else spin
    node, body = add_body(system, ball.mass, ball.inertia, rolling.p0, rolling.v0, w0)
    marker = system.AddMarker(items.MarkerBodyRigid(bodyNumber=body))
    weight = system.AddLoad(
        items.LoadMassProportional(
            markerNumber=system.AddMarker(items.MarkerBodyMass(bodyNumber=body)), loadVector=rolling.gravity
        )
    )
    resistance = None
    if rolling.contact.rolling_resistance:
        resistance = system.AddLoad(items.LoadTorqueVector(**resisting(rolling, marker, node)))
    return RigidBall(system=system, node=node, body=body, weight=weight, marker=marker, resistance=resistance)


def resisting(rolling: RollingBall, marker: Any, node: Any) -> dict[str, Any]:
    """Arguments of the load that applies rolling resistance at ``marker``; ``node`` is at the ball's centre."""
    return {
        "markerNumber": marker,
        # Holds f for the user function, not a moment; so it can be read back.
        "loadVector": [rolling.contact.rolling_resistance, 0.0, 0.0],
        "loadVectorUserFunction": _resistance(rolling, node),
    }


def _resistance(rolling: RollingBall, node: Any) -> Any:
    """Moment of the rolling resistance in the world [N m], as plain floats: it is called for every residual.

    N follows from the state: along e1 the centre accelerates by -v·(∂e1/∂p)v, so that
    N = m (v·(∂e1/∂p)v + e1·g). The last multiplier instead would lag by an iterate and make the moment ring with it.
    """
    triad = rolling.surface.triad
    (k22, k23), (_, k33) = curvature(rolling.surface, rolling.u0).tolist()
    twist = 2 * k23
    m, least = rolling.ball.mass, slow(rolling)
    gx, gy, gz = rolling.gravity.tolist()
    position, velocity = Output.Position, Output.Velocity

    def moment(system: Any, t: float, load: Any) -> list[float]:  # noqa: ARG001 -- Exudyn's signature
        output = system.GetNodeOutput
        x, y, z = output(node, position).tolist()
        vx, vy, vz = output(node, velocity).tolist()
        x1, y1, z1, x2, y2, z2, x3, y3, z3 = triad(x, y, z)
        v2, v3 = vx * x2 + vy * y2 + vz * z2, vx * x3 + vy * y3 + vz * z3
        speed = max(math.hypot(v2, v3), least)
        if not speed:
            return [0.0, 0.0, 0.0]
        # v·(∂e1/∂p)v, whose coefficients are the same everywhere
        turning = k22 * v2 * v2 + (twist * v2 + k33 * v3) * v3
        N = m * (turning + x1 * gx + y1 * gy + z1 * gz)
        # resistance_moment, written out to save the call
        factor = load[0] * N / speed
        M2, M3 = -factor * v3, factor * v2
        return [M2 * x2 + M3 * x3, M2 * y2 + M3 * y3, M2 * z2 + M3 * z3]

    return moment


def curvature(surface: UprightCylinder, u0: FloatArray) -> FloatArray:
    """∂e1/∂p along e2 and e3 in the local frame [1/m], symmetric, shape (2, 2); the same everywhere if homogeneous."""
    frame = surface.frame(u0)
    return np.asarray((frame.T @ surface.normal_gradient(surface.position(u0)) @ frame)[1:, 1:])


def slow(body: RollingBall) -> float:
    """Speed of the centre [m/s] below which the rolling resistance is proportional to it."""
    return _SLOW * math.sqrt(body.ball.radius * float(np.linalg.norm(body.gravity)))
