"""Truth of a motion without switches: two routes that share no kinematics, with their difference as an error bar.

Routes: separate bodies (Taylor series in long doubles, or DOP853), joint coordinates (compiled collocation, or DOP853
with projection), both by implicit collocation if dampers are stiff, and closed forms if known. The best of them is the
truth, the others give its error bar. If in both routes a start displaced by :data:`NUDGE` leads farther away than
:data:`CHAOS`, the question is ill-posed; the time of that is the horizon. A route that changes the energy of a
conservative mechanism has failed, and shows no chaos.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from proofroll.core.arrays import uneven
from proofroll.core.errors import Diverged, Refused
from proofroll.core.pace import PACE, OutOfTime
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.analysis import RowSign, analyse, singular_values
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.link_forces import powers, working
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import BESIDE, MaximalCoordinates
from proofroll.truth.check.held_to_laws import of_bodies, of_tree, tiles_of
from proofroll.truth.error_bars import (
    NUDGE,
    EarlyEnd,
    Routed,
    TwoRouteMotion,
    check_start,
    differences_of,
    fields_with_bars,
    largest,
    on_same_turns,
)
from proofroll.truth.followed_paths import FollowedPath, before_first, end_of, followed, time_accuracy, two_route_motion
from proofroll.truth.natural_units import Units, natural_units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch
from proofroll.truth.smooth.smooth_routes import SmoothBodies, SmoothTree, stiff
from proofroll.truth.witnesses.closed_forms import ClosedForm, closed_form
from proofroll.truth.work_of_drives import works_of_steps

CHAOS = 1e-9  # m, 1 (quaternions): a larger distance between motions with indistinguishable starts is chaos
BRANCH = 1e-3  # natural lengths, 1: distance between routes that chaos causes only long after the horizon
ENERGY = 1e-8  # change of energy relative to its parts, a thousand times that of routes through chaos, 1e-11
_FORM_STEP = 1.0  # length of parts of a closed form at most, in natural units
_WITNESS_STEP = 2.0**-7  # length of the equal steps of a closed form's witness at most, in natural units
_POSE_STEP = 2.0**-6  # length of steps that look for singular poses at most, in natural units
_SINGULAR = 1e-3  # least singular value of rows relative to the largest, below which a pose counts as singular
_END = 1e-6  # accuracy of the time from which a route is wrong, relative to it
_MOST_STEPS = 20_000  # of either, above which they are longer


def find_truth(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at rising times, s, up to its end; the first may be 0.

    Raises:
        Refused: fewer than two routes cover the mechanism, or none of the times; the text says why.
    """
    if mechanism.unmodelled:
        raise Refused(f"no route of the truth has {', '.join(mechanism.unmodelled)}")
    units = natural_units(mechanism)
    with units.errors_in_seconds():
        return _SmoothTruth(mechanism, units, np.asarray(times, dtype=float)).found()


