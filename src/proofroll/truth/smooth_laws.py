"""Law check of a smooth motion: pieces of each route's steps, spread over the run, held against the laws of mechanics.

Each route keeps its steps; a few of them are taken again to have states inside. A law that is wrong is wrong at all
times, so that a selection finds it at a cost that does not grow with the run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from proofroll.core.dop853 import controlled_step, solver_from
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.link_forces import working
from proofroll.elements.mechanism.dynamics.named_forces import named_forces
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.error_bars import on_same_turns
from proofroll.truth.laws.check import LawCheck, LawVerdict, verdict
from proofroll.truth.laws.integrals import COUNT, POINTS, TO_SERIES
from proofroll.truth.laws.record import Pieces, without_contacts
from proofroll.truth.work_of_drives import WorkAlong

_PIECES = 2  # of a route: they cost a tenth of a truth of few samples
_RESOLVED = 1e-13  # last coefficients of states, relative to the largest, that are round-off
_HALVINGS = 20
_LOOSE = 1e-3  # tolerance of a step that is taken again: it was accepted
_TURN = 1.0  # rad, in which rotations are polynomials of eleven degrees to the last digit

_Powers = tuple[Array, Array]  # times [s] and powers [W] at the points of a window


class KeptStep(NamedTuple):
    """A step of an integrator.

    Attributes:
        start, end: [s].
        inside: times within it [s] -> states, (times, state); it may take the step again.
    """

    start: float
    end: float
    inside: Callable[[Array], Array]


class KeptRoute(NamedTuple):
    """Steps of a route, and what they say.

    Attributes:
        steps: in order of time.
        recorded: times [s] and states (times, state) -> record.
        spin: state -> largest angular velocity of a body [rad/s].
        powers: times [s] and states -> power of each of :func:`.working` [W], (times, drives); None: not asked of it.
        coarse: True if states inside steps have fewer digits than at their ends.
    """

    steps: Sequence[KeptStep]
    recorded: Callable[[Array, Array], Record]
    spin: Callable[[Array], float]
    powers: Callable[[Array, Array], Array] | None = None
    coarse: bool = False


class _Window(NamedTuple):
    """A part of a step, and the last coefficients of the powers in the window that it is a half of [W]."""

    step: KeptStep
    start: float
    end: float
    left: float = np.inf

    def halves(self) -> tuple[_Window, _Window]:
        """Both of its halves."""
        middle = (self.start + self.end) / 2
        return self._replace(end=middle), self._replace(start=middle)


def dense_steps(
    rates: Callable[[float, Array], Array], visited: Sequence[tuple[float, Array]], last: float
) -> list[KeptStep]:
    """Steps of DOP853 with their dense output, from times [s] and states before them; ``last``: end of the last [s]."""

    def inside(begun: tuple[float, Array], end: float, times: Array) -> Array:
        solver = solver_from(rates, *begun, _LOOSE, _LOOSE, end - begun[0])
        controlled_step(solver, None, end)
        return np.asarray(solver.dense_output()(times)).T

    ends = [*(time for time, _ in visited[1:]), last][: len(visited)]
    return [KeptStep(begun[0], end, partial(inside, begun, end)) for begun, end in zip(visited, ends, strict=True)]


def law_check(mechanism: Mechanism, routes: Mapping[str, KeptRoute], counting: str) -> LawVerdict:
    """Verdict of the laws on some pieces of each route, by its name; the mechanism is in SI units.

    ``counting``: name of the route whose coordinates count whole turns; those of the others are put on the same turns.
    """
    scale, checked = natural_scale(mechanism), {}
    for name, route in routes.items():
        check = LawCheck(mechanism, scale.length, scale.rate)
        if (pieces := _pieces(mechanism, route, routes[counting])) is not None:
            check.take(pieces)
        checked[name] = check.residuals
    return verdict(checked)


def works_along(mechanism: Mechanism, route: KeptRoute, times: Array) -> tuple[Array, Array]:
    """Work of drives along a route's steps at times [s], (times, drives), and what is not resolved of it [J], (drives).

    It is integrated over all steps, halved until their points resolve the powers, or a half does it no better than the
    whole: then the rest is round-off.
    """
    scale = natural_scale(mechanism)
    works = WorkAlong(mechanism, scale.length, scale.rate)
    if route.powers is not None and working(mechanism):
        windows, parts = (
            [_Window(step, step.start, step.end) for step in route.steps if step.end > step.start],
            list[_Powers](),
        )
        for last in [False] * _HALVINGS + [True]:
            time = np.array([window.start + (window.end - window.start) * (POINTS + 1) / 2 for window in windows])
            states = [window.step.inside(moments) for window, moments in zip(windows, time, strict=True)]
            if not states:
                break
            power = route.powers(time.ravel(), np.concatenate(states)).reshape(*time.shape, -1)
            series = np.abs(np.einsum("kn,snd->skd", TO_SERIES, power))
            left = series[:, -2:].max((1, 2))
            falls = left < np.array([window.left for window in windows]) / 2
            rough = (left > _RESOLVED * series.max()) & falls & (not last)
            parts += [(moments, powers) for moments, powers, again in zip(time, power, rough, strict=True) if not again]
            again = [
                window._replace(left=rest) for window, rest, more in zip(windows, left, rough, strict=True) if more
            ]
            windows = [half for window in again for half in window.halves()]
        parts.sort(key=lambda part: float(part[0][0]))
        time, power = np.array([moments for moments, _ in parts]), np.array([powers for _, powers in parts])
        works.add(0, time, np.broadcast_to((time[:, -1:] - time[:, :1]) / 2, time.shape), power)
    return works.at(times, [0] * len(times)), works.unresolved


def _pieces(mechanism: Mechanism, route: KeptRoute, counting: KeptRoute) -> Pieces | None:
    """Pieces of a route, spread over its steps, on the turns of another one; None: it has no step."""
    steps = [step for step in route.steps if step.end > step.start]
    if not steps:
        return None
    ends, last = np.array([step.end for step in steps]), steps[-1].end
    marks = np.searchsorted(ends, last * np.arange(_PIECES) / _PIECES, side="right")
    chosen = [steps[min(int(number), len(steps) - 1)] for number in dict.fromkeys(marks.tolist())]
    windows = [_window(step, route.spin) for step in chosen]
    times, states = (np.concatenate([window[k] for window in windows]) for k in (0, 1))
    record = route.recorded(times, states)
    if route is not counting and counting.steps:
        record = on_same_turns(mechanism, _at(counting, times), record)
    return _stated(mechanism, record, len(windows), coarse=route.coarse)


def _at(route: KeptRoute, times: Array) -> Record:
    """Record of a route at times [s], from within its steps; behind its end that of its last step's end."""
    numbers = np.searchsorted([step.end for step in route.steps[:-1]], times)
    states = [np.empty(0)] * len(times)
    for number in np.unique(numbers):
        step, places = route.steps[int(number)], np.flatnonzero(numbers == number)
        inside = step.inside(np.clip(times[places], step.start, step.end))
        for place, state in zip(places, inside, strict=True):
            states[int(place)] = state
    return route.recorded(times, np.array(states))


