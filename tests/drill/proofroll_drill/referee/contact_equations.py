"""Accelerations, and velocities after an impact, of bodies whose contacts are open, stick or slip, in long doubles."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from proofroll.elements.mechanism import Mechanism

from .extrapolation import Long
from .linear_algebra import cross, eliminated_solve, long
from .shapes import Lying, Side, lying, sides_of
from .solver import Referee, System


class Mode(NamedTuple):
    """State of motion of one contact; heading: of a slip from rest, or None."""

    kind: str
    heading: Any = None


OPEN, STICK, SLIP = Mode("open"), Mode("stick"), Mode("slip")


class Touching(NamedTuple):
    """A pair of shapes with its laws."""

    name: str
    a: Side
    b: Side
    friction: Any
    restitution: Any


class Found(NamedTuple):
    """Accelerations or velocities, multipliers of joints, and the force or impulse and slide of each contact."""

    linear: Long
    angular: Long
    multipliers: Long
    force: Long
    slide: Long


class ContactEquations(Referee):
    """One mechanism with contacts of bodies, without laws of joints that switch."""

    def __init__(self, mechanism: Mechanism) -> None:
        super().__init__(mechanism)
        self.pairs: list[Touching] = []
        shapes = {geometry.name: geometry for geometry in mechanism.geometries}
        for pair in mechanism.pairs:
            one, two = (sides_of(shapes[name], mechanism.body_index, self._com) for name in pair.geometries)
            both = list(itertools.product(one, two))
            for k, (a, b) in enumerate(both, 1):
                name = pair.name if len(both) == 1 else f"{pair.name}.{k}"
                self.pairs.append(Touching(name, a, b, long(pair.friction), long(pair.restitution)))

    def touching(self, state: Long) -> list[Lying]:
        """Gap, normal and place of each contact, and their rates."""
        r, R, v, w, _ = self._parts(state)
        return [lying(pair.a, pair.b, r, R, v, w) for pair in self.pairs]

    def accelerated(self, state: Long, modes: Sequence[Mode]) -> Found:
        """Accelerations while contacts keep these modes."""
        return self.solved(state, self.system(state), self.touching(state), modes)

    def solved(
        self, state: Long, system: System, touch: list[Lying], modes: Sequence[Mode], aims: Sequence[Long] | None = None
    ) -> Found:
        """Accelerations, or velocities after an impact that aims at these slides, while contacts keep these modes."""
        n, m = self.n, len(system.bias)
        r, _, v, w, _ = self._parts(state)
        biases = [cross(w[p.a.body], t.place_rate - v[p.a.body]) - cross(w[p.b.body], t.place_rate - v[p.b.body])
                  for p, t in zip(self.pairs, touch, strict=True)]  # fmt: skip
        owners, ways, alongs, wanted = [], [], [], []
        for k, (mode, t) in enumerate(zip(modes, touch, strict=True)):
            for number, way in enumerate(_ways(mode, t.normal)):
                owners.append(k)
                ways.append(way)
                alongs.append(self._along(k, mode, t, way))
                curved = t.normal_rate @ t.slide if number == 0 else 0
                wanted.append(-(way @ biases[k]) - curved if aims is None else aims[k][number])
        push, twist = self._extended(system.push, system.twist, r, touch, owners, ways)
        moved, turned = self._extended(system.push, system.twist, r, touch, owners, alongs)
        moved, turned = moved / self._mass[:, None], np.einsum("nij,mnj->mni", system.inverse, turned)
        count = m + len(owners)
        pushes, twists = push.reshape(count, 3 * n), twist.reshape(count, 3 * n)
        A = pushes @ moved.reshape(count, 3 * n).T + twists @ turned.reshape(count, 3 * n).T
        A[np.arange(m), np.arange(m)] += system.yields
        linear, angular = (system.a0, system.alpha0) if aims is None else (v[:n], w[:n])
        free = pushes @ linear.ravel() + twists @ angular.ravel()
        # an armature keeps the rate of its joint until an impulse acts
        of_joints = -system.bias - free[:m] if aims is None else np.where(system.yields > 0, 0, -free[:m])
        z = eliminated_solve(A, np.concatenate([of_joints, long(wanted) - free[m:]]))
        linear, angular = linear + np.einsum("m,mni->ni", z, moved), angular + np.einsum("m,mni->ni", z, turned)
        force = np.zeros((len(modes), 3), np.longdouble)
        for along, k, size in zip(alongs, owners, z[m:], strict=True):
            force[k] += size * along
        slide = self._slides(r, touch, linear, angular)
        return Found(linear, angular, z[:m], force, slide + long(biases) if aims is None else slide)

    def pushed(self, state: Long, system: System, t: Lying, k: int, way: Long) -> System:
        """The system with a unit force along a way at a contact besides."""
        r, *_ = self._parts(state)
        a0, alpha0 = system.a0.copy(), system.alpha0.copy()
        for side, sign in ((self.pairs[k].a, 1), (self.pairs[k].b, -1)):
            if side.body < self.n:
                a0[side.body] += sign * way / self._mass[side.body]
                alpha0[side.body] += system.inverse[side.body] @ cross(t.place - r[side.body], sign * way)
        return system._replace(a0=a0, alpha0=alpha0)

    def wrench_on_bodies(self, r: Long, t: Lying, k: int, force: Long) -> tuple[Long, Long]:
        """Forces and moments on bodies of a force on the first body of a contact."""
        push, twist = np.zeros((self.n, 3), np.longdouble), np.zeros((self.n, 3), np.longdouble)
        for side, sign in ((self.pairs[k].a, 1), (self.pairs[k].b, -1)):
            if side.body < self.n:
                push[side.body] += sign * force
                twist[side.body] += sign * cross(t.place - r[side.body], force)
        return push, twist

    def _along(self, k: int, mode: Mode, t: Lying, way: Long) -> Long:
        """Direction of the force that acts along a way: of a slip, friction too."""
        friction = self.pairs[k].friction
        if mode.kind != "slip" or not friction:
            return way
        return way - friction * (mode.heading if mode.heading is not None else t.slip / size_of(t.slip))

    def _extended(
        self, push: Long, twist: Long, r: Long, touch: list[Lying], owners: list[int], ways: list[Long]
    ) -> tuple[Long, Long]:
        """Rows of joints and of contacts."""
        if not owners:
            return push, twist
        rows = [self.wrench_on_bodies(r, touch[k], k, way) for k, way in zip(owners, ways, strict=True)]
        return np.concatenate([push, [row[0] for row in rows]]), np.concatenate([twist, [row[1] for row in rows]])

    def _slides(self, r: Long, touch: list[Lying], linear: Long, angular: Long) -> Long:
        none = np.zeros((1, 3), np.longdouble)  # the world
        full, spin = np.concatenate([linear, none]), np.concatenate([angular, none])
        slide = np.zeros((len(touch), 3), np.longdouble)
        for k, (pair, t) in enumerate(zip(self.pairs, touch, strict=True)):
            a, b = pair.a.body, pair.b.body
            slide[k] = full[a] + cross(spin[a], t.place - r[a]) - full[b] - cross(spin[b], t.place - r[b])
        return slide


def frame_of(normal: Long) -> Long:
    """Normal and two directions across, as rows."""
    x = np.eye(3, dtype=np.longdouble)[int(np.argmin(np.abs(normal)))]
    one = cross(normal, x)
    one = one / size_of(one)
    return np.array([normal, one, cross(normal, one)])


def across(vector: Long, normal: Long) -> Long:
    """Part of a vector across a normal."""
    return vector - normal * (normal @ vector)


def size_of(vector: Long) -> Any:
    """Length of a vector."""
    return np.sqrt(vector @ vector)


def _ways(mode: Mode, normal: Long) -> Any:
    """Directions in which a contact holds what touches."""
    if mode.kind == "open":
        return []
    return frame_of(normal) if mode.kind == "stick" else [normal]