class _SmoothTruth:
    """Truth of one mechanism at some times [s]; what is not in SI units is in natural ones."""

    def __init__(self, mechanism: Mechanism, units: Units, times: Array) -> None:
        self._mechanism, self._units, self._seconds = mechanism, units, times
        scaled, self._times = units.mechanism(mechanism), times / units.time
        self._until = float(self._times[-1])
        dynamics, self._second = ContactDynamics(scaled), MaximalCoordinates(scaled)
        self._equations = dynamics.equations
        self._form = closed_form(mechanism)
        self._scaled_form = closed_form(scaled)
        implicit = stiff(self._equations, self._until)
        self._tree = SmoothTree(dynamics, implicit)
        self._bodies = SmoothBodies(ContactEquations(scaled, self._second.lean), self._second, implicit)

    @property
    def _exact(self) -> ClosedForm | None:
        """Closed form of the whole motion."""
        return self._form if self._form is not None and self._form.motion is not None else None

    def found(self) -> TwoRouteMotion:
        """The truth.

        Raises:
            Refused: no time is known.
        """
        if self._exact is None and analyse(self._mechanism).singular_start:
            raise Refused("the start is a singular pose, where the motion may branch, and no closed form is known")
        if self._exact is not None:
            _moves_of(self._exact, self._seconds)  # they are finite
        check_start(self._equations, self._second, self._units.length)
        try:
            return self._by_routes_or_form()
        except Diverged as stopped:
            if stopped.time is not None and 0.0 < stopped.time <= self._times[0]:
                raise before_first(stopped.time, self._reason(stopped.time, str(stopped))) from None
            if self._exact is not None:
                raise
            raise Refused(f"no truth beyond the start: {stopped}") from None

    def _by_routes_or_form(self) -> TwoRouteMotion:
        """Motion that two routes follow, or in closed form where they fail and there is one.

        Raises:
            Diverged: none of the times is known.
        """
        try:
            motion = self._by_routes()
        except Diverged:
            if self._exact is None:
                raise
            return self._by_form(self._exact)
        return motion if self._exact is None or np.isinf(motion.end) or PACE.over else self._by_form(self._exact)

    def _by_routes(self) -> TwoRouteMotion:
        """Motion that two routes follow, up to the first failure of either.

        Raises:
            Diverged: none of the times is known.
        """
        units, early, form = self._units, EarlyEnd(), self._exact
        paths = followed(self._tree, self._bodies, self._until, (), smooth=True)
        early.at(*self._end_of(paths))
        if form is not None and np.isfinite(early.time) and not PACE.over:
            raise Diverged(early.reason, early.time)  # the closed form goes on
        growth, near = early.run(partial(self._nearby, paths[1]), self._times)
        chaotic = growth * NUDGE > CHAOS
        beside = early.run(partial(self._tree_beside, paths[0]), self._times) if chaotic.any() else None

        def sampled(times: Array) -> tuple[Record, Record, Record, Array]:
            """Motion of both routes at known times, neighbouring one of the second, growth to one of the first."""
            growth = np.full(len(times), np.inf) if beside is None else self._growth_of_tree(beside, paths[0], times)
            nearby = self._in_seconds(self._second.recorded(times, near[np.searchsorted(self._times, times)]))
            return self._tree_at(paths[0], times), self._bodies_at(paths[1], times), nearby, growth

        known = early.known(self._times)
        count = PACE.fitting(known, sampled)
        if count < len(known):
            early.at(float(known[count]), PACE.reason)
        times = known[:count]
        by_tree, by_bodies, nearby, growth = sampled(times)
        chaotic = chaotic[:count] & (growth * NUDGE > CHAOS)
        by_bodies = on_same_turns(self._mechanism, by_tree, by_bodies)
        self._check_energy(by_tree, "joint coordinates", early, partial(self._tree_at, paths[0]))
        self._check_energy(by_bodies, "maximal coordinates", early, partial(self._bodies_beside, paths[1], by_tree))
        self._check_branch(by_tree, by_bodies, chaotic, early, paths)
        count = len(early.known(self._times))
        by_tree, by_bodies = by_tree.first(count), by_bodies.first(count)
        best, nearby = by_bodies, on_same_turns(self._mechanism, by_bodies, nearby.first(count))
        left = _apart_in_fields(self._mechanism, by_bodies, nearby, NUDGE / BESIDE)
        works, unresolved = self._works(paths[1], [by_bodies, by_tree])
        names: tuple[str, ...]
        names = f"maximal coordinates, {self._bodies.integrators}", f"joint coordinates, {self._tree.integrators}"
        branches = list[float]()
        if form is not None:
            best = on_same_turns(self._mechanism, by_tree, self._from_form(form, by_tree.time))
            left = _apart_in_fields(self._mechanism, by_bodies, best)
            names = (f"closed form: {form.title}", *names)
            branches = self._branches()
        late = np.flatnonzero(chaotic[:count])
        motion = two_route_motion(
            self._mechanism,
            paths,
            (Routed(best, works), Routed(by_tree, works)),
            names,
            TwoRouteMotion.reason,
            units,
            unresolved=unresolved,
            left=left,
            chaotic_from=float(self._seconds[late[0]]) if len(late) else np.inf,
        )
        return replace(
            motion,
            end=early.time * units.time,
            ended=units.text_in_seconds(self._reason(early.time, early.reason)),
            checked_by=self._checked_by(best),
            branches=branches,
            # the published motion is that of the second route, or of a closed form, which it follows within the bar
            tiles=tiles_of(
                of_bodies(self._mechanism, units, self._bodies, self._second, paths[1]), float(self._times[count - 1])
            ),
        )

    @staticmethod
    def _end_of(paths: tuple[FollowedPath, FollowedPath]) -> tuple[float, str]:
        """Time at which a path ends, and why; where both end, the first route says more than that series stop."""
        end, reason = end_of(paths)
        by_tree = paths[0]
        alike = not by_tree.known and by_tree.stretches[-1].end <= end + time_accuracy(end)
        return end, by_tree.ended if alike else reason

    def _by_form(self, form: ClosedForm) -> TwoRouteMotion:
        """Motion in closed form where routes fail, as far as its witness comes: equal steps in joint coordinates."""
        states, step, seconds = list[Array](), max(_WITNESS_STEP, self._until / _MOST_STEPS), self._seconds
        try:
            PACE.follow("witness", self._until)
            for state in self._equations.rk4_states(self._times, step):
                states.append(state)
        except OutOfTime:
            if not states:
                raise
        finally:
            PACE.leave()
        count = len(states)
        self._times, self._seconds, self._until = self._times[:count], seconds[:count], float(self._times[count - 1])
        witness = self._in_seconds(self._equations.recorded(self._times, states))
        exact = on_same_turns(self._mechanism, witness, self._from_form(form, self._seconds))
        edges = np.linspace(0.0, self._until, int(np.ceil(self._until / _FORM_STEP)) + 1).tolist()
        path, unknown = self._path_of_form([*pairwise(edges)]), np.full((count, len(working(self._mechanism))), np.nan)
        motion = two_route_motion(
            self._mechanism,
            (path, path),
            (Routed(exact, unknown), Routed(witness, unknown)),
            (f"closed form: {form.title}", "joint coordinates, RK4"),
            TwoRouteMotion.reason,
            self._units,
            left=dict.fromkeys(_apart_in_fields(self._mechanism, exact, exact), np.zeros(count)),
        )
        tiles = tiles_of(of_tree(self._mechanism, self._units, self._tree, path), self._until)
        end, ended = (float(seconds[count]), PACE.reason) if count < len(seconds) else (np.inf, "")
        return replace(motion, branches=self._branches(), tiles=tiles, end=end, ended=ended)

    def _branches(self) -> list[float]:
        """Times of singular poses along the closed form [s]."""
        assert self._scaled_form is not None
        poses = singular_poses_of(self._scaled_form, self._equations, self._until)
        return [time * self._units.time for time in poses]

    def _reason(self, end: float, reason: str) -> str:
        """Reason of an early end: the singular pose there, if there is one."""
        step = max(min(_POSE_STEP, end / 200), end / _MOST_STEPS)
        if not reason or not step > 0 or PACE.over:
            return reason
        try:
            poses = singular_poses(self._equations.mechanism, end + 2 * step, step)
        except (Diverged, np.linalg.LinAlgError):  # the step is too large for the motion
            return reason
        return BRANCHING if any(abs(time - end) <= 2 * step for time in poses) else reason

    def _tree_at(self, path: FollowedPath, times: Array) -> Record:
        """Record of the first route at rising times."""
        states = self._tree.within(path.stretches[0], times)
        return self._in_seconds(self._equations.recorded(times, states[:, :-1]))

    def _bodies_at(self, path: FollowedPath, times: Array) -> Record:
        """Record of the second route at rising times."""
        states = self._bodies.within(path.stretches[0], times)
        return self._in_seconds(self._second.recorded(times, states[:, :-1]))

    def _bodies_beside(self, path: FollowedPath, guide: Record, times: Array) -> Record:
        """Record of the second route at rising times, with angles on the turns of a record at the first samples."""
        record = self._bodies_at(path, times)
        near = [np.interp(times, self._times[: len(guide.q)], column) for column in guide.q.T]
        return on_same_turns(self._mechanism, replace(record, q=np.array(near).T), record)

    def _from_form(self, form: ClosedForm, seconds: Array) -> Record:
        """Record of a closed form at times [s]."""
        moves, equations = _moves_of(form, seconds), JointCoordinates(self._mechanism, self._equations.rank)
        return record_of(seconds, [equations.sample(q, v) for q, v in zip(*moves, strict=True)])

    def _in_seconds(self, record: Record) -> Record:
        """Record in SI units, whose times are those that were asked for to the last bit."""
        return replace(self._units.record(self._mechanism, record), time=self._seconds[: len(record.time)])

    def _checked_by(self, best: Record) -> tuple[str, float] | None:
        """Title of a closed form of a part of the motion, and its largest difference from a record."""
        form = self._form
        if form is None or form.motion is not None:
            return None
        return form.title, float(largest(form.part(best.time) - form.same(best)).max())

    def _nearby(self, path: FollowedPath, times: Array) -> tuple[Array, Array]:
        """Growth of the distance to a neighbouring motion of the second route, and the states of that.

        The start is displaced in all directions that the rows allow, by far more than round-off. The growth is a
        multiple of that.

        Raises:
            Diverged: the integration stops.
        """
        lean, stretch = self._second.lean, path.stretches[0]
        start = np.append(lean.beside(stretch.first[:-1], BESIDE), 0.0)
        walked = self._bodies.walk(0.0, start, stretch.mode, float(times[-1]))
        near = self._bodies.within(walked, times)
        apart = np.abs(near - self._bodies.within(stretch, times))[:, : lean.equations.nx].max(axis=1)
        return apart / BESIDE, near[:, :-1]

    def _tree_beside(self, path: FollowedPath, times: Array) -> Stretch[ContactMode]:
        """Neighbouring motion of the first route up to the last of some times."""
        tree, equations, stretch = self._tree, self._equations, path.stretches[0]
        q, v, _ = tree.dynamics.parts(stretch.first)
        ways = BESIDE * uneven(len(v))
        start = np.concatenate([equations.tree.moved(q, ways), v * (1.0 + ways)])
        for _ in range(3):  # Newton's method doubles the number of digits
            start = equations.eliminated(start)
        return tree.walk(0.0, np.append(start, 0.0), stretch.mode, float(times[-1]))

    def _growth_of_tree(self, beside: Stretch[ContactMode], path: FollowedPath, times: Array) -> Array:
        """Growth of that distance of the first route, by the poses of its bodies."""
        states = (self._tree.within(stretch, times)[:, :-1] for stretch in (beside, path.stretches[0]))
        moved, record = (self._equations.recorded(times, values) for values in states)
        return _apart(moved, record) / BESIDE

    def _path_of_form(self, spans: Sequence[tuple[float, float]]) -> FollowedPath:
        """The closed form as a path in joint coordinates, which has these spans as its steps."""
        assert self._scaled_form is not None
        assert self._scaled_form.motion is not None
        motion = self._scaled_form.motion

        def inside(times: Array) -> Array:
            return np.column_stack([*motion(times), times]).T

        begin, last = inside(np.array([0.0, self._until])).T
        stretch = Stretch[tuple[()]](
            start=0.0,
            end=self._until,
            mode=(),
            first=begin,
            last=last,
            guard=None,
            dense=[(start, end, inside) for start, end in spans],
            exact=True,
        )
        return HybridPath(stretches=(stretch,), happenings=(), margins=())

    def _works(self, path: FollowedPath, records: list[Record]) -> tuple[Array, Array]:
        """Work of drives [J], (times, drives), and what is not known of it, at each time.

        Routes whose powers differ by less than a bound have works that differ by less than its integral.
        """
        units, mechanism, times = self._units, self._mechanism, records[0].time
        power = units.force * units.length / units.time

        def powers_at(states: Array) -> Array:
            return self._second.powers(states[:, -1], states[:, :-1]) * power

        works, unresolved = works_of_steps(mechanism, path.stretches[0].dense, powers_at, times, units.time)
        values = [powers(record.placed(mechanism), record.named) for record in records]
        lasting = np.maximum.accumulate(SAFETY * largest(values[1] - values[0])) * np.diff(times, prepend=0.0)
        return works, np.cumsum(lasting) + unresolved.max(axis=1, initial=0.0)

    def _check_energy(self, record: Record, route: str, early: EarlyEnd, record_at: Callable[[Array], Record]) -> None:
        """Ends the truth where a route changes the energy of a conservative mechanism, for then it has failed.

        ``record_at``: record of the route at any times, for an end does not depend on where samples lie.
        """
        mechanism = self._mechanism
        if not mechanism.conservative:
            return
        parts, scale = record.placed(mechanism).energies(), natural_scale(mechanism)
        change = np.abs(parts.sum(axis=1) - parts[0].sum())
        natural = mechanism.mass * (scale.length * scale.rate) ** 2  # a mechanism in balance may have no energy
        allowed = ENERGY * np.maximum(natural, np.maximum.accumulate(np.abs(parts).sum(axis=1)))
        lost = np.flatnonzero(change > allowed)
        most = float(allowed[lost[0] - 1 if len(lost) else -1])

        def loses(time: Array) -> bool:
            return bool(abs(record_at(time).placed(mechanism).energies().sum() - parts[0].sum()) > most)

        count, path_end = len(change), early.time * (1.0 - _END)  # which may lie behind the samples
        if len(lost):
            end = self._first_time(loses, float(self._times[lost[0]]), lost[0])
        elif np.isfinite(path_end) and path_end > self._times[count - 1] and loses(np.array([path_end])):
            end = self._first_time(loses, path_end, count)
        else:
            return
        rows = self._equations.rows(record_at(np.array([end])).q[0])
        values, rank = singular_values(rows.C), self._equations.rank
        at_pose = ", at a singular pose of the loops" if rank and values[rank - 1] < _SINGULAR * values[0] else ""
        early.at(end, f"the route in {route} changes the energy by more than {most:.1g} J{at_pose}")

    def _check_branch(
        self,
        record: Record,
        precise: Record,
        chaotic: NDArray[np.bool_],
        early: EarlyEnd,
        paths: tuple[FollowedPath, FollowedPath],
    ) -> None:
        """Ends the truth where two routes part without chaos, for then they have taken different branches."""
        unit = self._units.length
        parted = np.flatnonzero((_apart(record, precise, unit) > BRANCH) & ~chaotic)
        if len(parted):

            def apart(time: Array) -> bool:
                by_tree, by_bodies = self._tree_at(paths[0], time), self._bodies_at(paths[1], time)
                return bool(_apart(by_tree, on_same_turns(self._mechanism, by_tree, by_bodies), unit)[0] > BRANCH)

            end = self._first_time(apart, float(self._times[parted[0]]), parted[0])
            early.at(end, "the two routes part, as at a singular pose")

    def _first_time(self, fails: Callable[[Array], bool], end: float, sample: int) -> float:
        """Time from which a check fails, between one at which it fails and the last sample before it."""
        start = float(self._times[sample - 1]) if sample else 0.0
        while end - start > _END * end:
            middle = (start + end) / 2
            start, end = (start, middle) if fails(np.array([middle])) else (middle, end)
        return end


