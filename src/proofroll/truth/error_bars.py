"""Motion by two routes with its error bars, which all truths of a mechanism give, and its early end.

That is the earliest of its routes' failures and of broken checks, with its reason. Records are made comparable.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from proofroll.core.bounces import Bounce
from proofroll.core.errors import Diverged, Refused
from proofroll.core.events import Event
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.dynamics.link_forces import link_values
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.check.laws.tiles import Tiles
from proofroll.truth.numerics.hybrid import HybridPath, Stretch

if TYPE_CHECKING:
    from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
    from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates

_Path = HybridPath[Stretch[ContactMode]]
_T = TypeVar("_T")
_TIME = re.compile(r" (?:at|near|by|before) t = [\d.e+-]+ s\b")  # of a failure, in its message
NUDGE = float(np.finfo(float).eps)  # m, rad, part of velocities: the smallest difference that a scene file can express
SAME_START = 1e-9  # m, 1: round-off of positions is 1e-15 of them, the error of a wrong formula far larger
ROUND_OFF = 16 * float(np.finfo(float).eps)  # relative round-off after some ten operations
JUDGED = ("p_WB", "v_WB", "q_WB", "w_WB", "q", "v", "wrench", "named")


class Routed(NamedTuple):
    """Motion of one route at some times.

    Attributes:
        record: the motion.
        works: work of drives since the start [J], (times, drives).
        pressed: contact forces [N], moments against turning [N m] and normal forces [N] where components of a force are
            not determinate, (times, contacts, 7); None: no contacts.
        sums: sums of the forces [N], (times, sums, 3); None: as ``pressed``.
    """

    record: Record
    works: Array
    pressed: Array | None = None
    sums: Array | None = None


@dataclass(frozen=True)
class TwoRouteMotion:
    """Motion taken as the truth, with its accuracy.

    Attributes:
        record: the motion; after the horizon its error bars are large.
        bars: error bar of each field of the record, of ``points``, ``energy`` and ``drift`` at each time: the
            largest over bodies, components and earlier times, in the field's unit, (times).
        differences: largest difference between the two routes, by field, up to the horizon.
        horizon: time from which the question is ill-posed, s; inf: after the last time.
        branches: times, s, at which a motion known in closed form passes singular poses of its loops.
        determinate: mask of determinate components of the wrenches, (joints + loops, 6).
        routes: names of the routes, the one of the record first.
        checked_by: title of a closed form for a part of the motion, and its largest difference from the record.
        events: switches along the motion.
        borders: times of all changes of what acts [s], also where a contact passes from a face to an edge.
        reason: cause why the question is ill-posed from the horizon on.
        end: time from which the motion is not known, s; the record ends before it; inf: it reaches all times asked for.
        ended: reason why it ends there, as a clause.
        pressed: as of :class:`Routed`, on the first bodies, NaN where not determinate.
        sums: sums of the forces, (times, sums, 3); None: as ``pressed``.
        works: work of drives since the start [J], (times, drives).
        laws: outcome of the law check, as a clause; empty: it ended the motion, or there was none.
        tiles: poses and velocities in all pieces of the route of the record; None: there are none.
        between: motion and forces in the middle of each of its stretches; None: nothing switches.
    """

    record: Record
    bars: dict[str, Array]
    differences: dict[str, float]
    horizon: float
    branches: list[float]
    determinate: NDArray[np.bool_]
    routes: tuple[str, ...]
    checked_by: tuple[str, float] | None
    events: Sequence[Event] = ()
    borders: Sequence[float] = ()
    reason: str = f"a start moved by {NUDGE:.1g} leads elsewhere: the motion is chaotic"
    pressed: Array | None = None
    end: float = np.inf
    ended: str = ""
    sums: Array | None = None
    bounces: Sequence[Bounce] = ()
    works: Array | None = None
    laws: str = ""
    tiles: Tiles | None = None
    between: Routed | None = None


def fields_with_bars(mechanism: Mechanism, record: Record) -> dict[str, Array]:
    """Fields with an error bar: those of the record, and what follows from them, as energy."""
    placed = record.placed(mechanism)
    fields = {name: getattr(record, name) for name in JUDGED}
    return fields | {"points": placed.points, "energy": placed.energy(), "links": link_values(placed)}


def round_off(fields: Mapping[str, Array], placed: Placed) -> dict[str, Array]:
    """Round-off of fields at each time, from the largest value so far; of energy from its parts, which may cancel."""
    sizes = {name: largest(values) for name, values in fields.items()}
    sizes["energy"] = np.abs(placed.energies()).sum(axis=-1)
    return {name: ROUND_OFF * np.maximum.accumulate(size) for name, size in sizes.items()}


def check_start(tree: JointCoordinates, bodies: MaximalCoordinates, unit: float = 1.0) -> None:
    """Checks that both routes place all bodies alike at the start, where only their formulas matter.

    Lengths of the routes are in a ``unit`` [m].

    Raises:
        Refused: the routes place a body apart.
    """
    start_time = np.zeros(1)
    record, second_record = record_of(start_time, [tree.sample(*tree.mechanism.start())]), bodies.at_start()
    second_record = on_same_turns(tree.mechanism, record, second_record)
    apart = unit * max(
        float(largest(getattr(record, name) - getattr(second_record, name))[0]) for name in ("p_WB", "q_WB")
    )
    if apart > SAME_START * unit * max(1.0, float(largest(record.p_WB)[0])):
        raise Refused(
            f"the two routes place the bodies {apart:.3g} m (or 1, of quaternions) apart at t = 0 s, where nothing has "
            "moved yet: an error of proofroll's truth, not a property of the scene; please report it"
        )


def on_same_turns(mechanism: Mechanism, guide: Record, record: Record) -> Record:
    """Record with quaternions of the same sign and angles on the same turn as in ``guide``."""
    q_WB = _same_sign(guide.q_WB, record.q_WB)
    q = record.q.copy()
    for joint, columns in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.kind in WITH_QUATERNION:
            quaternion = slice(columns.stop - 4, columns.stop)
            q[:, quaternion] = _same_sign(guide.q[:, quaternion], q[:, quaternion])
        elif joint.kind in {JointKind.REVOLUTE, JointKind.CYLINDRICAL, JointKind.UNIVERSAL, JointKind.PLANAR}:
            angles = columns if joint.kind == JointKind.UNIVERSAL else slice(columns.stop - 1, columns.stop)
            q[:, angles] += 2 * np.pi * np.round((guide.q[:, angles] - q[:, angles]) / (2 * np.pi))
    return replace(record, q_WB=q_WB, q=q)


def _same_sign(best: Array, quaternions: Array) -> Array:
    return np.where((best * quaternions).sum(axis=-1, keepdims=True) < 0, -quaternions, quaternions)


def differences_of(values: Array, others: Array) -> Array:
    """Largest difference between values of two routes at each time, (times); inf where only the first knows one."""
    difference = np.where(np.isnan(others) & ~np.isnan(values), np.inf, others - values)
    return largest(difference)


def bar_of(difference: Array, unseen: Array, *, alone: bool = False) -> Array:
    """Error bar of a field at each time, (times,): never smaller than before, but for one sample of ``alone``.

    Args:
        difference: of both routes, (times,).
        unseen: errors that the difference leaves out, (times,).
        alone: True for forces, which one time can have to itself: then the difference of one sample does not last.
    """
    lasting = np.minimum(difference, [*difference[:1], *difference[:-1]]) if alone else difference
    return np.asarray(np.maximum(SAFETY * difference + unseen, np.maximum.accumulate(SAFETY * lasting + unseen)))


def largest(values: Array) -> Array:
    """Largest absolute value at each time, without NaN, (times)."""
    flat = np.abs(values.reshape(len(values), -1))
    return np.asarray(np.where(np.isnan(flat), 0.0, flat).max(axis=1, initial=0.0), dtype=np.float64)


class EarlyEnd:
    """Earliest time from which a motion is not known, and why.

    Attributes:
        time: [s]; inf: none.
        reason: a clause without that time.
    """

    def __init__(self) -> None:
        self.time, self.reason = float(np.inf), ""

    def at(self, time: float, reason: str) -> None:
        """Records an end, unless an earlier one is known; times in the reason are left out, for the end has one."""
        if time < self.time:
            self.time, self.reason = time, _TIME.sub("", reason)

    def known(self, times: Array) -> Array:
        """Times of rising ones [s] that lie before the end.

        Raises:
            Diverged: there is none.
        """
        if not times[0] < self.time:
            raise Diverged(self.reason, self.time)
        return np.asarray(times[times < self.time])

    def run(self, route: Callable[[Array], _T], times: Array) -> _T:
        """Result of a route at the known ones of some times [s]; where it fails is an end.

        Raises:
            Diverged: none of these times is known, or the route fails at a time that it does not tell.
        """
        while True:
            try:
                return route(self.known(times))
            except Diverged as stopped:
                if stopped.time is None or not 0.0 < stopped.time < self.time:
                    raise
                self.at(stopped.time, str(stopped))


def cut_at(path: _Path, end: float, text: str) -> _Path:
    """Path up to a time, and the reason why it ends there."""
    kept = [stretch for stretch in path.stretches if stretch.start < end]
    last = kept[-1]
    if last.end > end:
        kept[-1] = replace(last, end=end, guard=None)
    return replace(
        path,
        stretches=tuple(kept),
        happenings=tuple(item for item in path.happenings if item.time < end),
        margins=tuple(item for item in path.margins if item[0] < end),
        known=False,
        ended=text,
        transitions=path.transitions[: len(kept)],
    )


def cut_motion(motion: TwoRouteMotion, end: float, text: str) -> TwoRouteMotion:
    """Motion before a time [s], and the reason why it ends there.

    Raises:
        Refused: no sample lies before it.
    """
    count = int(np.sum(motion.record.time < end))
    if not count:
        raise Refused(text)

    def first(values: Array | None) -> Array | None:
        return None if values is None else values[:count]

    return replace(
        motion,
        record=motion.record.first(count),
        bars={name: bar[:count] for name, bar in motion.bars.items()},
        events=tuple(event for event in motion.events if event.time < end),
        bounces=tuple(bounce for bounce in motion.bounces if bounce.time < end),
        end=end,
        ended=text,
        laws="",
        pressed=first(motion.pressed),
        sums=first(motion.sums),
        works=first(motion.works),
    )
