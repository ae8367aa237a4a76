"""Truth of a mechanism that switches, by two routes that share the root finder of guards and the shapes.

Contacts of bodies, dry friction, stops and effort limits of joints are rows with bounds of the same machine.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from proofroll.core.bounces import Bounce, Course, exact_bounces, with_bars
from proofroll.core.errors import Refused
from proofroll.core.events import IMPACTS, JUMPS, Event, EventKind
from proofroll.core.pace import PACE
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.joint_laws import JointContact
from proofroll.elements.mechanism.contact.modes import REST, ContactMode
from proofroll.elements.mechanism.contact.tree_contacts import ContactDynamics
from proofroll.elements.mechanism.dynamics.held_signals import has_held
from proofroll.elements.mechanism.dynamics.link_forces import working, working_joints
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.dynamics.record import record_of
from proofroll.elements.mechanism.run.contacts.events import bouncing_bodies, course_of
from proofroll.elements.mechanism.run.contacts.observables import follow_contacts, moments_along
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.shapes.geometry import contact_sums
from proofroll.elements.mechanism.scene.signal import breaks
from proofroll.truth import SAFETY
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.bodies.contact_equations import ContactEquations
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates
from proofroll.truth.check.held_to_laws import held_to_laws, of_bodies, of_tree, work_along
from proofroll.truth.error_bars import ROUND_OFF, Routed, TwoRouteMotion, check_start, cut_at, on_same_turns
from proofroll.truth.followed_paths import (
    CLOSE,
    TOLERANCES,
    at_times,
    counterparts,
    cut_early,
    followed,
    in_one_mode,
    refuse_uncovered,
    stretches_at,
    times_known,
    two_route_motion,
)
from proofroll.truth.natural_units import Units, natural_units
from proofroll.truth.numerics.hybrid import HybridPath, HybridRoute, Stretch, first_close, states_of
from proofroll.truth.switching.held_route import HeldPath, HeldRoute
from proofroll.truth.switching.standing_ends import Face, RollingLanding, standing_ends
from proofroll.truth.tree.contact_tree import ContactTree

# Impacts whose intervals become shorter and shorter, and the last of these, in natural units, where they crowd.
_CROWD, _CROWDED = 5, 1e-3

_Path = HybridPath[Stretch[ContactMode]]
_Routes = tuple[HybridRoute[ContactMode], HybridRoute[ContactMode]]


def switched_truth(mechanism: Mechanism, times: Array) -> TwoRouteMotion:
    """Truth at rising times [s].

    Raises:
        NotUnique: the laws of contact leave more than one motion, or none.
        Refused: fewer than two routes cover the mechanism; the text says why.
        Diverged: a route stopped.
    """
    refuse_uncovered(mechanism)
    stands = standing_ends(mechanism)
    if stands is not None:
        with suppress(RollingLanding):
            return stands.folded(_of(stands.mechanism, times, stands.faces))
    return _of(mechanism, times)


def _of(mechanism: Mechanism, times: Array, faces: Sequence[Face] = ()) -> TwoRouteMotion:
    """Truth at times [s]; ``faces``: ends of cylinders whose corners are contacts."""
    units = natural_units(mechanism)
    with units.errors_in_seconds():
        return _in_units(mechanism, units, times / units.time, faces)


def _in_units(mechanism: Mechanism, units: Units, times: Array, faces: Sequence[Face]) -> TwoRouteMotion:
    """Truth at times in natural units, by routes in these units."""
    scaled = units.mechanism(mechanism)
    held_paths = tuple(HeldPath(mechanism, units, scaled) for _ in range(2)) if has_held(mechanism) else ()
    plain = [values.own for values in held_paths] or [scaled, scaled]
    dynamics, second = ContactDynamics(plain[0]), MaximalCoordinates(plain[1])
    check_start(dynamics.equations, second, units.length)
    size, equations = _size(dynamics), ContactEquations(plain[1], second.lean)
    tree, bodies = ContactTree(dynamics, TOLERANCES[0], size), ContactBodies(equations, TOLERANCES[1], size)
    tree.faces = bodies.faces = faces
    until, breaking, kinds = float(times[-1]), breaks(scaled.signals), partial(_kinds, dynamics)
    paths, routes = _followed(tree, bodies, held_paths, until, breaking)
    of_routes = [
        of_tree(mechanism, units, tree, paths[0], held_paths[0] if held_paths else None),
        of_bodies(mechanism, units, bodies, second, paths[1], held_paths[1] if held_paths else None),
    ]
    outcome = held_to_laws(mechanism, units, of_routes)
    if np.isfinite(outcome.end):
        paths = _cut(paths, outcome.end, outcome.text)
    reason = _reason(dynamics, paths)
    asked = times_known(paths, times, reason)
    early = None if held_paths else cut_early(tree.early(), paths[0], float(asked[-1]), breaking)
    if early is not None and early.ended and early.ended == PACE.reason:  # bars would leave out the errors of sums
        paths = _cut(paths, early.stretches[-1].end, PACE.reason)
        asked = times_known(paths, times, reason)
    times = held_paths[1].on_instants(held_paths[0].on_instants(asked)) if held_paths else asked

    def sampled(times: Array) -> tuple[list[int], list[int], Routed, Routed]:
        """Numbers of stretches, and motion without works, of both routes at known times in natural units."""
        (stretches, others), states = _states(routes, paths, held_paths, times, kinds)
        by_tree = _by_the_tree(tree, paths[0], times, states[0], stretches)
        modes = (bodies.acting(paths[1].stretches[k], y) for k, y in zip(others, states[1], strict=True))
        record, pressed = bodies.recorded(second, times, states[1], modes)
        record = on_same_turns(scaled, by_tree.record, record)
        return stretches, others, by_tree, Routed(record, by_tree.works, pressed if scaled.contacts else None)

    count = PACE.fitting(times, sampled)
    if count < len(times):
        paths = _cut(paths, float(times[count]), PACE.reason)
    times, asked = times[:count], asked[:count]
    stretches, others, by_tree, by_bodies = sampled(times)
    seconds, known_until = times * units.time, _works_known(tree, paths[0])
    (work_of_tree, *rest_of_tree), (work_of_bodies, *rest) = (
        work.at(seconds, numbers) for work, numbers in zip(outcome.works, (stretches, others), strict=True)
    )
    works = np.where(times[:, None] > known_until, np.nan, work_of_tree)
    unresolved = np.max([*rest_of_tree, *rest], axis=0)[:, np.isinf(known_until)].max(axis=1, initial=0.0)
    by_tree, by_bodies = by_tree._replace(works=works), by_bodies._replace(works=work_of_bodies)
    left = None
    if early is not None:
        earlier = at_times(early, counterparts((paths[0], early), stretches, kinds), times, kinds)
        cut = _by_the_tree(tree, early, times, states_of(tree, early, times, earlier), earlier)
        cut = cut._replace(
            record=on_same_turns(scaled, by_tree.record, cut.record),
            works=work_along(mechanism, units, tree, early).at(seconds, earlier)[0],
        )
        left = _in_si(mechanism, units, cut), in_one_mode(paths[0], early, times, kinds)
    motion = replace(
        two_route_motion(
            mechanism,
            paths,
            # samples at instants are at the times that were asked for, to the last bit
            (_in_si(mechanism, units, by_tree, asked), _in_si(mechanism, units, by_bodies, asked)),
            _names(tree, bodies),
            reason,
            units,
            unresolved=unresolved,
            kinds=kinds,
            until=until * units.time,
            cut=left,
        ),
        laws=outcome.laws,
        tiles=outcome.tiles,
        between=_between(mechanism, units, tree, routes[0], paths[0]),
    )
    if not scaled.contacts:
        return motion
    last = min(until, *(path.stretches[-1].end for path in paths))
    bounces = contact_bounces(scaled, [(tree, paths[0]), (bodies, paths[1])], motion.events, units, last)
    return replace(motion, bounces=bounces)


def _cut(paths: tuple[_Path, _Path], end: float, text: str) -> tuple[_Path, _Path]:
    """Both paths up to a time, and the reason why they end there."""
    return cut_at(paths[0], end, text), cut_at(paths[1], end, text)


def _states(
    routes: _Routes, paths: tuple[_Path, _Path], held_paths: Sequence[HeldPath], times: Array, kinds: Callable[..., Any]
) -> tuple[tuple[list[int], list[int]], tuple[Array, Array]]:
    """Numbers of stretches of both routes, and states, at known times in natural units."""
    stretches = stretches_at(paths, times)
    others = at_times(paths[1], counterparts(paths, stretches, kinds), times, kinds)
    for values in held_paths:
        values.resume()
    states = states_of(routes[0], paths[0], times, stretches), states_of(routes[1], paths[1], times, others)
    for values in held_paths:
        values.finish()
    return (stretches, others), states


def _followed(
    tree: ContactTree, bodies: ContactBodies, held_paths: Sequence[HeldPath], until: float, breaking: Sequence[float]
) -> tuple[tuple[_Path, _Path], _Routes]:
    """Paths of both routes to a time in natural units, and the routes, which hold values if the mechanism does.

    ``breaking``: times at which the rates are not smooth.
    """
    if not held_paths:
        return followed(tree, bodies, until, breaking), (tree, bodies)
    tree_route, body_route = HeldRoute(tree, held_paths[0]), HeldRoute(bodies, held_paths[1])
    tree_path, body_path = followed(tree_route, body_route, until, sorted({*breaking, *held_paths[0].breaks(until)}))
    if any(item.kind == EventKind.SETTLE for item in tree_path.happenings):
        raise Refused("no route of the truth follows rebounds to their end under held targets yet")
    return (tree_route.completed(tree_path), body_route.completed(body_path)), (tree_route, body_route)


def _works_known(tree: ContactTree, path: _Path) -> Array:
    """Time in natural units up to which the work of each of :func:`.working` is determinate, (drives); inf: always.

    Where contacts share a load in several ways, a drive that moves against it does another work in each.
    """
    dynamics, m = tree.dynamics, tree.dynamics.mechanism
    numbers, until = [number for number, _ in working(m)], np.full(len(working(m)), np.inf)
    moving = [m.v_slices[m.joint_index[name]].start for name in working_joints(m)]
    for stretch in path.stretches if numbers and m.contacts else ():
        middle = (stretch.start + stretch.end) / 2
        (state,) = tree.within(stretch, np.array([middle]))
        (q, v, _), mode = dynamics.parts(state), tree.acting(stretch, state)
        if stretch.end > stretch.start and dynamics.solve(q, v, mode, middle).undetermined.size:
            named = dynamics.sample(q, v, mode, middle)[0]["named"]
            until[np.isnan(named[numbers]) & (np.abs(v[moving]) > REST) & np.isinf(until)] = stretch.start
    return until


def _kinds(dynamics: ContactDynamics, mode: ContactMode) -> tuple[tuple[str, bool], ...]:
    """Part of a mode in which both routes must agree: kinds, and the sense of a joint that slides against friction."""
    return tuple(
        (
            acting.kind,
            isinstance(law, JointContact) and acting.kind == "slip" and bool(acting.along and acting.along[1] > 0),
        )
        for acting, law in zip(mode, dynamics.contacts, strict=True)
    )


def _names(tree: ContactTree, bodies: ContactBodies) -> tuple[str, str]:
    """Names of both routes."""
    if not tree.dynamics.mechanism.contacts:
        return (
            f"joint coordinates, {tree.integrators}, modes by sweeps over the joints",
            f"maximal coordinates, {bodies.integrators}, modes by trial",
        )
    return (
        f"joint coordinates, {tree.integrators}, contacts by Coulomb's law at all of them at once",
        f"bodies alone, {bodies.integrators}, contact modes by trial",
    )


def _reason(dynamics: ContactDynamics, paths: tuple[_Path, _Path]) -> str:
    """Reason why the motion is not unique from its horizon or its end on."""
    if not dynamics.mechanism.contacts:
        return "a change of the parameters within their accuracy changes which joints hold or hit a stop"
    ended, path = first_close(paths, CLOSE), paths[0]
    last = path.stretches[-1].start if not path.known and path.margins[-1][1] < CLOSE else ended
    reason = _shared_load(dynamics, path, last) if ended == 0 or not path.known else ""
    reason = reason or _crowded(path, ended)
    return reason or "a change of the parameters within their accuracy changes which contacts stick, slide or open"


def _crowded(path: _Path, time: float) -> str:
    """Reason why a motion is not unique from a time on where impacts crowd; empty: they do not."""
    impacts = [happening for happening in path.happenings if happening.kind in JUMPS and happening.time <= time]
    times = np.unique([impact.time for impact in impacts])[-_CROWD:]
    intervals = np.diff(times)
    if len(times) < _CROWD or time - times[-2] > _CROWDED or not np.all(np.diff(intervals) < 0):
        return ""
    names = sorted({impact.name for impact in impacts if impact.time >= times[0]})
    return (
        f"infinitely many impacts of {' and '.join(names)} follow each other faster and faster, in no series that can "
        "be summed, and round-off decides what they leave"
    )


def _by_the_tree(tree: ContactTree, path: _Path, times: Array, states: Array, stretches: Sequence[int]) -> Routed:
    """Motion and forces, without works, of the first route along a path with these states, in natural units."""
    dynamics = tree.dynamics
    records, forces, sums = zip(
        *(
            dynamics.sample(*dynamics.parts(state)[:2], tree.acting(path.stretches[number], state), float(state[-1]))
            for state, number in zip(states, stretches, strict=True)
        ),
        strict=True,
    )
    touching = bool(dynamics.mechanism.contacts)
    borne, summed = (np.array(values) if touching else None for values in (forces, sums))
    return Routed(
        record_of(times, records), np.full((len(times), len(working(dynamics.mechanism))), np.nan), borne, summed
    )


def _between(
    mechanism: Mechanism, units: Units, tree: ContactTree, route: HybridRoute[ContactMode], path: _Path
) -> Routed | None:
    """Motion and forces of the first route in the middle of each stretch of a path that has them; None: it has none."""
    lasting = [k for k, stretch in enumerate(path.stretches) if stretch.end > stretch.start and not stretch.summed]
    if not lasting:
        return None
    times = np.array([path.stretches[k].middle for k in lasting])
    return _in_si(mechanism, units, _by_the_tree(tree, path, times, states_of(route, path, times, lasting), lasting))


def _sums_along(placed: Placed, pressed: Array) -> Array:
    """Sums of contact forces [N] and of their moments [N m] along a motion, (times, sums, 3)."""
    forces = pressed[..., :3]
    sums = contact_sums(placed.mechanism.contacts) @ forces
    return np.concatenate([sums, moments_along(placed, follow_contacts(placed).place, forces)], axis=1)


def _in_si(mechanism: Mechanism, units: Units, routed: Routed, times: Array | None = None) -> Routed:
    """Motion and forces in SI units; ``times``: its own in natural units, if these have more digits."""
    natural = routed.record if times is None else replace(routed.record, time=times)
    record, moment = units.record(mechanism, natural), units.force * units.length
    if routed.pressed is None:
        return routed._replace(record=record)
    sizes, count = np.array([*[units.force] * 3, *[moment] * 3, units.force]), len(contact_sums(mechanism.contacts))
    pressed = routed.pressed * sizes
    if routed.sums is None:
        return routed._replace(record=record, pressed=pressed, sums=_sums_along(record.placed(mechanism), pressed))
    is_moment = np.arange(routed.sums.shape[1]) >= count
    return routed._replace(
        record=record, pressed=pressed, sums=routed.sums * np.where(is_moment, moment, units.force)[:, None]
    )


def _shared_load(dynamics: ContactDynamics, path: _Path, time: float) -> str:
    """Reason why a motion is not unique from a time on [s], naming contacts whose normal forces are not determinate.

    Empty: all are.
    """
    stretch = path.stretches[path.stretch_at(np.array([time]))[0]]
    q, v, begun = dynamics.parts(stretch.first)
    solution = dynamics.solve(q, v, stretch.mode, begun)
    sharing = [contact for contact, N in zip(dynamics.contacts, solution.normal_forces, strict=True) if np.isnan(N)]
    if not sharing:
        return ""
    names = dict.fromkeys(contact.name for contact in sharing)
    rolls = any(not friction.spins for friction in dynamics.turning if friction.name in names)
    return (
        f"{', '.join(names)} carry the load together in more ways than one, so that friction at each is not "
        f"determinate ({'without rolling_resistance ' if rolls else ''}a body on three points, or one that slides "
        "without turning, has a truth)"
    )


def _size(dynamics: ContactDynamics) -> float:
    """Largest distance of a contact from the origin at the start, at least the natural length, which is 1."""
    touching = dynamics.at(*dynamics.mechanism.start()).touching
    return max([1.0, *(float(np.abs(touch.place).max()) for touch in touching)])


def contact_bounces(
    mechanism: Mechanism,
    routes: Sequence[tuple[ContactTree | ContactBodies, HybridPath[Stretch[ContactMode]]]],
    events: Sequence[Event],
    units: Units,
    end: float,
) -> tuple[Bounce, ...]:
    """Bounces with error bars, one for each impact in ``events``, in SI units.

    Args:
        mechanism: in natural units.
        routes: both routes, with their paths.
        events: of the motion, in SI units.
        units: natural units.
        end: last time that both paths know, in natural units.
    """
    if not any(event.kind in IMPACTS for event in events):
        return ()
    bodies, by_route = bouncing_bodies(mechanism), []
    for route, path in routes:
        happened = path.happenings[: len(events)]
        moments = [
            Event(kind=event.kind, time=event.time, time_low=event.time, time_high=event.time, name=event.name)
            for event in happened
        ]

        def sampled(
            times: Array, route: ContactTree | ContactBodies = route, path: HybridPath[Stretch[ContactMode]] = path
        ) -> Course:
            states = states_of(route, path, times, path.stretch_at(times))
            p, v, q, w = map(np.array, zip(*map(route.bodies, states), strict=True))
            return course_of(Placed(mechanism=mechanism, time=times, p_WB=p, v_WB=v, w_WB=w, q_WB=q))

        by_route.append(exact_bounces(sampled, moments, bodies, end))
    by_tree, by_bodies = by_route
    joule, impacts = units.force * units.length, [event for event in events if event.kind in IMPACTS]
    return tuple(
        Bounce(
            time=event.time,
            name=event.name,
            energy_before=item.energy_before * joule,
            energy_after=item.energy_after * joule,
            height=item.height * units.length,
            energy_bar=None if item.energy_bar is None else item.energy_bar * joule,
            height_bar=None if item.height_bar is None else item.height_bar * units.length,
        )
        for event, item in zip(impacts, with_bars(by_tree, by_bodies, SAFETY, 4 * ROUND_OFF), strict=False)
    )
