"""Truth of a motion without switches: two routes that share no kinematics, with their difference as an error bar.

Routes: joint coordinates (compiled collocation, or DOP853 with projection), maximal coordinates (Taylor series in
doubles and in long doubles; DOP853 without heyoka), both by implicit collocation if dampers are stiff, and closed forms
if known. The best of them is the truth, the others give its error bar. If in both routes a start displaced by
:data:`NUDGE` leads farther away than :data:`CHAOS`, the question is ill-posed; the time of that is the horizon. A route
that changes the energy of a conservative mechanism has failed, and shows no chaos.
"""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.dop853 import integrate
from proofroll.core.errors import Diverged, Missing, Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import natural_scale
from proofroll.elements.mechanism.dynamics.analysis import analyse
from proofroll.elements.mechanism.dynamics.complementarity import refuse_switching
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.link_forces import powers, working
from proofroll.elements.mechanism.dynamics.record import Record, record_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.bodies.maximal_coordinates import BESIDE, MaximalCoordinates
from proofroll.truth.bodies.maximal_taylor import Visited
from proofroll.truth.compiled_tree import compiled_run
from proofroll.truth.early_end import EarlyEnd
from proofroll.truth.error_bars import (
    NUDGE,
    ROUND_OFF,
    TwoRouteMotion,
    check_start,
    fields_with_bars,
    largest,
    on_same_turns,
    round_off,
)
from proofroll.truth.laws.check import sentence
from proofroll.truth.singular_poses import BRANCHING, singular_poses, singular_poses_of
from proofroll.truth.smooth_laws import KeptRoute, KeptStep, dense_steps, law_check, works_along
from proofroll.truth.stiff_routes import run_stiff, stiff
from proofroll.truth.witnesses.closed_forms import ClosedForm, closed_form

CHAOS = 1e-9  # m, 1 (quaternions): a larger distance between motions with indistinguishable starts is chaos
BRANCH = 1e-3  # m, 1: distance between routes that chaos causes only long after the horizon
ENERGY = 1e-8  # change of energy relative to its parts, a thousand times that of routes through chaos, 1e-11
_FORM_STEPS = 4  # into which a closed form is cut; its law check looks at the start of two of them
AT_LIMIT = 1e-9  # rad, m: a joint that swings exactly to its limit exceeds it by round-off, 1e-14


class _Routes(NamedTuple):
    """Records of all routes at the same times, the truth first, which of these are chaotic, and the routes' names.

    ``laws``: outcome of their check; ``kept``: steps of the precise one; None: it failed.
    """

    best: Record
    by_tree: Record
    by_bodies: Record
    precise: Record
    chaotic: NDArray[np.bool_]
    names: tuple[str, ...]
    laws: str = ""
    kept: KeptRoute | None = None

    def first(self, count: int) -> "_Routes":
        """The same at the first times alone."""
        best, by_tree, by_bodies, precise = (
            record.first(count) for record in (self.best, self.by_tree, self.by_bodies, self.precise)
        )
        return self._replace(
            best=best, by_tree=by_tree, by_bodies=by_bodies, precise=precise, chaotic=self.chaotic[:count]
        )


