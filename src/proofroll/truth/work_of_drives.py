"""Work of drives along a route: integrals of power over its pieces or steps, and impulses times rates at impacts.

It is a property of the motion: the samples of a user have no part in it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.link_forces import working, working_joints
from proofroll.truth.check.laws.integrals import POINTS, RESOLVED, TO_SERIES, integral, tail
from proofroll.truth.check.laws.record import Array, Passage
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiles import Tiles
from proofroll.truth.numerics.hybrid import DenseStep

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism

_BESIDE = 1 + 1e-9  # place just beyond the end of a piece, where its time is known, too
_HALVINGS = 20  # of a step into windows, at most

_Powers = tuple[Array, Array]  # times [s] and powers [W] at the points of a window


class _Part(NamedTuple):
    """Work on a part of a stretch: series of time [s] and work [J] by a variable from -1 to 1.

    ``unresolved``: part of the work up to the end that points do not resolve [J], (drives).
    """

    stretch: int
    start: float
    end: float
    time: Array
    work: Array
    unresolved: Array

    def at(self, time: float) -> Array:
        """Work of each drive at a time [s]."""
        if time <= self.start:
            return np.asarray(chebyshev.chebval(-1.0, self.work))
        if time >= self.end:
            return np.asarray(chebyshev.chebval(1.0, self.work))
        from scipy.optimize import brentq

        place = brentq(lambda x: chebyshev.chebval(x, self.time) - time, -_BESIDE, _BESIDE, xtol=4 * np.spacing(1.0))
        return np.asarray(chebyshev.chebval(place, self.work))


class WorkAlong:
    """Work of each of :func:`.working` along one route since the start [J]."""

    def __init__(self, mechanism: Mechanism, length: float, rate: float) -> None:
        """Takes a mechanism in SI units with its natural length [m] and rate [1/s]."""
        self._scene, self._drives = LawScene(mechanism, length, rate), [item for _, item in working(mechanism)]
        self._joints = [mechanism.joint_index[name] for name in working_joints(mechanism)]
        self._total, self._parts = np.zeros(len(self._drives)), list[_Part]()
        self._unresolved = np.zeros(len(self._drives))
        self._last: tuple[float, Array] | None = None  # time and power of the last point

    def take(self, tiles: Tiles) -> None:
        """Adds the tiles of a stretch, and the mean power between them and the last ones."""
        if tiles.drives.size:
            rates = [self._scene.free(joint, tiles)[0].rate for joint in self._joints]
            self.add(int(tiles.stretch[0]), tiles.time, tiles.pace, tiles.drives * np.stack(rates, -1))

    def add(self, stretch: int, time: Array, pace: Array, power: Array) -> None:
        """Adds powers [W], (pieces, points, drives), at points of pieces of a stretch."""
        summed, unresolved = integral(power, pace), tail(power, pace)[:, 0]
        for moments, powers, work, rest in zip(time, power, summed, unresolved, strict=True):
            start, end = float(moments[0]), float(moments[-1])
            self._over_a_gap(stretch, start, powers[0])
            work_series = TO_SERIES @ (self._total + work)
            self._total = self._total + work[-1]
            self._unresolved = self._unresolved + rest
            self._parts.append(
                _Part(
                    stretch=stretch,
                    start=start,
                    end=end,
                    time=TO_SERIES @ moments,
                    work=work_series,
                    unresolved=self._unresolved,
                )
            )
            self._last = end, powers[-1]

    def passes(self, passage: Passage, impulses: Mapping[int, float]) -> None:
        """Adds the work of impulses of driven joints, by their numbers; an effort is finite and has none."""
        for k, (drive, joint) in enumerate(zip(self._drives, self._joints, strict=True)):
            if drive.field == "drive" and joint in impulses:
                sides = (passage.before, passage.after)
                rate = sum(float(self._scene.free(joint, side)[0].rate[0, 0]) for side in sides) / 2
                # a joint that a motion holds at rest does no work, whatever its impulse
                self._total[k] += impulses[joint] * rate if rate else 0.0

    def at(self, times: Array, stretches: Sequence[int]) -> tuple[Array, Array]:
        """Work at times [s] in stretches, and the part of it that points of pieces do not resolve [J].

        Both have the shape (times, drives).
        """
        none, parts = np.zeros(len(self._drives)), zip(times.tolist(), self._parts_at(times, stretches), strict=True)
        values = [(none, none) if part is None else (part.at(time), part.unresolved) for time, part in parts]
        works, rests = np.array(values).reshape(len(times), 2, len(none)).swapaxes(0, 1)
        return works, rests

    def _parts_at(self, times: Array, stretches: Sequence[int]) -> list[_Part | None]:
        """Part that holds each time [s] in a stretch, or the nearest; None: there is none."""
        parts = list[_Part | None]()
        for time, stretch in zip(times.tolist(), stretches, strict=True):
            last = [part for part in self._parts if part.stretch <= stretch]
            inside = [part for part in last if part.stretch == stretch] or last
            parts.append(next((part for part in reversed(inside) if part.start <= time), inside[0] if inside else None))
        return parts

    def _over_a_gap(self, stretch: int, time: float, power: Array) -> None:
        """Adds the mean of the powers on both sides of a gap, as in the last instants of a slip."""
        if self._last is None or not time > self._last[0]:
            return
        (begun, last_power), ended = self._last, self._total
        span = time - begun
        self._total = ended + span * (last_power + power) / 2
        self._unresolved = self._unresolved + span * np.abs(last_power - power) / 2
        line = np.array([[1.0, 1.0], [-1.0, 1.0]]) / 2
        self._parts.append(
            _Part(
                stretch=stretch,
                start=begun,
                end=time,
                time=np.array([(begun + time) / 2, span / 2]),
                work=line @ np.array([ended, self._total]),
                unresolved=self._unresolved,
            )
        )
        self._last = time, power


class _Window(NamedTuple):
    """A part of a step, and the last coefficients of the powers in the window that it is a half of [W]."""

    step: DenseStep
    start: float
    end: float
    left: float = np.inf

    def halves(self) -> tuple[_Window, _Window]:
        """Both of its halves."""
        middle = (self.start + self.end) / 2
        return self._replace(end=middle), self._replace(start=middle)


def works_of_steps(
    mechanism: Mechanism, steps: Sequence[DenseStep], powers: Callable[[Array], Array], times: Array, unit: float = 1.0
) -> tuple[Array, Array]:
    """Work of drives along steps at times [s], and what is not resolved of it [J], each (times, drives).

    It is integrated over all steps before the last time, halved until their points resolve the powers, or a half does
    it no better than the whole: then the rest is round-off.

    Args:
        mechanism: in SI units.
        steps: in units of time of a ``unit`` [s].
        powers: states, (states, n) -> power of each of :func:`.working` [W], (states, drives).
        times: [s].
        unit: of time of the steps [s].
    """
    scale = natural_scale(mechanism)
    works = WorkAlong(mechanism, scale.length, scale.rate)
    windows, parts = [_Window(step, *step[:2]) for step in steps if unit * step[0] < times[-1]], list[_Powers]()
    for last in [False] * _HALVINGS + [True]:
        if not windows or not working(mechanism):
            break
        time = np.array([window.start + (window.end - window.start) * (POINTS + 1) / 2 for window in windows])
        states = [window.step[2](moments).T for window, moments in zip(windows, time, strict=True)]
        power = powers(np.concatenate(states)).reshape(*time.shape, -1)
        series = np.abs(np.einsum("kn,snd->skd", TO_SERIES, power))
        left = series[:, -2:].max((1, 2))
        falls = left < np.array([window.left for window in windows]) / 2
        rough = (left > RESOLVED * series.max()) & falls & (not last)
        parts += [(moments, values) for moments, values, again in zip(time, power, rough, strict=True) if not again]
        again = [window._replace(left=rest) for window, rest, more in zip(windows, left, rough, strict=True) if more]
        windows = [half for window in again for half in window.halves()]
    if parts:
        parts.sort(key=lambda part: float(part[0][0]))
        time, power = unit * np.array([moments for moments, _ in parts]), np.array([values for _, values in parts])
        works.add(0, time, np.broadcast_to((time[:, -1:] - time[:, :1]) / 2, time.shape), power)
    return works.at(times, [0] * len(times))
