"""Connections of a mechanism, and the rows of their holonomic constraints: all joints and loops are cut.

Poses and twists are 4 × 4 matrices: a pose [R r; 0 1] maps a point of a body to the world, a twist [ω× v; 0 0] maps a
point of the world to its velocity. A connection of body a (point a, axes A) with body b (point b, axes B), d from point
a to b, gives two kinds of rows:
* n·d = 0, two points do not separate along n, an axis of A;
* x·y = 0, an axis x of A and an axis y of B stay perpendicular.

Their rates are n·e and t·w, with e the velocity of b relative to a at point b, w the relative angular velocity, and t =
y × x. Both depend only on the difference of two twists, and so do the null spaces of joints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import cross
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.checks import Vector
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, rows_of
from proofroll.elements.mechanism.scene.rotations import Array

# ω @ SKEW: the nine elements of the matrix ω ×. 0.5 * elements @ SKEW.T: ω of the antisymmetric part of any matrix.
SKEW = np.array([[0.0, 0, 0, 0, 0, -1, 0, 1, 0], [0.0, 0, 1, 0, 0, 0, -1, 0, 0], [0.0, -1, 0, 1, 0, 0, 0, 0, 0]])


class Bodies(NamedTuple):
    """Motion of the bodies' centres of mass, the world last, (bodies + 1, …).

    Attributes:
        pose, inverse: [R r; 0 1] and its inverse; r from :attr:`Bodies.origin`.
        own: twist in the body's own axes, [ω× v; 0 0].
        twist: in world axes, at the origin.
        origin: reference point for positions, the mean of the bodies', so that distant bodies lose no digits.
    """

    pose: Array
    inverse: Array
    own: Array
    twist: Array
    origin: Array

    @property
    def rotation(self) -> Array:
        """Rotations without the world's, (bodies, 3, 3)."""
        return self.pose[:-1, :3, :3]

    @property
    def spin(self) -> Array:
        """Angular velocities in world axes, without the world's, (bodies, 3)."""
        return np.asarray(0.5 * self.twist[:-1, :3, :3].reshape(-1, 9) @ SKEW.T)


class Ends(NamedTuple):
    """Geometry and relative motion of connections, world axes, (connections, …).

    Attributes:
        A, B: axes as columns.
        place: position of point b, from the origin of :class:`Bodies`.
        d: vector from point a to b.
        relative: twist of b minus twist of a.
        e: velocity of b relative to a at point b.
    """

    A: Array
    B: Array
    place: Array
    d: Array
    relative: Array
    e: Array


class ConnectionRows(NamedTuple):
    """Constraint rows at one state, rows of points first, then of angles, (rows, …).

    Attributes:
        residual, rate: Φ and Φ̇.
        form: matrix from the relative twist to Φ̇, (rows, 16).
        force, torque: of a unit multiplier on body b at its point.
        x, y: axes of the rows of angles only.
        twist: relative twist that gives this row the rate 1 and other rows of the closed connection the rate 0, (rows,
            16).
    """

    residual: Array
    rate: Array
    form: Array
    force: Array
    torque: Array
    x: Array
    y: Array
    twist: Array


class ProjectedConnections:
    """All joints, then all loops, of a mechanism.

    Attributes:
        a, b: indices of the bodies of each connection; the world is the last body.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        count, index = len(mechanism.bodies), mechanism.body_index
        com = np.array([*(body.com for body in mechanism.bodies), (0.0, 0.0, 0.0)])
        self._kinds = [item.kind for item in mechanism.connections]
        self._lengths = [item.length for item in mechanism.connections]
        cut = mechanism.connections
        self.a = np.array([index[item.a] % (count + 1) for item in cut], dtype=np.intp)
        self.b = np.array([index[item.b] % (count + 1) for item in cut], dtype=np.intp)
        self.at_a = _frames([item.frame_a for item in cut], [item.position_a for item in cut], com[self.a])
        self.at_b = _frames([item.frame_b for item in cut], [item.position_b for item in cut], com[self.b])

    def ends(self, bodies: Bodies, chosen: slice = slice(None)) -> Ends:
        """Positions, orientations and relative motion of the connections' ends."""
        a, b = self.a[chosen], self.b[chosen]
        of_a, of_b = bodies.pose[a] @ self.at_a[chosen], bodies.pose[b] @ self.at_b[chosen]
        relative, place = bodies.twist[b] - bodies.twist[a], of_b[:, :, 3:]
        e = (relative @ place)[:, :3, 0]
        return Ends(
            A=of_a[:, :3, :3],
            B=of_b[:, :3, :3],
            place=place[:, :3, 0],
            d=of_b[:, :3, 3] - of_a[:, :3, 3],
            relative=relative,
            e=e,
        )

    def constraints(self, chosen: slice = slice(None)) -> Constraints:
        """Constraint rows of some connections."""
        return Constraints(self._kinds[chosen], self._lengths[chosen])

    def on_bodies(self, bodies: Bodies, ends: Ends, owner: NDArray[np.intp], force: Array, torque: Array) -> Array:
        """Jacobian of rows for the velocities (v, ω in own axes) of all bodies, (rows, 6 bodies).

        ``force`` and ``torque``: of a unit multiplier on body b of the connection ``owner`` of each row.
        """
        number, count = np.arange(len(owner)), len(bodies.pose)
        C, place = np.zeros((len(owner), count, 6)), ends.place[owner]
        for body, sign in ((self.a[owner], -1.0), (self.b[owner], 1.0)):
            pose = bodies.pose[body]
            moment = cross(place - pose[:, :3, 3], force) + torque
            C[number, body, :3] += sign * force
            C[number, body, 3:] += sign * turned(pose[:, :3, :3].swapaxes(1, 2), moment)
        return C[:, :-1].reshape(len(owner), 6 * (count - 1))