def find_truth(mechanism: Mechanism, times: Array, tolerance: float = 1e-15) -> TwoRouteMotion:
    """Truth at rising times, s, up to its end; the first may be 0. ``tolerance`` is DOP853's.

    Raises:
        Refused: fewer than two routes cover the mechanism, or none of the times; the text says why.
    """
    if mechanism.unmodelled:
        raise Refused(f"no route of the truth has {', '.join(mechanism.unmodelled)}")
    times = np.asarray(times, dtype=float)
    analysis, form = analyse(mechanism), closed_form(mechanism)
    tree = JointCoordinates(mechanism, analysis.rank)
    exact = _from_form(tree, form, times) if form is not None and form.motion is not None else None
    if exact is None and analysis.singular_start:
        raise Refused("the start is a singular pose, where the motion may branch, and no closed form is known")
    routes, early = _followed(tree, times, tolerance, exact, form)
    _check_limits(mechanism, routes.best, early)
    times = early.known(times)
    if not len(times):
        raise Refused(f"no truth behind t = {early.time:.6g} s: {early.reason}; ask for earlier times")
    best, by_tree, by_bodies, precise, chaotic, names, laws, steps = routes.first(len(times))
    masked = replace(best, wrench=np.where(analysis.determinate, best.wrench, np.nan))
    placed, fields = masked.placed(mechanism), fields_with_bars(mechanism, masked)
    bars, differences, least = {}, {}, round_off(fields, placed)
    late = np.flatnonzero(chaotic)
    horizon = float(times[late[0]]) if len(late) else np.inf
    rest = [fields_with_bars(mechanism, record) for record in (by_tree, by_bodies, precise)]
    for field, values in fields.items():
        others = [np.where(np.isnan(values), np.nan, content[field]) for content in rest]
        difference = np.maximum(largest(others[0] - values), largest(others[0] - others[2]))
        bar = SAFETY * difference + largest(others[1] - others[2]) + least[field]
        bars[field] = np.maximum.accumulate(bar)
        differences[field] = float(difference[times < horizon].max(initial=0.0))
    powers_of = [powers(record.placed(mechanism), record.named) for record in (best, by_tree, by_bodies, precise)]
    apart = np.max([largest(powers_of_route - powers_of[0]) for powers_of_route in powers_of[1:]], axis=0, initial=0.0)
    works, unresolved = _works(mechanism, steps, times)
    # routes whose powers differ by less than a bound have works that differ by less than its integral
    lasting = np.cumsum(np.maximum.accumulate(SAFETY * apart) * np.diff(times, prepend=0.0))
    bars["work"] = lasting + ROUND_OFF * np.maximum.accumulate(largest(works)) + unresolved
    # the true drift is zero: all drift is error; plus round-off of positions and cosines
    of_places = ROUND_OFF * np.maximum(1.0, np.maximum(largest(placed.p_WB), largest(placed.points)))
    bars["drift"] = np.maximum.accumulate(placed.drift() + of_places)
    checked = None
    if form is not None and form.motion is None:
        checked = (form.title, float(largest(form.part(times) - form.same(best)).max()))
    branches = [] if exact is None or form is None else singular_poses_of(form, tree, float(times[-1]))
    return TwoRouteMotion(
        record=masked,
        bars=bars,
        differences=differences,
        horizon=horizon,
        branches=branches,
        determinate=analysis.determinate,
        routes=names if exact is None or form is None else (f"closed form: {form.title}", *names),
        checked_by=checked,
        end=early.time,
        ended=early.reason,
        laws=laws,
        works=works,
    )


def _followed(
    tree: JointCoordinates, times: Array, tolerance: float, exact: Record | None, form: ClosedForm | None
) -> tuple[_Routes, EarlyEnd]:
    """Motion by all routes, and where it ends; where they fail a motion in closed form has equal steps as its witness.

    Raises:
        Refused: there is no motion beyond the start.
    """
    mechanism, early = tree.mechanism, EarlyEnd()
    bodies = MaximalCoordinates(mechanism)
    check_start(tree, bodies)
    conserved = (
        {f"closed form: {form.title}": _of_form(tree, form, times)} if exact is not None and form is not None else {}
    )
    try:
        by_tree, by_bodies, precise, growth, names, kept = _runs(tree, bodies, times, tolerance, early)
        _check_energy(mechanism, by_tree, names[1], early)
        _check_energy(mechanism, precise, names[0], early)
        chaotic = growth * NUDGE > CHAOS
        if chaotic.any():
            nearby = early.run(partial(_first_growth, tree, by_tree), times)
            chaotic = chaotic[: len(nearby)] & (nearby * NUDGE > CHAOS)
        _check_branch(by_tree, precise, chaotic, early)
        checked = law_check(mechanism, {**conserved, **dict(zip(names, kept, strict=True))}, names[1])
        laws = sentence(checked, len(names) + len(conserved))
        if checked.violation is not None:
            early.at(checked.violation.time, laws)
            laws = ""
    except Diverged as stopped:
        if exact is None:
            raise Refused(f"no truth beyond the start: {stopped}") from None
        early.at(0.0, str(stopped))
    if exact is not None and np.isfinite(early.time):
        witness = on_same_turns(mechanism, exact, tree.run_rk4(times))
        name = "joint coordinates, RK4"
        nowhere, early = np.zeros(len(times), dtype=bool), EarlyEnd()
        checked = law_check(mechanism, conserved, next(iter(conserved)))
        laws = sentence(checked, len(conserved))
        if checked.violation is not None:
            early.at(checked.violation.time, laws)
            laws = ""
        routes = _Routes(
            best=exact, by_tree=witness, by_bodies=witness, precise=witness, chaotic=nowhere, names=(name,), laws=laws
        )
        return routes, early
    if np.isfinite(early.time):
        early.reason = _singular(mechanism, early.time) or early.reason
    best = precise if exact is None else on_same_turns(mechanism, by_tree, exact)
    routes = _Routes(
        best=best,
        by_tree=by_tree,
        by_bodies=by_bodies,
        precise=precise,
        chaotic=chaotic,
        names=names,
        laws=laws,
        kept=kept[0],
    )
    return routes, early