def _moves_of(form: ClosedForm, seconds: Array) -> tuple[Array, Array]:
    """Coordinates and velocities of a closed form at times [s]. Raises Refused where they are not finite."""
    assert form.motion is not None
    moves = form.motion(seconds)
    if not all(np.all(np.isfinite(values)) for values in moves):
        raise Refused(
            "its closed form has no finite numbers here: masses, lengths or gravity are too large or too small"
        )
    return moves


def _apart_in_fields(mechanism: Mechanism, record: Record, second: Record, part: float = 1.0) -> dict[str, Array]:
    """Part of the largest difference of two motions in each field at each time."""
    fields, others = (fields_with_bars(mechanism, item) for item in (record, second))
    differences = {name: part * differences_of(values, others[name]) for name, values in fields.items()}
    return differences | {"work": np.zeros(len(record.time))}


def _apart(record: Record, second: Record, unit: float = 1.0) -> Array:
    """Largest difference of two motions at each time, in positions, which are in a ``unit``, and quaternions [1]."""
    return np.maximum(largest(record.p_WB - second.p_WB) / unit, largest(record.q_WB - second.q_WB))


BRANCHING = "the rows of the loops lose rank and the motion may branch: any change of the lengths may lead elsewhere"
_TURN = 0.02  # step between poses of a closed form, rad or natural lengths of the fastest coordinate
_FEW, _MOST = 50, 20_000  # limits of the number of poses


