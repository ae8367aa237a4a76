"""Applied forces of a mechanism on its dependent velocities: weight, gyroscopic moment, springs, and laws of joints."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.rotations import Array
from proofroll.engines.projection.connections import Bodies, Ends, ProjectedConnections, turned

_TURN = 2 * math.pi


class _Law(NamedTuple):
    """Spring, damper and drive of one coordinate of a joint; ``axis`` z (of A), x (of B) or slide (along z of A)."""

    connection: int
    axis: str
    stiffness: float
    rest: float
    damping: float
    drive: float


class Applied:
    """Applied forces on the bodies, without reactions."""

    def __init__(self, mechanism: Mechanism, connections: ProjectedConnections) -> None:
        self._connections = connections
        index, count = mechanism.body_index, len(mechanism.bodies)
        self._mass = np.array([body.mass for body in mechanism.bodies])
        self._inertia = np.array([body.inertia for body in mechanism.bodies])
        self._weight = self._mass[:, None] * np.array(mechanism.gravity)
        self._laws = [law for number, joint in enumerate(mechanism.joints) for law in _laws(number, joint)]
        start = ((law, mechanism.joints[law.connection].q0) for law in self._laws if law.stiffness)
        self._angles = {law: q0[1 if law.axis == "x" else 0] for law, q0 in start}
        self._balls = [
            (n, joint.damping)
            for n, joint in enumerate(mechanism.joints)
            if joint.kind == "spherical" and joint.damping
        ]
        com = np.array([*(body.com for body in mechanism.bodies), (0.0, 0.0, 0.0)])
        self._springs = [
            (spring, (a, np.array(spring.position_a) - com[a]), (b, np.array(spring.position_b) - com[b]))
            for spring in mechanism.springs
            for a, b in [(index[spring.body_a] % (count + 1), index[spring.body_b] % (count + 1))]
        ]

    def __call__(self, bodies: Bodies, w_own: Array, ends: Ends) -> Array:
        """Generalised forces, shape (6 bodies,); ``w_own`` are the angular velocities along the bodies' own axes."""
        forces = np.zeros((len(self._mass) + 1, 6))
        forces[:-1, :3] = self._weight
        forces[:-1, 3:] = cross(turned(self._inertia, w_own), w_own)
        for spring, end_a, end_b in self._springs:
            arms = [bodies.R[i] @ at for i, at in (end_a, end_b)]
            (a, _), (b, _) = end_a, end_b
            between = bodies.r[b] + arms[1] - bodies.r[a] - arms[0]
            length = math.sqrt(between @ between)
            pull = spring.stiffness * (length - spring.length)
            if spring.damping:
                rate = bodies.v[b] + cross(bodies.w[b], arms[1]) - bodies.v[a] - cross(bodies.w[a], arms[0])
                pull += spring.damping * (between @ rate) / length
            force = pull / length * between
            for i, arm, there in ((a, arms[0], force), (b, arms[1], -force)):
                forces[i, :3] += there
                forces[i, 3:] += cross(arm, there) @ bodies.R[i]
        found = forces[:-1].ravel()
        if self._laws or self._balls:
            force, torque = self.of_joints(bodies, ends)
            on = np.flatnonzero(force.any(1) | torque.any(1))
            n, t = force[on], torque[on]
            m_a, m_b = cross(ends.arm_a[on] + ends.d[on], n) + t, cross(ends.arm_b[on], n) + t
            found = found + self._connections.spread(bodies, on, n, m_a, m_b).sum(0)
        return found

    def of_joints(self, bodies: Bodies, ends: Ends) -> tuple[Array, Array]:
        """Forces and moments of the joints' own laws on body b at its point, world axes, (connections, 3) each."""
        force, torque = np.zeros_like(ends.d), np.zeros_like(ends.d)
        w = bodies.w[self._connections.b] - bodies.w[self._connections.a]
        for law in self._laws:
            c = law.connection
            direction = ends.B[c, :, 0] if law.axis == "x" else ends.A[c, :, 2]
            if law.axis == "slide":
                w_a = bodies.w[self._connections.a[c]]
                rate = direction @ (ends.d_rate[c] - cross(w_a, ends.d[c]))
            else:
                rate = direction @ w[c]
            size = law.drive - law.damping * rate
            if law.stiffness:
                size -= law.stiffness * (self._coordinate(law, ends) - law.rest)
            (force if law.axis == "slide" else torque)[c] += size * direction
        for c, damping in self._balls:
            torque[c] -= damping * w[c]
        return force, torque

    def _coordinate(self, law: _Law, ends: Ends) -> float:
        """Angle [rad], on the branch nearest to the last accepted one, or distance [m]."""
        A, B = ends.A[law.connection], ends.B[law.connection]
        if law.axis == "slide":
            return float(A[:, 2] @ ends.d[law.connection])
        if law.axis == "z":
            angle = math.atan2(B[:, 0] @ A[:, 1], B[:, 0] @ A[:, 0])
        else:
            angle = math.atan2(A[:, 2] @ B[:, 1], A[:, 2] @ B[:, 2])
        return angle + _TURN * round((self._angles[law] - angle) / _TURN)

    @property
    def remembers(self) -> bool:
        """True if forces depend on the number of turns of a joint."""
        return bool(self._angles)

    @property
    def gravity(self) -> Array:
        """Acceleration of gravity, from the weight of the heaviest body."""
        heaviest = int(np.argmax(self._mass))
        return np.array(self._weight[heaviest] / self._mass[heaviest])

    def accept(self, ends: Ends) -> None:
        """Remembers the angles of springs, so that they may turn more than once."""
        for law in self._angles:
            self._angles[law] = self._coordinate(law, ends)


def _laws(number: int, joint: Joint) -> list[_Law]:
    if not (joint.stiffness or joint.damping or joint.torque) or joint.kind == "spherical":
        return []
    axes = {"revolute": ("z",), "prismatic": ("slide",), "universal": ("z", "x")}[joint.kind]
    return [_Law(number, axis, joint.stiffness, joint.rest, joint.damping, joint.constant_drive) for axis in axes]