def _of_form(tree: JointCoordinates, form: ClosedForm, times: Array) -> KeptRoute:
    """A closed form as a route whose steps are parts of the run; its states are poses and velocities."""

    def inside(moments: Array) -> Array:
        record = _from_form(tree, form, moments)
        parts = record.p_WB, record.q_WB, record.v_WB, record.w_WB
        return np.concatenate([part.reshape(len(moments), -1) for part in parts], axis=1)

    edges, turning = np.linspace(0.0, float(times[-1]), _FORM_STEPS + 1), 3 * len(tree.mechanism.bodies)
    steps = [KeptStep(start, end, inside) for start, end in pairwise(edges.tolist())]
    return KeptRoute(
        steps, lambda moments, _: _from_form(tree, form, moments), lambda y: float(np.abs(y[-turning:]).max())
    )


def _works(mechanism: Mechanism, steps: KeptRoute | None, times: Array) -> tuple[Array, float]:
    """Work of drives at times [s], (times, drives), and what is not resolved of it [J]; NaN without steps."""
    if steps is None or not any(step.end > step.start for step in steps.steps):
        return np.full((len(times), len(working(mechanism))), np.nan), np.inf
    works, unresolved = works_along(mechanism, steps, times)
    return works, float(unresolved.max(initial=0.0))


def _runs(
    tree: JointCoordinates, second: MaximalCoordinates, times: Array, tolerance: float, early: EarlyEnd
) -> tuple[Record, Record, Record, Array, tuple[str, ...], tuple[KeptRoute, ...]]:
    """Three records, the best one last, growth of a small difference [1], names and steps of the routes.

    All of them end where a route fails, which ``early`` tells.
    """
    mechanism = tree.mechanism
    refuse_switching(mechanism)
    if stiff(tree, float(times[-1])):
        runs = early.run(partial(run_stiff, mechanism, tree.rank), times)
        names = "maximal coordinates, implicit collocation", "joint coordinates, implicit collocation"
        best = on_same_turns(mechanism, runs.one, runs.precise)
        return runs.one, best, best, runs.growth, names, runs.kept[::-1]
    by_tree, kept, first_name = early.run(partial(_by_tree, tree, tolerance=tolerance), times)
    by_bodies, precise, name, second_path = early.run(partial(_second, second, tolerance=tolerance), times)
    growth = early.run(second.growth, times)
    by_tree, by_bodies, precise = (record.first(len(growth)) for record in (by_tree, by_bodies, precise))
    # route 1 alone counts turns; angles of the others are put on the same turns
    by_bodies, precise = on_same_turns(mechanism, by_tree, by_bodies), on_same_turns(mechanism, by_tree, precise)
    return by_tree, by_bodies, precise, growth, (name, first_name), (second_path, kept)


def _by_tree(tree: JointCoordinates, times: Array, tolerance: float) -> tuple[Record, KeptRoute, str]:
    """Route 1, its steps and its name."""
    compiled = compiled_run(tree.mechanism, times)
    if compiled is not None:
        return *compiled, "joint coordinates, collocation"
    visited: list[tuple[float, Array]] = []
    record = tree.run(times, tolerance, visited)
    steps = dense_steps(tree.rate, visited, float(times[-1]))
    return record, KeptRoute(steps, tree.recorded, tree.spin, coarse=True), "joint coordinates, DOP853"


def _singular(mechanism: Mechanism, end: float) -> str:
    """Clause on a singular pose at the end of a truth [s]; empty if there is none."""
    step = min(5e-3, end / 200)
    try:
        poses = singular_poses(mechanism, end + 2 * step, step)
    except (Diverged, np.linalg.LinAlgError):  # the step is too large for the motion
        return ""
    return BRANCHING if any(abs(time - end) <= 2 * step for time in poses) else ""


def _apart(record: Record, second: Record) -> Array:
    """Largest difference of two motions at each time, in positions [m] and quaternions [1]."""
    return np.maximum(largest(record.p_WB - second.p_WB), largest(record.q_WB - second.q_WB))