def turned(R: Array, a: Array) -> Array:
    """Product of each matrix with its vector."""
    turned: Array = np.matmul(R, a[:, :, None])[:, :, 0]
    return turned


class Constraints:
    """Rows of connections of some kinds: first those of points, then those of angles.

    Attributes:
        owner: connection of each row.
        points: number of rows of points.
    """

    def __init__(self, kinds: list[str], lengths: list[float]) -> None:
        (self._point, self._axis), (self._angle, self._x, self._y) = rows_of(kinds)
        self.owner, self.points = np.concatenate([self._point, self._angle]), len(self._point)
        self._struts = np.flatnonzero([kinds[number] == DISTANCE for number in self._point])
        self._lengths = np.array(lengths)[self._point[self._struts]]
        self._sums = (self.owner == np.arange(len(kinds))[:, None]).astype(float)

    def at(self, ends: Ends) -> ConnectionRows:
        """Rows at one state."""
        i, j, points = self._point, self._angle, self.points
        n, x, y = ends.A[i, :, self._axis], ends.A[j, :, self._x], ends.B[j, :, self._y]
        strut = ends.d[i[self._struts]]
        n[self._struts] = strut / np.sqrt((strut * strut).sum(1))[:, None]
        t = cross(y, x)
        force, torque = np.zeros((2, len(self.owner), 3), dtype=n.dtype)
        force[:points], torque[points:] = n, t
        residual = np.concatenate([n * ends.d[i], x * y]).sum(1)
        residual[self._struts] -= self._lengths
        form = np.zeros((len(self.owner), 4, 4), dtype=n.dtype)
        form[:points, :3, :3] = n[:, :, None] * ends.place[i][:, None, :]
        form[:points, :3, 3] = n
        form[points:, :3, :3] = (0.5 * t @ SKEW).reshape(-1, 3, 3)
        twist = np.zeros_like(form)
        twist[:points, :3, 3], twist[points:, :3, :3] = n, 2 * form[points:, :3, :3]
        twist[points:, :3, 3] = -turned(twist[points:, :3, :3], ends.place[j])
        rate = (form * ends.relative[self.owner]).sum((1, 2))
        return ConnectionRows(
            residual=residual,
            rate=rate,
            form=form.reshape(-1, 16),
            force=force,
            torque=torque,
            x=x,
            y=y,
            twist=twist.reshape(-1, 16),
        )

    def bending(self, ends: Ends, rows: ConnectionRows) -> Array:
        """Φ̈ of a motion in which each relative twist is constant in body a."""
        points = self.points
        w = (ends.relative[:, :3, :3].reshape(-1, 9) @ SKEW.T) / 2
        turning = w[self._angle]
        of_points = (rows.force[:points] * cross(w, ends.e)[self._point]).sum(1)
        if len(self._struts):
            number = self._point[self._struts]
            e, strut = ends.e[number], ends.d[number]
            across = (e * e).sum(1) - (rows.force[self._struts] * e).sum(1) ** 2
            of_points[self._struts] += across / np.sqrt((strut * strut).sum(1))
        wx, wy = (turning * rows.x).sum(1), (turning * rows.y).sum(1)
        return np.concatenate([of_points, wx * wy - (turning * turning).sum(1) * rows.residual[points:]])

    def twists(self, rows: ConnectionRows, rates: Array) -> Array:
        """Relative twists that give the rows these rates, (…, rows) -> (…, connections, 16)."""
        return np.asarray(self._sums @ (rows.twist * rates[..., None]))


def _frames(axes: list[Array], places: list[Vector], com: Array) -> Array:
    """Pose (4x4) of each connection's end in its body's axes, relative to the centre of mass."""
    frames = np.zeros((len(axes), 4, 4))
    frames[:, :3, :3], frames[:, :3, 3], frames[:, 3, 3] = np.array(axes), np.array(places) - com, 1.0
    return frames
