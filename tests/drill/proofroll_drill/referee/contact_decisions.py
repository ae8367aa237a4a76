"""Modes of contacts from now on: all combinations are tried; the only one that keeps all inequalities is taken."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from scipy.optimize import nnls

from .contact_equations import OPEN, SLIP, STICK, ContactEquations, Found, Mode, frame_of, size_of
from .extrapolation import Long
from .linear_algebra import cross, inverse, long
from .shapes import Lying
from .solver import System

STILL = 1e-13  # m/s or rad/s of every body at rest
_KEPT = 1e-10  # violation of an inequality, relative to the largest force or speed, that counts as none
_LINE = 1e-10  # response across over response along, below which a contact slides along a line only
_ALIKE = 1e-7  # of the largest acceleration: what the same outcome of two trials may differ by
_SIDES = 720  # of a cone of friction
_FROM_REST = Mode("slip", "?")  # in a direction that is to be found
_ANGLES = np.linspace(0, 2 * np.pi, 97, dtype=np.longdouble)


class UndecidedError(Exception):
    """The referee does not know what follows."""


class ContactDecisions(ContactEquations):
    """Decisions of contacts at one state."""

    def decided(self, y: Long, closed: Sequence[bool], still: Sequence[bool]) -> list[Mode]:
        """Modes from now on, where these contacts are closed and these do not slip."""
        if not any(closed):
            return [OPEN for _ in closed]
        if self._balanced(y, closed, still):
            return [OPEN if not shut else STICK if pair.friction else SLIP
                    for pair, shut in zip(self.pairs, closed, strict=True)]  # fmt: skip
        return self.tried(y, closed, still)[1]

    def tried(
        self, y: Long, closed: Sequence[bool], still: Sequence[bool], aims: Sequence[Long] | None = None
    ) -> tuple[Found, list[Mode]]:
        """The only motion that keeps all inequalities, or the only impact that aims at these slides.

        Raises:
            UndecidedError: there is none, or several.
        """
        system, touch, kept = self.system(y), self.touching(y), []
        for modes in itertools.product(*(self._choices(*each) for each in zip(self.pairs, closed, still, strict=True))):
            for headed in self._headed(system, touch, modes, aims, y):
                found = self.solved(y, system, touch, headed, aims)
                margin = self._margin(headed, closed, touch, found, aims)
                if margin >= -_KEPT:
                    kept.append((margin, found, list(headed)))
        if not kept:
            raise UndecidedError("no motion keeps all inequalities of the contacts")
        kept.sort(key=lambda one: -one[0])
        _, best, taken = kept[0]
        size = max(float(np.abs(best.linear).max()), 1e-6)
        if any(np.abs(other.linear - best.linear).max() > _ALIKE * size for _, other, _ in kept[1:]):
            raise UndecidedError("several motions keep all inequalities of the contacts")
        return best, taken

    @staticmethod
    def _choices(pair: Any, shut: bool, still: bool) -> list[Mode]:
        if not shut:
            return [OPEN]
        return [STICK, _FROM_REST, OPEN] if pair.friction and still else [SLIP, OPEN]

    def _balanced(self, y: Long, closed: Sequence[bool], still: Sequence[bool]) -> bool:
        """True if nothing moves, and forces within cones of many sides balance all loads."""
        n = self.n
        if np.abs(y[7 * n : 13 * n]).max() > STILL or list(closed) != list(still):
            return False
        system, (r, *_) = self.system(y), self._parts(y)
        columns = [np.concatenate([p.ravel(), t.ravel()]) for p, t in zip(system.push, system.twist, strict=True)]
        columns += [-column for column in columns]
        for k, t in enumerate(self.touching(y)):
            normal, one, two = frame_of(t.normal)
            for angle in np.linspace(0, 2 * np.pi, _SIDES, endpoint=False) if closed[k] else ():
                force = normal + self.pairs[k].friction * (np.cos(angle) * one + np.sin(angle) * two)
                columns.append(np.concatenate(self.wrench_on_bodies(r, t, k, force)).ravel())
        moments = [inverse(own) @ alpha for own, alpha in zip(system.inverse, system.alpha0, strict=True)]
        load = np.concatenate([(system.a0 * self._mass[:, None]).ravel(), np.ravel(moments)])
        A, b = np.array(columns, float).T, -np.array(load, float)
        return bool(nnls(A, b, maxiter=100 * A.shape[1])[1] < 1e-9 * np.linalg.norm(b))

    def _headed(
        self, system: System, touch: list[Lying], modes: Sequence[Mode], aims: Sequence[Long] | None, state: Long
    ) -> Iterator[list[Mode]]:
        """The modes with headings for slips from rest."""
        begin = [k for k, mode in enumerate(modes) if mode is _FROM_REST]
        lines = {k: self._line(system, touch, k, state) for k in begin}
        if all(line is not None for line in lines.values()):
            for signs in itertools.product((1, -1), repeat=len(begin)):
                made = list(modes)
                for k, sign in zip(begin, signs, strict=True):
                    made[k] = Mode("slip", sign * lines[k])
                yield made
            return
        if len(begin) > 1:
            raise UndecidedError("several slips from rest in space")
        (k,) = begin
        _, one, two = frame_of(touch[k].normal)

        def heading(angle: Any) -> list[Mode]:
            return [*modes[:k], Mode("slip", np.cos(angle) * one + np.sin(angle) * two), *modes[k + 1 :]]

        def slide(headed: list[Mode]) -> Long:
            return self.solved(state, system, touch, headed, aims).slide[k]

        def astray(angle: Any) -> Any:
            headed = heading(angle)
            return cross(headed[k].heading, slide(headed)) @ touch[k].normal

        values = [astray(angle) for angle in _ANGLES]
        for low, high, at_low, at_high in zip(_ANGLES[:-1], _ANGLES[1:], values[:-1], values[1:], strict=True):
            if at_low * at_high <= 0:
                headed = heading(root(astray, low, high, at_low, at_high))
                if headed[k].heading @ slide(headed) > 0:
                    yield headed

    def _line(self, system: System, touch: list[Lying], k: int, state: Long) -> Any:
        """The only direction in which a contact can slide, or None: there are two."""
        modes = [OPEN for _ in touch]
        ways = frame_of(touch[k].normal)[1:]
        free = self.solved(state, system, touch, modes).slide[k]
        systems = [self.pushed(state, system, touch[k], k, way) for way in ways]
        pushed = [self.solved(state, each, touch, modes).slide[k] for each in systems]
        G = np.array([[float(e @ (slide - free)) for slide in pushed] for e in ways])
        values, vectors = np.linalg.eigh((G + G.T) / 2)
        return None if values[0] > _LINE * values[1] else long(vectors[:, 1]) @ ways

    def _margin(
        self, modes: Sequence[Mode], closed: Sequence[bool], touch: list[Lying], found: Found,
        aims: Sequence[Long] | None,
    ) -> float:  # fmt: skip
        """Least margin of all inequalities, relative; negative: one is broken."""
        margins = [np.inf]
        size = float(np.abs(found.force).max()) or 1.0
        fast = float(np.abs(found.slide).max()) or 1.0
        for k, (mode, t) in enumerate(zip(modes, touch, strict=True)):
            if not closed[k]:
                continue
            if mode.kind == "open":
                curved = t.normal_rate @ t.slide if aims is None else -aims[k][0]
                margins.append(float(t.normal @ found.slide[k] + curved) / fast)
                continue
            N = t.normal @ found.force[k]
            margins.append(float(N) / size)
            if mode.kind == "stick":
                held = size_of(found.force[k] - N * t.normal)
                margins.append(float(self.pairs[k].friction * N - held) / size)
            elif mode.heading is not None:
                margins.append(float(mode.heading @ found.slide[k]) / fast)
        return min(margins)


def root(value: Callable[[Any], Any], low: Any, high: Any, at_low: Any, at_high: Any) -> Any:
    """Zero of a value between two places, by the Illinois method."""
    if at_low == 0:
        return low
    for _ in range(60):
        middle = high - at_high * (high - low) / (at_high - at_low)
        at = value(middle)
        if at == 0 or min(abs(middle - high), abs(high - low)) < 1e-19 * max(1, abs(high)):
            return middle
        if (at > 0) == (at_high > 0):
            at_low = at_low / 2
        else:
            low, at_low = high, at_high
        high, at_high = middle, at
    return high