def _check_branch(record: Record, precise: Record, chaotic: NDArray[np.bool_], early: EarlyEnd) -> None:
    """Ends the truth where two routes part without chaos, for then they have taken different branches."""
    count = len(chaotic)
    parted = np.flatnonzero((_apart(record.first(count), precise.first(count)) > BRANCH) & ~chaotic)
    if len(parted):
        early.at(float(record.time[parted[0]]), "the two routes part, as at a singular pose")


def _check_energy(mechanism: Mechanism, record: Record, route: str, early: EarlyEnd) -> None:
    """Ends the truth where a route changes the energy of a conservative mechanism, for then it has failed."""
    if not mechanism.conservative:
        return
    parts, scale = record.placed(mechanism).energies(), natural_scale(mechanism)
    change = np.abs(parts.sum(axis=1) - parts[0].sum())
    natural = mechanism.mass * (scale.length * scale.rate) ** 2  # a mechanism in balance may have no energy
    lost = np.flatnonzero(change > ENERGY * max(natural, float(np.abs(parts).sum(axis=1).max())))
    if len(lost):
        reason = f"the route in {route} changes the energy by {change[lost[0]]:.2g} J"
        early.at(float(record.time[lost[0]]), reason)


def _first_growth(tree: JointCoordinates, record: Record, times: Array) -> Array:
    """Growth of the distance to a neighbouring motion in joint coordinates, as a multiple of the initial distance.

    ``times``: the first ones of the record [s].

    Raises:
        Diverged: the integration stops.
    """
    mechanism, nq = tree.mechanism, tree.mechanism.nq
    q, v = mechanism.start()
    ways = BESIDE * (1.0 + np.modf(np.arange(1, mechanism.nv + 1) * 0.6180339887498949)[0])
    start = np.concatenate([tree.tree.moved(q, ways), v * (1.0 + ways)])
    for _ in range(3):  # Newton's method doubles the number of digits
        start = tree.eliminated(start)
    states = integrate(tree.rate, start, times, BESIDE * 1e-4, tree.followed())
    samples = [tree.sample(y[:nq], y[nq:], None, t) for t, y in zip(times, states, strict=True)]
    return _apart(record_of(times, samples), record.first(len(times))) / BESIDE


def _check_limits(mechanism: Mechanism, record: Record, early: EarlyEnd) -> None:
    """Ends the truth where a joint exceeds its limits beyond round-off, as these routes do not follow stops."""
    for joint, columns in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.limits is not None:
            low, high = joint.limits[0] - AT_LIMIT, joint.limits[1] + AT_LIMIT
            beyond = np.flatnonzero(
                (record.q[:, columns] < low).any(axis=1) | (record.q[:, columns] > high).any(axis=1)
            )
            if len(beyond):
                reason = f"joint {joint.name} passes its limit, and no route follows a stop"
                early.at(float(record.time[beyond[0]]), reason)


def _from_form(equations: JointCoordinates, form: ClosedForm, times: Array) -> Record:
    assert form.motion is not None
    moves = form.motion(times)
    if not all(np.all(np.isfinite(values)) for values in moves):
        raise Refused(
            "its closed form has no finite numbers here: masses, lengths or gravity are too large or too small"
        )
    return record_of(times, [equations.sample(q, v) for q, v in zip(*moves, strict=True)])


def _second(route: MaximalCoordinates, times: Array, tolerance: float) -> tuple[Record, Record, str, KeptRoute]:
    """Route 2 in two precisions, the better one last, its name, and the steps of the better one."""
    series: Visited = []
    try:
        double, long = route.run_taylor(times), route.run_taylor(times, long_double=True, visited=series)
    except Missing:
        visited: list[tuple[float, Array]] = []
        coarse = route.run_dop853(times, 10 * tolerance)
        record, steps = route.run_dop853(times, tolerance, visited), dense_steps(route.lean.rate, visited, times[-1])
        kept = KeptRoute(steps, route.recorded, route.spin, route.powers, coarse=True)
        return coarse, record, "maximal coordinates, DOP853", kept
    ends = [*(float(time) for _, time, _ in series[1:]), float(times[-1])]
    taken = [
        KeptStep(float(time), end, partial(taylor.inside, time, state, taylor.number(end)))
        for (taylor, time, state), end in zip(series, ends, strict=True)
    ]
    name = "maximal coordinates, Taylor series in long doubles"
    return double, long, name, KeptRoute(taken, route.recorded, route.spin, route.powers)
