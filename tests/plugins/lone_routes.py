"""Motions without switches by one route of a truth alone, for tests of its equations."""

import numpy as np

from proofroll.core.dop853 import integrate
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.dynamics.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.bodies.maximal_coordinates import MaximalCoordinates


def by_joints(mechanism: Mechanism, times: Array, tolerance: float = 1e-14) -> Record:
    """Record at times [s] in joint coordinates, by DOP853."""
    route, start = JointCoordinates(mechanism), np.concatenate(mechanism.start())
    states = integrate(route.rate, start, times, tolerance, route.followed(), route.least(tolerance))
    return route.recorded(times, states)


def by_bodies(route: MaximalCoordinates, times: Array, tolerance: float = 1e-14) -> Record:
    """Record at times [s] in maximal coordinates, by DOP853 with projection."""
    lean = route.lean
    states = integrate(lean.rate, lean.equations.start(), times, tolerance, lean.eliminated)
    return route.recorded(times, np.array(list(states)))


def by_series(route: MaximalCoordinates, times: Array) -> Record:
    """Record at times [s] in maximal coordinates, by Taylor series in long doubles."""
    return route.recorded(times, np.asarray(route.taylor_states(times), dtype=float))
