"""Route 1 of a smooth motion by compiled collocation, in natural units: a hundredth of the cost of steps in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.dynamics import ContactDynamics
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.followed_paths import TOLERANCES
from proofroll.truth.natural_units import Units, natural_units
from proofroll.truth.smooth_laws import KeptRoute, KeptStep
from proofroll.truth.switching.contact_taylor import CompiledStretch
from proofroll.truth.tree.contact_tree import ContactTree

# Start, end and states inside of a step, (times, state), in natural units.
NaturalStep = tuple[float, float, Callable[[Array], Array]]


def compiled_run(mechanism: Mechanism, times: Array) -> tuple[Record, KeptRoute] | None:
    """Record at rising times [s] and steps of a motion that reaches no stop.

    None: the mechanism has loops, couplings or too many velocities to be compiled, heyoka is missing, or a step fails.
    """
    units = natural_units(mechanism)
    route, moments = ContactTree(ContactDynamics(units.mechanism(mechanism)), TOLERANCES[0], 1.0), times / units.time
    begun, tree = route.begin(), route.dynamics.equations
    assert begun.mode is not None  # every start has a mode
    compiled = route.by_symbols(begun.state, begun.mode)
    if compiled is None:
        return None
    stretch = route.walk_compiled(compiled, 0.0, begun.state, begun.mode, float(moments[-1]))
    if not isinstance(stretch, CompiledStretch) or stretch.guard is not None:
        return None

    def recorded(instants: Array, states: Array) -> Record:
        return units.record(mechanism, tree.recorded(instants, states))

    def inside(states: Callable[[Array], Array], instants: Array) -> Array:
        return np.asarray(states(instants)[:-1].T)

    steps = [(start, end, partial(inside, states)) for start, end, states in compiled.steps_of(stretch)]
    record = recorded(moments, route.within(stretch, moments)[:, :-1])
    return record, kept_in_seconds(steps, units, recorded, tree.spin)


def kept_in_seconds(
    steps: Iterable[NaturalStep],
    units: Units,
    recorded: Callable[[Array, Array], Record],
    spin: Callable[[Array], float],
) -> KeptRoute:
    """Steps in seconds, from those in natural units; ``recorded``: times in these and states -> record in SI units."""

    def inside(states: Callable[[Array], Array], times: Array) -> Array:
        return states(times / units.time)

    kept = [KeptStep(start * units.time, end * units.time, partial(inside, states)) for start, end, states in steps]
    return KeptRoute(kept, lambda times, states: recorded(times / units.time, states), lambda y: spin(y) / units.time)
