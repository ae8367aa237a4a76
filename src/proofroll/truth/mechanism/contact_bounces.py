"""Energies and heights of the bounces of a mechanism, from the states of both routes beside its impacts."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.bounces import Bounce, Course, exact_bounces, with_bars
from proofroll.core.events import IMPACTS, Event
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contacts.acting import ContactMode
from proofroll.elements.mechanism.contacts.bounces import bouncing_bodies, course_of
from proofroll.elements.mechanism.placed import Placed
from proofroll.elements.mechanism.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.hybrid import HybridPath, HybridRoute, Stretch, states_of
from proofroll.truth.mechanism.contact_tree import ContactTree
from proofroll.truth.mechanism.error_bars import ROUND_OFF
from proofroll.truth.mechanism.maximal_coordinates import MaximalCoordinates
from proofroll.truth.mechanism.natural_units import Units

_Path = HybridPath[Stretch[ContactMode]]
# Positions, rotations, velocities and angular velocities of all bodies.
_Poses = tuple[Array, Array, Array, Array]


def tree_poses(tree: ContactTree) -> Callable[[Array], _Poses]:
    """Poses and velocities of the bodies from a state of the first route."""

    def poses(state: Array) -> _Poses:
        motion = tree.dynamics.equations.tree.at(*tree.dynamics.parts(state)[:2])
        return motion.p_WB[:-1], motion.R_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1]

    return poses


def body_poses(second: MaximalCoordinates) -> Callable[[Array], _Poses]:
    """Poses and velocities of the bodies from a state of the second route."""
    bodies, equations = second.mechanism.bodies, second.lean.equations

    def poses(state: Array) -> _Poses:
        views = equations.at(state[:-1].tolist()).views[: len(bodies)]
        R, r, v, w = (np.array([getattr(view, key) for view in views], dtype=float) for key in "Rrvw")
        arms = np.einsum("bij,bj->bi", R, np.array([body.com for body in bodies]))
        return r - arms, R, v - np.cross(w, arms), w

    return poses


def contact_bounces(
    mechanism: Mechanism,
    routes: Sequence[tuple[HybridRoute[ContactMode], _Path, Callable[[Array], _Poses]]],
    events: Sequence[Event],
    units: Units,
    end: float,
) -> tuple[Bounce, ...]:
    """Bounces with error bars, one for each impact in ``events``, in SI units.

    Args:
        mechanism: in natural units.
        routes: both routes, with their paths, and poses of the bodies from a state.
        events: of the motion, in SI units.
        units: natural units.
        end: last time that both paths know, in natural units.
    """
    if not any(event.kind in IMPACTS for event in events):
        return ()
    bodies, found = bouncing_bodies(mechanism), []
    for route, path, poses in routes:
        happened = path.happenings[: len(events)]
        own = [
            Event(kind=event.kind, time=event.time, time_low=event.time, time_high=event.time, name=event.name)
            for event in happened
        ]

        def sampled(
            times: Array,
            route: HybridRoute[ContactMode] = route,
            path: _Path = path,
            poses: Callable[[Array], _Poses] = poses,
        ) -> Course:
            p, R, v, w = map(
                np.array, zip(*map(poses, states_of(route, path, times, path.stretch_at(times))), strict=True)
            )
            q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(scalar_first=True).reshape(*R.shape[:2], 4)
            return course_of(Placed(mechanism=mechanism, time=times, p_WB=p, v_WB=v, w_WB=w, q_WB=q))

        found.append(exact_bounces(sampled, own, bodies, end))
    one, two = found
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
        for event, item in zip(impacts, with_bars(one, two, SAFETY, 4 * ROUND_OFF), strict=False)
    )
