"""Energies and heights of the bounces of a mechanism, from the states of both routes beside its impacts."""

from collections.abc import Sequence

import numpy as np

from proofroll.core.bounces import Bounce, Course, exact_bounces, with_bars
from proofroll.core.events import IMPACTS, Event
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.modes import ContactMode
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.contacts.bounces import bouncing_bodies, course_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth import SAFETY
from proofroll.truth.bodies.contact_bodies import ContactBodies
from proofroll.truth.error_bars import ROUND_OFF
from proofroll.truth.natural_units import Units
from proofroll.truth.numerics.hybrid import HybridPath, Stretch, states_of
from proofroll.truth.tree.contact_tree import ContactTree


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
            times: Array,
            route: ContactTree | ContactBodies = route,
            path: HybridPath[Stretch[ContactMode]] = path,
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