def singular_poses(mechanism: Mechanism, until: float, step: float) -> list[float]:
    """Times, s, at which the rows of the loops lose rank, accurate to a fraction of the step, s.

    The motion until ``until``, s, is integrated by Runge-Kutta 4 with a fixed rank, which passes singular poses.
    """
    equations = JointCoordinates(mechanism)
    if not (mechanism.loops and equations.rank):
        return []
    times = np.linspace(0.0, until, max(round(until / step), 5) + 1)
    return _passed(equations, times, (y[: mechanism.nq] for y in equations.rk4_states(times, float(times[1]))))


def singular_poses_of(form: ClosedForm, equations: JointCoordinates, until: float) -> list[float]:
    """Times, s, of singular poses along a motion in closed form until ``until``, s."""
    if not (equations.mechanism.loops and equations.rank) or form.motion is None or not until:
        return []
    fastest = float(np.abs(form.motion(np.linspace(0.0, until, _FEW))[1]).max())
    times = np.linspace(0.0, until, int(np.clip(until * fastest / _TURN, _FEW, _MOST)) + 1)
    return _passed(equations, times, form.motion(times)[0])


def branching(times: list[float]) -> str:
    """Clause about the times of singular poses, s; empty without any."""
    instants = ", ".join(f"{time:.4g}" for time in times[:3]) + (", …" if len(times) > 3 else "")
    return f"near t = {instants} s {BRANCHING}" if times else ""


def _passed(equations: JointCoordinates, times: Array, poses: Iterable[Array]) -> list[float]:
    sign, times_passed, last_value = RowSign(equations.rank), [], 0.0
    for k, q in enumerate(poses):
        C = equations.rows(q).C
        smallest = float(singular_values(C)[equations.rank - 1])
        if sign.changes(C):  # zero of the line through both values, with opposite signs
            times_passed.append(float(times[k - 1] + (times[k] - times[k - 1]) * last_value / (last_value + smallest)))
        last_value = smallest
    return times_passed
