"""Newton–Euler equations of bodies in absolute coordinates, in long doubles; only data of a mechanism is read.

Every constraint is a product u·z: u is carried by one body or by the world, z leads from a point of a to a point of b
or is carried by b. Multipliers come from a pivoted Cholesky factor, which leaves out rows that depend on others.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.elements.mechanism import Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.signal import Formula

from .extrapolation import Long, extrapolated
from .linear_algebra import cross, inverse, long, of_quaternion, of_rpy, quaternion, semidefinite_solve, turn

_ONE = np.eye(3, dtype=np.longdouble)


def axes_of(joint: Joint) -> tuple[Long, Long, Long]:
    """Second axis, their cross product and axis of a joint in its child; any frame where it has none."""
    z = long(joint.axis) / np.sqrt((long(joint.axis) ** 2).sum())
    given = long(joint.second_axis) if joint.second_axis is not None else _ONE[int(np.argmin(np.abs(z)))]
    x = given - z * (z @ given)
    x = x / np.sqrt(x @ x)
    return x, cross(z, x), z


class System(NamedTuple):
    """Equations of the bodies at one state.

    Attributes:
        push, twist: force and moment on each body of a unit multiplier of each row, (rows, bodies, 3).
        bias: second rate of each row without accelerations.
        yields: compliance of each row per multiplier: one over an armature, 0 for others.
        of_push, of_twist: accelerations by a unit multiplier.
        a0, alpha0: accelerations without multipliers.
        inverse: of the inertias, world axes.
        given: wrenches of springs and drives of joints.
        broken: largest violation of a row and of its rate.
    """

    push: Long
    twist: Long
    bias: Long
    yields: Long
    of_push: Long
    of_twist: Long
    a0: Long
    alpha0: Long
    inverse: Long
    given: Long
    broken: Any


class Referee:
    """One mechanism without dry friction and massless bodies, from its start on."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, self.n = mechanism, len(mechanism.bodies)
        self._mass = long([body.mass for body in mechanism.bodies])
        self._com = long([*(body.com for body in mechanism.bodies), (0, 0, 0)])
        self._inertia = long([body.inertia for body in mechanism.bodies])
        self._inverse = np.array([inverse(inertia) for inertia in self._inertia])
        self._ways = [of_rpy(joint.orientation) @ axes_of(joint)[2] for joint in mechanism.joints]  # of a joint, on a
        self._seconds = [axes_of(joint)[0] for joint in mechanism.joints]  # on b
        index = mechanism.body_index
        self.ends = [(index[j.parent], index[j.child]) for j in mechanism.joints]
        self.ends += [(index[k.body_a], index[k.body_b]) for k in mechanism.loops]
        self.ends = [(a % (self.n + 1), b) if b >= 0 else (a % (self.n + 1), self.n) for a, b in self.ends]
        # connection; carrier of u; u; a; point of a; b; point or z of b; whether z leads from point to point
        self._rows: list[tuple[int, int, Long, int, Long, int, Long, bool]] = []
        self._arms: dict[int, Long] = {}  # from the centre of mass of b to the point of each connection
        for number, joint in enumerate(mechanism.joints):
            frame = np.array(axes_of(joint)).T
            self._connect(number, joint.kind, joint.position, of_rpy(joint.orientation) @ frame,
                          joint.child_position, frame)  # fmt: skip
        for number, loop in enumerate(mechanism.loops, len(mechanism.joints)):
            self._connect(number, loop.kind, loop.position_a, *_loop_frames(loop))
        self._armed = [(k, j) for k, j in enumerate(mechanism.joints) if j.armature]
        for number, joint in self._armed:  # the rate of a coordinate, as a row that yields
            a, b = self.ends[number]
            z = of_rpy(joint.orientation) @ axes_of(joint)[2]
            at_a, at_b = self._places(number, joint.position, joint.child_position)
            self._rows.append((number, a, z, a, at_a, b, at_b, joint.kind == "prismatic"))
        self._hard = len(self._rows) - len(self._armed)
        columns = [list(column) for column in zip(*self._rows, strict=True)] or [[]] * 8
        self._number, self._carrier, self._a, self._b = (np.array(columns[k], dtype=int) for k in (0, 1, 3, 5))
        self._u, self._at_a, self._at_b = (long(columns[k]).reshape(-1, 3) for k in (2, 4, 6))
        self._points = np.array(columns[7], dtype=bool)
        self._turning = [(k, j) for k, j in enumerate(mechanism.joints) if j.kind in {"revolute", "universal"}]
        self.clamped: dict[str, int] = {}  # sign of the limit that an actuator applies

    def start(self) -> Long:
        """Centres of mass, quaternions, velocities, angular velocities in world axes, angles, time, in a row."""
        n = self.n
        p, R = np.zeros((n + 1, 3), np.longdouble), np.zeros((n + 1, 3, 3), np.longdouble)
        v, w = np.zeros((n + 1, 3), np.longdouble), np.zeros((n + 1, 3), np.longdouble)
        quaternions, R[n] = np.zeros((n, 4), np.longdouble), _ONE
        for joint, (a, b) in zip(self.mechanism.joints, self.ends, strict=False):
            x, y, z = axes_of(joint)
            at_zero, q, rates = R[a] @ of_rpy(joint.orientation), long(joint.q0), long(joint.v0)
            shift = slide = spin = 0 * z
            S = _ONE
            if joint.kind == "revolute":
                S, spin = turn(z, q[0]), rates[0] * z
            elif joint.kind == "prismatic":
                shift, slide = q[0] * z, rates[0] * z
            elif joint.kind == "cylindrical":
                S, spin, shift, slide = turn(z, q[1]), rates[1] * z, q[0] * z, rates[0] * z
            elif joint.kind == "universal":
                S, spin = turn(z, q[0]) @ turn(x, q[1]), rates[0] * z + rates[1] * turn(z, q[0]) @ x
            elif joint.kind == "planar":
                S, spin = turn(z, q[2]), rates[2] * z
                shift, slide = q[0] * x + q[1] * y, rates[0] * x + rates[1] * y
            elif joint.kind == "spherical":
                S = of_quaternion(q / np.sqrt(q @ q))
                spin = S @ rates
            elif joint.kind == "free":
                S = of_quaternion(q[3:] / np.sqrt(q[3:] @ q[3:]))
                shift, slide, spin = q[:3], S @ rates[:3], S @ rates[3:]
            R[b], w[b] = at_zero @ S, w[a] + at_zero @ spin
            place = R[a] @ long(joint.position) + at_zero @ shift
            arm = R[b] @ long(joint.child_position)
            p[b] = p[a] + place - arm
            v[b] = v[a] + cross(w[a], place) + at_zero @ slide - cross(w[b], arm)
            quaternions[b] = quaternion(R[b])
        arms = np.einsum("nij,nj->ni", R, self._com)
        r, rate = (p + arms)[:n], (v + cross(w, arms))[:n]
        angles = [value for _, joint in self._turning for value in joint.q0]
        return np.concatenate([r.ravel(), quaternions.ravel(), rate.ravel(), w[:n].ravel(), long([*angles, 0])])

    def run(self, times: NDArray[np.float64]) -> list[dict[str, Long]]:
        """True state at growing times, s, see :meth:`seen`."""
        return [self.seen(state) for state in extrapolated(lambda y: self.solve(y)[0], self.start(), long(times))]

    def seen(self, state: Long) -> dict[str, Long]:
        """Poses and velocities of the bodies' frames, wrenches, angles, energy, and how far constraints are broken."""
        n = self.n
        r, R, v, w, angles = self._parts(state)
        _, wrench, broken = self.solve(state)
        arms = np.einsum("nij,nj->ni", R, self._com)
        energy = (self._mass * (v**2).sum(1)[:n]).sum() / 2 - (
            self._mass * (r[:n] @ long(self.mechanism.gravity))
        ).sum()
        local = np.einsum("nji,nj->ni", R, w)[:n]
        energy += np.einsum("ni,nij,nj->", local, self._inertia, local) / 2
        for spring, d, _ in self._springs(r, R, v, w):
            energy += spring.stiffness * (np.sqrt(d @ d) - spring.length) ** 2 / 2
        for q, rate, joint in self._coordinates(r, R, v, w, angles):
            energy += (joint.stiffness * (q - long(joint.rest)) ** 2 + joint.armature * rate**2) / 2
        found = {"p_WB": (r - arms)[:n], "v_WB": (v - cross(w, arms))[:n], "w_WB": w[:n], "R_WB": R[:n]}
        return found | {"wrench": wrench, "angles": angles[:-1], "energy": energy, "broken": broken}

    def solve(self, state: Long) -> tuple[Long, Long, Any]:
        """Rate of the state, wrenches of joints and loops on their second body, largest violation of a constraint."""
        system = self.system(state)
        n, m = self.n, len(system.bias)
        pushes, twists = system.push.reshape(m, 3 * n), system.twist.reshape(m, 3 * n)
        A = pushes @ system.of_push.reshape(m, 3 * n).T + twists @ system.of_twist.reshape(m, 3 * n).T
        A[np.arange(m), np.arange(m)] += system.yields
        right = -system.bias - pushes @ system.a0.ravel() - twists @ system.alpha0.ravel()
        multipliers = semidefinite_solve(A, right)
        acceleration = system.a0 + np.einsum("m,mni->ni", multipliers, system.of_push)
        alpha = system.alpha0 + np.einsum("m,mni->ni", multipliers, system.of_twist)
        return self.rate(state, acceleration, alpha), self.wrenches(state, system, multipliers), system.broken

    def system(self, state: Long) -> System:
        """Rows of joints and loops at a state, and accelerations without their forces."""
        n = self.n
        r, R, v, w, angles = self._parts(state)
        force, moment = np.zeros((n + 1, 3), np.longdouble), np.zeros((n + 1, 3), np.longdouble)
        given = np.zeros((len(self.ends), 6), np.longdouble)
        force[:n] += self._mass[:, None] * long(self.mechanism.gravity)
        body_w = np.einsum("nji,nj->ni", R, w)[:n]
        moment[:n] -= cross(w[:n], np.einsum("nij,njk,nk->ni", R[:n], self._inertia, body_w))
        self._loads(r, R, v, w, angles, force, moment, given)
        u, at_a, at_b = (
            np.einsum("mij,mj->mi", R[carrier], part)
            for carrier, part in ((self._carrier, self._u), (self._a, self._at_a), (self._b, self._at_b))
        )
        w_a, w_b, w_u = w[self._a], w[self._b], w[self._carrier]
        point = self._points[:, None]
        turned_b = cross(w_b, at_b)
        d = np.where(point, r[self._b] + at_b - r[self._a] - at_a, at_b)
        d_rate = np.where(point, v[self._b] + turned_b - v[self._a] - cross(w_a, at_a), turned_b)
        d_bias = cross(w_b, turned_b) - np.where(point, cross(w_a, cross(w_a, at_a)), 0)
        u_rate = cross(w_u, u)
        bias = _dots(cross(w_u, u_rate), d) + 2 * _dots(u_rate, d_rate) + _dots(u, d_bias)
        rates = _dots(u_rate, d) + _dots(u, d_rate)
        # force and moment of a unit multiplier on b, a and what carries u
        m = len(u)
        push, twist = np.zeros((m, n + 1, 3), np.longdouble), np.zeros((m, n + 1, 3), np.longdouble)
        rows = np.arange(m)
        push[rows, self._b] += np.where(point, u, 0)
        twist[rows, self._b] += cross(at_b, u)
        push[rows, self._a] -= np.where(point, u, 0)
        twist[rows, self._a] -= np.where(point, cross(at_a, u), 0)
        twist[rows, self._carrier] += cross(u, d)
        residual, yields = _dots(u, d), np.zeros(m, np.longdouble)
        for k, (number, joint) in enumerate(self._armed, self._hard):
            yields[k] = 1 / long(joint.armature)
            if joint.kind == "revolute":  # not a product: the rate about the axis
                a, b = self.ends[number]
                push[k], twist[k] = 0, 0
                twist[k, b], twist[k, a] = u[k], -u[k]
                bias[k] = cross(w[a], u[k]) @ (w[b] - w[a])
        push, twist = push[:, :n], twist[:, :n]
        inverse = np.einsum("nij,njk,nlk->nil", R[:n], self._inverse, R[:n])
        a0, alpha0 = force[:n] / self._mass[:, None], np.einsum("nij,nj->ni", inverse, moment[:n])
        of_push, of_twist = push / self._mass[:, None], np.einsum("nij,mnj->mni", inverse, twist)
        hard = slice(self._hard)
        broken = max(np.abs(residual[hard]).max(initial=0), np.abs(rates[hard]).max(initial=0))
        return System(push, twist, bias, yields, of_push, of_twist, a0, alpha0, inverse, given, broken)

    def wrenches(self, state: Long, system: System, multipliers: Long) -> Long:
        """Wrenches of joints and loops on their second body about its point, world axes."""
        n = self.n
        r, R, *_ = self._parts(state)
        wrench = system.given.copy()
        for k, size in enumerate(multipliers[: len(self._number)]):
            b = self._b[k]
            if b < n:
                f, t = size * system.push[k, b], size * system.twist[k, b]
                arm = self._arms[self._number[k]]
                wrench[self._number[k], :3] += f
                wrench[self._number[k], 3:] += t - cross(R[b] @ arm, f)
            else:  # the world is b: what a feels, with the other sign, about b's point
                a = self._a[k]
                f, t = -size * system.push[k, a], -size * system.twist[k, a]
                wrench[self._number[k], :3] += f
                wrench[self._number[k], 3:] += t + cross(r[a] - self._arms[self._number[k]], f)
        return wrench

    def rate(self, state: Long, acceleration: Long, alpha: Long) -> Long:
        """Rate of a state whose bodies accelerate so."""
        n = self.n
        r, R, v, w, angles = self._parts(state)
        angle_rates = [rate for _, rate, joint in self._coordinates(r, R, v, w, angles) if joint.kind != "prismatic"]
        p = state[3 * n : 7 * n].reshape(n, 4)
        p = p / np.sqrt((p**2).sum(1))[:, None]
        p_rate = np.concatenate([-_dots(w[:n], p[:, 1:])[:, None], p[:, :1] * w[:n] + cross(w[:n], p[:, 1:])], 1) / 2
        parts = (v[:n], p_rate, acceleration, alpha, long([*angle_rates, 1]))
        return np.concatenate([part.ravel() for part in parts])

    def _connect(self, number: int, kind: str, at_a: Any, frame_a: Long, at_b: Any, frame_b: Long) -> None:
        a, b = self.ends[number]
        places = self._places(number, at_a, at_b)
        x, y, z = frame_a.T
        X, Y, Z = frame_b.T
        none = np.zeros(3, np.longdouble)
        slides = {"prismatic": ((a, x), (a, y)), "cylindrical": ((a, x), (a, y)), "planar": ((a, z),), "free": ()}
        for carrier, u in slides.get(kind, tuple((self.n, e) for e in _ONE)):
            self._rows.append((number, carrier, u, a, places[0], b, places[1], True))
        parallel = ((z, X), (z, Y))
        whole = ((x, Y), (y, Z), (z, X))
        turns: dict[str, Any] = dict.fromkeys(("revolute", "cylindrical", "planar"), parallel)
        turns |= {"universal": ((z, X),), "spherical": (), "free": ()}
        for u, other in turns.get(kind, whole):
            self._rows.append((number, a, u, a, none, b, other, False))

    def _places(self, number: int, at_a: Any, at_b: Any) -> tuple[Long, Long]:
        a, b = self.ends[number]
        self._arms[number] = long(at_b) - self._com[b]
        return long(at_a) - self._com[a], self._arms[number]

    def _parts(self, state: Long) -> tuple[Long, Long, Long, Long, Long]:
        n, none = self.n, np.zeros((1, 3), np.longdouble)
        r, p = state[: 3 * n].reshape(n, 3), state[3 * n : 7 * n].reshape(n, 4)
        R = of_quaternion(p / np.sqrt((p**2).sum(1))[:, None])
        v, w = state[7 * n : 10 * n].reshape(n, 3), state[10 * n : 13 * n].reshape(n, 3)
        r, v, w = (np.concatenate([part, none]) for part in (r, v, w))
        return r, np.concatenate([R, _ONE[None]]), v, w, state[13 * n :]

    def _springs(self, r: Long, R: Long, v: Long, w: Long) -> list[tuple[Any, Long, tuple[Any, ...]]]:
        found = []
        for spring in self.mechanism.springs:
            a, b = self.mechanism.body_index[spring.body_a], self.mechanism.body_index[spring.body_b]
            arm_a, arm_b = (
                R[a] @ (long(spring.position_a) - self._com[a]),
                R[b] @ (long(spring.position_b) - self._com[b]),
            )
            d = r[b] + arm_b - r[a] - arm_a
            rate = v[b] + cross(w[b], arm_b) - v[a] - cross(w[a], arm_a)
            found.append((spring, d, (a, b, arm_a, arm_b, rate)))
        return found

    def _coordinates(self, r: Long, R: Long, v: Long, w: Long, angles: Long) -> list[tuple[Any, Any, Joint]]:
        """Coordinate and rate of each joint with angles or one slide."""
        found, place = [], 0
        for number, joint in enumerate(self.mechanism.joints):
            if joint.kind not in {"revolute", "universal", "prismatic"}:
                continue
            a, b = self.ends[number]
            axis, x = R[a] @ self._ways[number], self._seconds[number]
            if joint.kind == "prismatic":
                arm = R[b] @ self._arms[number]
                d = r[b] + arm - r[a] - R[a] @ (long(joint.position) - self._com[a])
                rate = v[b] + cross(w[b], arm) - v[a] - cross(w[a], r[b] + arm - r[a])
                found.append((axis @ d, axis @ rate, joint))
                continue
            for way in [axis, R[b] @ x][: joint.nq]:
                found.append((angles[place], way @ (w[b] - w[a]), joint))
                place += 1
        return found

    def wanted(self, motor: Actuator, time: Any, q: Any, rate: Any) -> Any:
        """Effort of an actuator at its joint without its limit."""
        n, target = long(motor.gear), motor.target
        r = target.at(time) if isinstance(target, Formula) else long(target)
        return n * {"torque": r, "velocity": motor.kd * (r - n * rate),
                    "position": motor.kp * (r - n * q) - motor.kd * n * rate}[motor.kind]  # fmt: skip

    def _effort(self, motor: Actuator, time: Any, q: Any, rate: Any) -> Any:
        sign = self.clamped.get(motor.name)
        return sign * long(motor.limit) if sign else self.wanted(motor, time, q, rate)

    def _loads(self, r: Long, R: Long, v: Long, w: Long, angles: Long, force: Long, moment: Long, given: Long) -> None:
        """Adds springs, dampers and drives to the loads on the bodies, and of joints to what they transmit."""
        for spring, d, (a, b, arm_a, arm_b, rate) in self._springs(r, R, v, w):
            length = np.sqrt(d @ d)
            pull = (spring.stiffness * (length - spring.length) + spring.damping * (d @ rate) / length) * d / length
            force[a] += pull
            force[b] -= pull
            moment[a] += cross(arm_a, pull)
            moment[b] -= cross(arm_b, pull)
        coordinates = self._coordinates(r, R, v, w, angles)
        for number, joint in enumerate(self.mechanism.joints):
            a, b = self.ends[number]
            axis, x = R[a] @ self._ways[number], self._seconds[number]
            f, t = 0 * axis, 0 * axis
            if joint.kind == "spherical":
                t = -joint.damping * (w[b] - w[a])
            ways = [axis, R[b] @ x]
            for way, (q, rate, _) in zip(ways, [c for c in coordinates if c[2] is joint], strict=False):
                motors = [motor for motor in self.mechanism.actuators if motor.joint == joint.name]
                effort = joint.torque + sum(self._effort(motor, angles[-1], q, rate) for motor in motors)
                along = (effort - joint.stiffness * (q - long(joint.rest)) - joint.damping * rate) * way
                f, t = (f + along, t) if joint.kind == "prismatic" else (f, t + along)
            arm = R[b] @ self._arms[number]
            force[b] += f
            moment[b] += t + cross(arm, f)
            force[a] -= f
            moment[a] -= t + cross(r[b] + arm - r[a], f)
            given[number] += np.concatenate([f, t])


def _loop_frames(loop: Any) -> tuple[Long, Any, Long]:
    """Frame on a, point on b and frame on b of a loop."""

    def frame(axis: Any) -> Long:
        z = long(axis) / np.sqrt((long(axis) ** 2).sum())
        x = cross(z, _ONE[int(np.argmin(np.abs(z)))])
        x = x / np.sqrt(x @ x)
        return np.array([x, cross(z, x), z]).T

    on_a, on_b = frame(loop.axis_a), frame(loop.axis_b)
    if loop.kind in {"fixed", "prismatic"}:
        on_b = of_rpy(loop.orientation).T @ on_a
    elif loop.kind == "universal":  # the axes themselves stay perpendicular
        on_b = on_b[:, [2, 0, 1]]
    return on_a, loop.position_b, on_b


def _dots(one: Long, other: Long) -> Long:
    return (one * other).sum(-1)
