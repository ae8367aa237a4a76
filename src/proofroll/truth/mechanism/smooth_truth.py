"""Truth of a motion without switches: two routes that share no kinematics, with their difference as an error bar.

Routes: joint coordinates (DOP853 with projection), maximal coordinates (Taylor series in doubles and in long doubles;
DOP853 without heyoka), both by implicit collocation if dampers are stiff, and closed forms if known. The best of them
is the truth, the others give its error bar. If in both routes a start displaced by :data:`NUDGE` leads farther away
than :data:`CHAOS`, the question is ill-posed; the time of that is the horizon. A route that changes the energy of a
conservative mechanism has failed, and shows no chaos.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from proofroll.core.dop853 import integrate
from proofroll.core.errors import Diverged, Missing, Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.analysis import analyse
from proofroll.elements.mechanism.complementarity import refuse_switching
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.record import Record, record_of
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.mechanism.closed_forms import ClosedForm, closed_form
from proofroll.truth.mechanism.error_bars import (
    NUDGE,
    ROUND_OFF,
    TwoRouteMotion,
    check_start,
    fields_with_bars,
    largest,
    on_same_turns,
    round_off,
)
from proofroll.truth.mechanism.maximal_coordinates import BESIDE, MaximalCoordinates
from proofroll.truth.mechanism.singular_poses import branching, singular_poses, singular_poses_of
from proofroll.truth.mechanism.stiff_routes import run_stiff, stiff

CHAOS = 1e-9  # m, 1 (quaternions): a larger distance between motions with indistinguishable starts is chaos
BRANCH = 1e-3  # m, 1: distance between routes that chaos causes only long after the horizon
ENERGY = 1e-8  # change of energy relative to its parts, a thousand times that of routes through chaos, 1e-11
AT_LIMIT = 1e-9  # rad, m: a joint that swings exactly to its limit exceeds it by round-off, 1e-14


def find_truth(mechanism: Mechanism, times: Array, tolerance: float = 1e-15) -> TwoRouteMotion:
    """Truth at rising times, s; the first may be 0. ``tolerance`` is DOP853's.

    Raises:
        Refused: fewer than two routes cover the mechanism; the text says why.
    """
    if mechanism.unmodelled:
        raise Refused(f"no route of the truth has {', '.join(mechanism.unmodelled)}")
    times = np.asarray(times, dtype=float)
    analysis, form = analyse(mechanism), closed_form(mechanism)
    tree = JointCoordinates(mechanism, analysis.rank)
    exact = _from_form(tree, form, times) if form is not None and form.motion is not None else None
    if exact is None and analysis.singular_start:
        raise Refused("the start is a singular pose, where the motion may branch, and no closed form is known")
    try:
        bodies = MaximalCoordinates(mechanism)
        check_start(tree, bodies)
        by_tree, by_bodies, precise, growth, routes = _runs(tree, bodies, times, tolerance)
        for record, name in ((by_tree, routes[1]), (precise, routes[0])):
            _check_energy(mechanism, record, name)
        chaotic = growth * NUDGE > CHAOS
        if chaotic.any():
            chaotic &= _first_growth(tree, by_tree) * NUDGE > CHAOS
        _check_branch(by_tree, precise, chaotic)
        best = precise if exact is None else on_same_turns(mechanism, by_tree, exact)
    except Diverged as stopped:
        if exact is None:
            poses = _singular(mechanism, float(times[-1]))
            raise Refused(f"no truth to the end: {stopped}; end before it{poses}") from None
        by_tree = by_bodies = precise = on_same_turns(mechanism, exact, tree.run_rk4(times))
        best, routes, chaotic = exact, ("joint coordinates, RK4",), np.zeros(len(times), dtype=bool)
    if exact is not None and form is not None:
        routes = (f"closed form: {form.title}", *routes)
    _check_limits(mechanism, best)
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
        routes=routes,
        checked_by=checked,
    )


def _runs(
    tree: JointCoordinates, second: MaximalCoordinates, times: Array, tolerance: float
) -> tuple[Record, Record, Record, Array, tuple[str, ...]]:
    """Three records, the best one last, growth of a small difference [1], and the names of the routes."""
    mechanism = tree.mechanism
    refuse_switching(mechanism)
    if stiff(tree, float(times[-1])):
        runs = run_stiff(mechanism, tree.rank, times)
        names = "maximal coordinates, implicit collocation", "joint coordinates, implicit collocation"
        best = on_same_turns(mechanism, runs.one, runs.precise)
        return runs.one, best, best, runs.growth, names
    by_tree = tree.run(times, tolerance)
    by_bodies, precise, name = _second(second, times, tolerance)
    # route 1 alone counts turns; angles of the others are put on the same turns
    by_bodies, precise = on_same_turns(mechanism, by_tree, by_bodies), on_same_turns(mechanism, by_tree, precise)
    return by_tree, by_bodies, precise, second.growth(times), (name, "joint coordinates, DOP853")


def _singular(mechanism: Mechanism, until: float) -> str:
    """Clause on singular poses before ``until``, s; empty without any."""
    try:
        clause = branching(singular_poses(mechanism, until, min(5e-3, until / 200)))
    except np.linalg.LinAlgError:  # the step is too large for the motion
        clause = ""
    return f" ({clause})" if clause else ""


def _apart(record: Record, second: Record) -> Array:
    """Largest difference of two motions at each time, in positions [m] and quaternions [1]."""
    return np.maximum(largest(record.p_WB - second.p_WB), largest(record.q_WB - second.q_WB))


def _check_branch(record: Record, precise: Record, chaotic: NDArray[np.bool_]) -> None:
    """Checks that two routes do not part without chaos.

    Raises:
        Diverged: the difference shows that the routes have taken different branches.
    """
    parted = np.flatnonzero((_apart(record, precise) > BRANCH) & ~chaotic)
    if len(parted):
        raise Diverged(f"the two routes part before t = {record.time[parted[0]]:.6g} s, as at a singular pose")


def _check_energy(mechanism: Mechanism, record: Record, route: str) -> None:
    """Checks that a route keeps the energy of a conservative mechanism.

    Raises:
        Diverged: the energy changes, so that the route has failed.
    """
    if not mechanism.conservative:
        return
    parts = record.placed(mechanism).energies()
    change = np.abs(parts.sum(axis=1) - parts[0].sum())
    lost = np.flatnonzero(change > ENERGY * np.abs(parts).sum(axis=1).max())
    if len(lost):
        time = record.time[lost[0]]
        raise Diverged(f"the route in {route} changes the energy by {change[lost[0]]:.2g} J before t = {time:.6g} s")


def _first_growth(tree: JointCoordinates, record: Record) -> Array:
    """Growth of the distance to a neighbouring motion in joint coordinates, as a multiple of the initial distance.

    Raises:
        Diverged: the integration stops.
    """
    mechanism, nq = tree.mechanism, tree.mechanism.nq
    q, v = mechanism.start()
    ways = BESIDE * (1.0 + np.modf(np.arange(1, mechanism.nv + 1) * 0.6180339887498949)[0])
    start = np.concatenate([tree.tree.moved(q, ways), v * (1.0 + ways)])
    for _ in range(3):  # Newton's method doubles the number of digits
        start = tree.eliminated(start)
    states = integrate(tree.rate, start, record.time, BESIDE * 1e-4, tree.followed())
    samples = [tree.sample(y[:nq], y[nq:], None, t) for t, y in zip(record.time, states, strict=True)]
    return _apart(record_of(record.time, samples), record) / BESIDE


def _check_limits(mechanism: Mechanism, record: Record) -> None:
    """Checks that no joint exceeds its limits beyond round-off, as these routes do not follow stops.

    Raises:
        Refused: a joint does.
    """
    for joint, columns in zip(mechanism.joints, mechanism.q_slices, strict=True):
        if joint.limits is not None:
            low, high = joint.limits[0] - AT_LIMIT, joint.limits[1] + AT_LIMIT
            beyond = np.flatnonzero(
                (record.q[:, columns] < low).any(axis=1) | (record.q[:, columns] > high).any(axis=1)
            )
            if len(beyond):
                time = record.time[beyond[0]]
                raise Refused(f"joint {joint.name} passes its limit before t = {time:.6g} s; no route follows a stop")


def _from_form(equations: JointCoordinates, form: ClosedForm, times: Array) -> Record:
    assert form.motion is not None
    moves = form.motion(times)
    if not all(np.all(np.isfinite(values)) for values in moves):
        raise Refused(
            "its closed form has no finite numbers here: masses, lengths or gravity are too large or too small"
        )
    return record_of(times, [equations.sample(q, v) for q, v in zip(*moves, strict=True)])


def _second(route: MaximalCoordinates, times: Array, tolerance: float) -> tuple[Record, Record, str]:
    """Route 2 in two precisions, the better one last, and its name."""
    try:
        double, long = route.run_taylor(times), route.run_taylor(times, long_double=True)
    except Missing:
        coarse = route.run_dop853(times, 10 * tolerance)
        return coarse, route.run_dop853(times, tolerance), "maximal coordinates, DOP853"
    return double, long, "maximal coordinates, Taylor series in long doubles"
