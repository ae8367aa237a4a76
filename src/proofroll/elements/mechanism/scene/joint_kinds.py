"""Kinds of joints: the one list, with the coordinates, axes and laws of each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from proofroll.core.events import Kind


class JointKind(Kind):
    """Relative motion of its two bodies that a joint allows."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"
    CYLINDRICAL = "cylindrical"
    UNIVERSAL = "universal"
    SPHERICAL = "spherical"
    PLANAR = "planar"
    FREE = "free"


DISTANCE: Literal["distance"] = "distance"  # kind of a loop alone: its one row holds the distance of its points
LoopKind = JointKind | Literal["distance"]

ONE_COORDINATE = (JointKind.REVOLUTE, JointKind.PRISMATIC)  # may have a motion, a drive and stops
TURNING = frozenset({JointKind.REVOLUTE, JointKind.UNIVERSAL})  # coordinates are angles that may exceed a turn
SLIDING = frozenset({JointKind.PRISMATIC, JointKind.CYLINDRICAL})  # the child slides along the axis
# The bodies may move in a plane; the axis is normal to it, of a slide in it.
IN_PLANE = frozenset({*ONE_COORDINATE, JointKind.FIXED, JointKind.PLANAR})
WITH_AXIS = frozenset(JointKind) - {JointKind.FIXED, JointKind.SPHERICAL, JointKind.FREE}
WITH_QUATERNION = frozenset({JointKind.SPHERICAL, JointKind.FREE})


class Facts(NamedTuple):
    """Facts of a kind of joint, in the frames A (on the parent) and B (on the child) whose z is the axis.

    Attributes:
        nq, nv: number of coordinates and of velocities.
        translations: axes of A along which the joint's points may not separate.
        rotations: pairs (axis of A, axis of B) that stay perpendicular.
    """

    nq: int
    nv: int
    translations: tuple[int, ...]
    rotations: tuple[tuple[int, int], ...]


_ALL, _PARALLEL, _EQUAL = (0, 1, 2), ((0, 2), (1, 2)), ((0, 1), (1, 2), (2, 0))
FACTS: Mapping[str, Facts] = {
    JointKind.FIXED: Facts(0, 0, _ALL, _EQUAL),
    JointKind.REVOLUTE: Facts(1, 1, _ALL, _PARALLEL),
    JointKind.PRISMATIC: Facts(1, 1, (0, 1), _EQUAL),
    JointKind.CYLINDRICAL: Facts(2, 2, (0, 1), _PARALLEL),
    JointKind.UNIVERSAL: Facts(2, 2, _ALL, ((2, 0),)),
    JointKind.SPHERICAL: Facts(4, 3, _ALL, ()),
    JointKind.PLANAR: Facts(3, 3, (2,), _PARALLEL),
    JointKind.FREE: Facts(7, 6, (), ()),
}
LOOP_FACTS: Mapping[str, Facts] = {**FACTS, DISTANCE: Facts(0, 0, (), ())}

# For each velocity: (its axis belongs to B, not to A; number of the axis; it is a rotation; the child carries the axis,
# not the parent). The sum of three rotations about axes of the child does not turn with it, for ω × ω = 0.
AXES: Mapping[str, tuple[tuple[bool, int, bool, bool], ...]] = {
    JointKind.FIXED: (),
    JointKind.REVOLUTE: ((False, 2, True, False),),
    JointKind.PRISMATIC: ((False, 2, False, False),),
    JointKind.CYLINDRICAL: ((False, 2, False, False), (False, 2, True, False)),
    JointKind.UNIVERSAL: ((False, 2, True, False), (True, 0, True, True)),
    JointKind.SPHERICAL: tuple((True, axis, True, False) for axis in range(3)),
    JointKind.PLANAR: ((False, 0, False, False), (False, 1, False, False), (False, 2, True, False)),
    JointKind.FREE: tuple((True, axis, turns, not turns) for turns in (False, True) for axis in range(3)),
}
_WITH_UNIT = (*ONE_COORDINATE, JointKind.UNIVERSAL)
# Kinds that may have a law along their coordinates; other kinds lack the coordinate, the rate or a unit for it.
LAWS: Mapping[str, tuple[JointKind, ...]] = {
    "stiffness": _WITH_UNIT,
    "rest": _WITH_UNIT,
    "damping": (*_WITH_UNIT, JointKind.SPHERICAL),
    "friction": _WITH_UNIT,
    "torque": ONE_COORDINATE,
    "armature": ONE_COORDINATE,
}


def rows_of(kinds: Sequence[str]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of the constraint rows of connections: points, (2, points), and angles, (3, angles).

    Each column is the number of a connection, then its axis of A (points), or its axes of A and of B (angles). A
    distance is a row of points, whose direction is not the axis.
    """
    points = [
        (number, k)
        for number, kind in enumerate(kinds)
        for k in ((0,) if kind == DISTANCE else FACTS[kind].translations)
    ]
    angles = [(number, *pair) for number, kind in enumerate(kinds) for pair in LOOP_FACTS[kind].rotations]
    return np.array(points, dtype=np.intp).reshape(-1, 2).T, np.array(angles, dtype=np.intp).reshape(-1, 3).T
