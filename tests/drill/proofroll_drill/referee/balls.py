"""Newton–Euler equations of a ball on its wall in world components, in long doubles; only data of an element is read.

The force of the wall is eliminated by hand: the normal force keeps the centre on its surface, friction keeps the
contact point still or is against its velocity. Times of events are found on the way, in steps that end at them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .extrapolation import Long, one_step, tight_step
from .linear_algebra import long, turn
from .random_balls import RandomBall

_LONGEST = 0.02  # s
_NEAR_STOP = 0.4  # of the time that a slip still takes, the most that a step makes of it: no friction is reversed in it
_STOPPED = 1e-16  # s before the end of a slip, when its last way is straight; a slip in the plane turns until then
_LOW = 1e-3  # of the speed of a fall by the radius: slower bounces, and slower rolling with resistance, are left out
_Z = long([0, 0, 1])


@dataclass
class Told:
    """Motion and events of a ball.

    Attributes:
        seen: p_WB, v_WB, w_WB, q_WB, force [SI] and the distance from the wall at each time that was reached.
        events: kind and time [s] of what the ball does on the wall.
        bounces: times of all impacts [s].
        end: until when it is known [s].
        why: reason for its end; empty: the last time.
    """

    seen: list[dict[str, Long]] = field(default_factory=list)
    events: list[tuple[str, float]] = field(default_factory=list)
    bounces: list[float] = field(default_factory=list)
    end: float = np.inf
    why: str = ""


class BallReferee:
    """One ball, from its start on."""

    def __init__(self, element: RandomBall) -> None:
        self.element, contact = element, element.contact
        self.a, self.k = long(element.ball.radius), long(element.ball.inertia_ratio)
        self.g, self.mass = long(element.gravity.vector), long(element.ball.mass)
        self.resistance, self.mu = long(contact.rolling_resistance), long([contact.mu_static, contact.mu_kinetic])
        self.natural = np.sqrt(self.a * np.sqrt(self.g @ self.g))
        self._wall: Callable[[Long], tuple[Any, Long, Long]] = getattr(self, f"_{element.surface.kind}")
        self.W = long([0, 0, 0])
        if element.surface.kind == "plane":
            self.W = long(element.surface.turning) * self._tilted()[2]

    def start(self) -> Long:
        """Centre, velocity, spin and orientation, one after the other."""
        start = self.element.start
        p, e1, e2, e3 = getattr(self, f"_{self.element.surface.kind}_at")(*long(start.coordinates))
        v = start.velocity[0] * e2 + start.velocity[1] * e3
        if start.tangential_spin is None:
            w = long(start.spin) * e1 - np.cross(e1, v - np.cross(self.W, p + self.a * e1)) / self.a
        else:
            w = long(start.spin) * e1 + start.tangential_spin[0] * e2 + start.tangential_spin[1] * e3
        return np.concatenate([p - long(start.gap) * e1, v, w, long([1, 0, 0, 0])])

    def run(self, times: Any) -> Told:
        """Motion and events until the last of growing times, s; the first is 0."""
        told, y, t, contact = Told(), self.start(), long(0), self.element.contact
        slipping = contact.mu_static < np.inf and self.element.start.tangential_spin is not None
        flying = bool(self.element.start.gap)
        while True:
            if flying:
                y, t, flying = self._fly(y, t, times, told)
                if told.end < np.inf or len(told.seen) == len(times):
                    return told
                if flying:
                    continue
                slip = self._slip(y)
                slipping = bool(np.sqrt(slip @ slip) > 1e-14 * self.natural) and contact.mu_static < np.inf
            margins = self._margins(y)
            if margins[1] < 0 or (not slipping and margins[0] < 0):  # a slip that grows from nothing is not followed
                told.end, told.why = float(t), "lift_off" if margins[1] < 0 else "slip"
                told.events.append((told.why, told.end))
                return told
            if slipping:
                told.events.append(("slip", float(t)))
            y, t, why = self._roll(y, t, times, told, slipping)
            if why == "stick" and self._margins(y)[0] > 0:
                told.events.append(("stick", float(t)))
                slipping = False
                continue
            if why in {"slip", "lift_off"}:
                told.events.append((why, float(t)))
            if why:
                told.end, told.why = float(t), why
            return told

    def _roll(self, y: Long, t: Any, times: Any, told: Told, slipping: bool) -> tuple[Long, Any, str]:
        """Rolls or slips on, until something else begins: its name; empty: the last time came."""
        step = long(_LONGEST)

        def rate(state: Long) -> Long:
            return self._rate(state, slipping)[0]

        for time in times[len(told.seen) :]:
            while t < time:
                most = min(long(_LONGEST), time - t)
                if slipping:
                    left = self._left(y)
                    if left < _STOPPED:
                        return y + left * rate(y), t + left, "stick"
                    most = min(most, _NEAR_STOP * left)
                moved, length, following = tight_step(rate, y, step, most)
                margins = self._margins(moved)[slipping:]
                if min(margins) < 0:
                    which = int(np.argmin(margins)) + slipping
                    moved, length = self._ends(rate, y, length, which)
                    return moved, t + length, "lift_off" if which else "slip"
                y, t, step = moved, t + length, following
                if self.resistance and np.sqrt(y[3:6] @ y[3:6]) < _LOW * self.natural:
                    return y, t, "halt"
            told.seen.append(self._seen(y, self._rate(y, slipping)[1]))
        return y, t, ""

    def _ends(self, rate: Callable[[Long], Long], y: Long, length: Any, which: int) -> tuple[Long, Any]:
        """Root of a margin within a step, with the state there: by halving, then by secants."""
        low, high = long(0), length
        values = [self._margins(state)[which] for state in (y, one_step(rate, y, length)[0])]
        for number in range(60):
            x = (low + high) / 2 if number < 4 else low - values[0] * (high - low) / (values[1] - values[0])
            x = min(max(x, low + 1e-3 * (high - low)), high - 1e-3 * (high - low))
            moved, _ = one_step(rate, y, x)
            value = self._margins(moved)[which]
            if value < 0:
                high, values[1] = x, value
            else:
                low, values[0] = x, value
            if high - low < 1e-15:
                break
        return moved, (low + high) / 2

    def _rate(self, y: Long, slipping: bool) -> tuple[Long, Long]:
        """Rate of the state, and the wall's force over the mass."""
        v, w = y[3:6], y[6:9]
        n, friction, e1, moment = self._forces(y, slipping)
        force = friction - n * e1
        spin = (self.a * np.cross(e1, friction) + moment) / (self.k * self.a**2)
        return np.concatenate([v, self.g + force, spin, _turning(y[9:], w)]), force

    def _forces(self, y: Long, slipping: bool) -> tuple[Any, Long, Long, Long]:
        """Normal force, friction and moment of the resistance, over the mass; and the normal."""
        p, v, w = y[:3], y[3:6], y[6:9]
        _, e1, bend = self._wall(p)
        turned = bend @ v
        n = e1 @ self.g + v @ turned
        moment = drag = 0 * v
        if self.resistance:
            way = v / np.sqrt(v @ v)
            moment, drag = -self.resistance * n * np.cross(way, e1), self.resistance * n / (self.k * self.a) * way
        if slipping:
            u = self._slip(y)
            return n, -self.mu[1] * n * u / np.sqrt(u @ u), e1, moment
        free = self.g + drag + self.a * np.cross(w, turned) - np.cross(self.W, v + self.a * turned)
        return n, -self.k / (1 + self.k) * (free - (free @ e1) * e1), e1, moment

    def _slip(self, y: Long) -> Long:
        p, v, w = y[:3], y[3:6], y[6:9]
        e1 = self._wall(p)[1]
        u = v + self.a * np.cross(w, e1)
        return u - (u @ e1) * e1

    def _left(self, y: Long) -> Any:
        """Remaining time of the slip at its present rate [s]."""
        u, (_, e1, bend), rate = self._slip(y), self._wall(y[:3]), self._rate(y, True)[0]
        change = rate[3:6] + self.a * (np.cross(rate[6:9], e1) + np.cross(y[6:9], bend @ y[3:6]))
        size = np.sqrt(u @ u)
        falls = -(change @ u) / size
        return size / falls if falls > 0 else long(np.inf)

    def _margins(self, y: Long) -> tuple[Any, Any]:
        """Reserve of friction while the ball rolls, and the normal force, over the mass."""
        n, friction, _, _ = self._forces(y, False)
        return np.inf if np.isinf(self.mu[0]) else self.mu[0] * n - np.sqrt(friction @ friction), n

    def _fly(self, y: Long, t: Any, times: Any, told: Told) -> tuple[Long, Any, bool]:
        """One flight and its impact; whether another flight follows."""
        contact, (p, v, w) = self.element.contact, (y[:3], y[3:6], y[6:9])

        def at(s: Any) -> Long:
            return np.concatenate([p + s * v + s**2 / 2 * self.g, v + s * self.g, w, _turned(y[9:], w, s)])

        s, last = long(1e-9), long(times[-1]) - t
        while s < last and self._wall(at(s)[:3])[0] >= 0:
            s += 0.02 * self.natural / np.sqrt(self.g @ self.g) / 5
        lands = s < last
        for _ in range(80 if lands else 0):
            here = at(s)
            gap, e1, _ = self._wall(here[:3])
            s = s + gap / (e1 @ here[3:6])
        for time in times[len(told.seen) :]:
            if time >= (t + s if lands else np.inf):
                break
            told.seen.append(self._seen(at(time - t), 0 * v))
        if not lands:
            return y, t, True
        y, t = at(s), t + s
        if contact.restitution is None:
            told.end, told.why = float(t), "lands"
            return y, t, True
        told.bounces.append(float(t))
        e1 = self._wall(y[:3])[1]
        approach, u = e1 @ y[3:6], self._slip(y)
        size, e, e_t = np.sqrt(u @ u), long(contact.restitution), long(contact.tangential_restitution)
        if not e and np.isinf(self.mu[0]):
            e_t *= 0  # what it turns back friction stops at once
        if 0 < e * approach < _LOW * self.natural:
            told.end, told.why = float(t), "bounces"
            return y, t, True
        wanted, press = (1 + e_t) * size * self.k / (1 + self.k), (1 + e) * approach
        blow = wanted if wanted <= self.mu[0] * press else self.mu[1] * press
        friction = -blow * u / size if size else 0 * u
        v, w = y[3:6] + friction - press * e1, y[6:9] + np.cross(e1, friction) / (self.k * self.a)
        if not e:
            told.events.append(("settle", float(t)))
        return np.concatenate([y[:3], v, w, y[9:]]), t, bool(e)

    def _seen(self, y: Long, force: Long) -> dict[str, Long]:
        return {
            "p_WB": y[:3], "v_WB": y[3:6], "w_WB": y[6:9], "q_WB": y[9:] / np.sqrt(y[9:] @ y[9:]),
            "N": -self.mass * force @ self._wall(y[:3])[1], "gap": self._wall(y[:3])[0],
        }  # fmt: skip

    # Of each wall: distance of the ball, the normal into the wall, its derivative; and place and frame of coordinates.

    def _tilted(self) -> Long:
        """World components of the axes of a wall that is turned about y, as rows."""
        return turn((0, 1, 0), long(self.element.surface.tilt)).T

    def _plane(self, p: Long) -> tuple[Any, Long, Long]:
        up = self._tilted()[2]
        return up @ p - self.a, -up, np.zeros((3, 3), np.longdouble)

    def _plane_at(self, down: Any, across: Any) -> tuple[Long, Long, Long, Long]:
        x, y, z = self._tilted()
        return down * x - across * y + self.a * z, -z, x, -y

    def _cylinder(self, p: Long) -> tuple[Any, Long, Long]:
        axis = self._tilted()[2]
        arm = p - (p @ axis) * axis
        r = np.sqrt(arm @ arm)
        around = np.cross(axis, arm / r)
        return self._radius() - r, arm / r, np.outer(around, around) / r

    def _cylinder_at(self, angle: Any, height: Any) -> tuple[Long, Long, Long, Long]:
        x, y, z = self._tilted()
        e1 = np.cos(angle) * x + np.sin(angle) * y
        return self._radius() * e1 + height * z, e1, np.cross(z, e1), z

    def _bowl(self, p: Long) -> tuple[Any, Long, Long]:
        r = np.sqrt(p @ p)
        return self._radius() - r, p / r, (np.eye(3) - np.outer(p / r, p / r)) / r

    def _bowl_at(self, xi: Any, eta: Any) -> tuple[Long, Long, Long, Long]:
        x, y = xi / (2 * self._radius()), eta / (2 * self._radius())
        q = x * x + y * y
        e1 = np.array([2 * x, -2 * y, q - 1]) / (1 + q)
        along = np.array([1 + q - 2 * x * x, 2 * x * y, 2 * x])
        e2 = along / np.sqrt(along @ along)
        return self._radius() * e1, e1, e2, np.cross(e1, e2)

    def _cone(self, p: Long) -> tuple[Any, Long, Long]:
        slope, out = long(self.element.surface.slope), _outward(p)
        e1, around = np.sin(slope) * out - np.cos(slope) * _Z, np.cross(_Z, out)
        return -(e1 @ p) - self.a, e1, np.sin(slope) / (p @ out) * np.outer(around, around)

    def _cone_at(self, angle: Any, way: Any) -> tuple[Long, Long, Long, Long]:
        slope = long(self.element.surface.slope)
        out = np.array([np.cos(angle), np.sin(angle), 0 * angle])
        along = np.cos(slope) * out + np.sin(slope) * _Z
        e1 = np.sin(slope) * out - np.cos(slope) * _Z
        return way * along + self.a / np.cos(slope) * _Z, e1, np.cross(_Z, out), along

    def _torus(self, p: Long) -> tuple[Any, Long, Long]:
        wall, out = self.element.surface, _outward(p)
        d = p - long(wall.ring_radius) * out
        r, around = np.sqrt(d @ d), np.cross(_Z, out)
        along = np.cross(around, d / r)
        bend = -np.outer(along, along) / r - (d @ out) / r / (p @ out) * np.outer(around, around)
        return r - long(wall.wire_radius) - self.a, -d / r, bend

    def _torus_at(self, angle: Any, around: Any) -> tuple[Long, Long, Long, Long]:
        wall = self.element.surface
        out = np.array([np.cos(angle), np.sin(angle), 0 * angle])
        away = np.sin(around) * out + np.cos(around) * _Z
        p = long(wall.ring_radius) * out + (long(wall.wire_radius) + self.a) * away
        return p, -away, np.cross(_Z, out), np.cos(around) * out - np.sin(around) * _Z

    def _radius(self) -> Any:
        return long(self.element.surface.radius) - self.a


def _outward(p: Long) -> Long:
    arm = long([p[0], p[1], 0])
    return arm / np.sqrt(arm @ arm)


def _turning(q: Long, w: Long) -> Long:
    """Rate of a quaternion wxyz by a spin in world components."""
    return np.concatenate([[-(w @ q[1:])], q[0] * w + np.cross(w, q[1:])]) / 2


def _turned(q: Long, w: Long, s: Any) -> Long:
    """A quaternion after a time with a constant spin."""
    size = np.sqrt(w @ w)
    if not size:
        return q
    c, u = np.cos(size * s / 2), np.sin(size * s / 2) * w / size
    return np.concatenate([[c * q[0] - u @ q[1:]], c * q[1:] + q[0] * u + np.cross(u, q[1:])])
