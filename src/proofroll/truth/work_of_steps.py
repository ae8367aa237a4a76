"""Work of drives along the steps of a route whose powers are known at any state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.laws.integrals import POINTS, TO_SERIES
from proofroll.truth.numerics.hybrid import DenseStep
from proofroll.truth.work_of_drives import WorkAlong

_RESOLVED = 1e-13  # last coefficients of powers, relative to the largest, that are round-off
_HALVINGS = 20

_Powers = tuple[Array, Array]  # times [s] and powers [W] at the points of a window


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
        rough = (left > _RESOLVED * series.max()) & falls & (not last)
        parts += [(moments, values) for moments, values, again in zip(time, power, rough, strict=True) if not again]
        again = [window._replace(left=rest) for window, rest, more in zip(windows, left, rough, strict=True) if more]
        windows = [half for window in again for half in window.halves()]
    if parts:
        parts.sort(key=lambda part: float(part[0][0]))
        time, power = unit * np.array([moments for moments, _ in parts]), np.array([values for _, values in parts])
        works.add(0, time, np.broadcast_to((time[:, -1:] - time[:, :1]) / 2, time.shape), power)
    stretches = [0] * len(times)
    return works.at(times, stretches), works.unresolved(times, stretches)