def _window(step: KeptStep, spin: Callable[[Array], float]) -> tuple[Array, Array]:
    """Times of the points of a piece at the start of a step [s], short enough that these resolve it, and states."""
    start, length = step.start, step.end - step.start
    for _ in range(_HALVINGS):
        times = start + length * (POINTS + 1) / 2
        states = step.inside(times)
        series = np.abs(TO_SERIES @ states)
        turned = length * max(spin(states[0]), spin(states[-1]))
        if (
            turned <= _TURN
            and (series[-2:] <= _RESOLVED * np.maximum(series.max(axis=0), series.max() * _RESOLVED)).all()
        ):
            break
        length /= 2
    return times, states


def _stated(mechanism: Mechanism, record: Record, count: int, coarse: bool) -> Pieces:
    """Pieces from a record at their points."""
    shape = count, COUNT
    bodies, joints = len(mechanism.bodies), len(mechanism.joints)
    poses = {name: np.zeros((*shape, bodies + 1, 3)) for name in ("p", "v", "w")}
    for name, values in (("p", record.p_WB), ("v", record.v_WB), ("w", record.w_WB)):
        poses[name][..., :-1, :] = values.reshape(*shape, bodies, 3)
    time = record.time.reshape(shape)
    stated = {"effort": np.zeros((*shape, len(mechanism.actuators)))}
    stated |= {"coupling": np.zeros((*shape, len(mechanism.couplings))), "drive": np.zeros((*shape, joints))}
    for item, values in zip(named_forces(mechanism), record.named.T, strict=True):
        if item.field in stated:
            stated[item.field][..., item.number] = values.reshape(shape)
    turns = np.zeros((*shape, joints, 2))
    for number, (joint, columns) in enumerate(zip(mechanism.joints, mechanism.q_slices, strict=True)):
        if joint.nq in {1, 2}:
            turns[..., number, : joint.nq] = record.q[:, columns].reshape(*shape, joint.nq)
    return without_contacts(
        mechanism,
        time,
        pace=np.broadcast_to((time[:, -1:] - time[:, :1]) / 2, shape),
        **poses,
        R=record.placed(mechanism).R_WB.reshape(*shape, bodies + 1, 3, 3),
        loop=record.wrench[:, joints:].reshape(*shape, len(mechanism.loops), 6),
        turns=turns,
        coarse=coarse,
        **stated,
    )
