"""Record of a route: poses, velocities and forces at points of pieces of its motion, and its transitions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from proofroll.elements.mechanism import Mechanism

Array = NDArray[np.float64]


SPREAD = "spread"  # mode of a closed contact whose force is the sum of several, so that it has no point of action


class Modes(NamedTuple):
    """Modes during a stretch, each "open", "stick" or "slip"; of contacts :data:`SPREAD`, too.

    Attributes:
        contacts: of each contact.
        rolling, spinning: of its rolling resistance and its friction against spin; "open" without any.
        friction: of the dry friction of each joint; "open" without any.
        stops: of the lower and the upper stop of each joint.
    """

    contacts: tuple[str, ...]
    rolling: tuple[str, ...]
    spinning: tuple[str, ...]
    friction: tuple[str, ...]
    stops: tuple[tuple[str, str], ...]


@dataclass(frozen=True, kw_only=True)
class BodyPoses:
    """Poses and velocities of all bodies at the points of pieces of a motion, SI units, world axes.

    A piece is a part of a step in which all quantities are polynomials of a variable x from -1 to 1; its points are
    Chebyshev's, :data:`.integrals.POINTS`, both ends among them. Arrays have the shape (pieces, points, …).
    The last body is the world.

    Attributes:
        time: [s].
        pace: rate of the time by x [s].
        p: origin of each body's frame [m], (bodies + 1, 3).
        R: rotation of each body, (bodies + 1, 3, 3).
        v: velocity of each origin [m/s], (bodies + 1, 3).
        w: angular velocity of each body [rad/s], (bodies + 1, 3).
        coarse: True if states inside a piece are known to fewer digits than at its ends (dense output of DOP853).
        turns: coordinates of joints with one or two coordinates, for their whole turns, (joints, 2); None: angles
            go on from the last point.
    """

    time: Array
    pace: Array
    p: Array
    R: Array
    v: Array
    w: Array
    coarse: bool = False
    turns: Array | None = None

    def at(self, chosen: Any, turns: Array | None = None) -> BodyPoses:
        """Chosen points of the pieces, as an index of both; ``turns``: there."""
        arrays = {name: getattr(self, name)[chosen] for name in ("time", "pace", "p", "R", "v", "w")}
        return BodyPoses(**arrays, turns=turns)


@dataclass(frozen=True, kw_only=True)
class Pieces(BodyPoses):
    """Statements of one route at the points of pieces of one stretch.

    Attributes:
        effort: of each actuator along its joint [N, N m], (actuators).
        coupling: multiplier of each coupling: force along its first joint [N, N m], (couplings).
        drive: force that imposes the motion of each joint [N, N m], (joints); 0 where none is prescribed.
        friction: dry friction along each joint [N, N m], (joints).
        stops: force of each stop along its joint [N, N m], (joints, 2).
        force: on the first body of each contact [N], (contacts, 3).
        place: point of action [m], (contacts, 3).
        normal: from the second body to the first, unit vector, (contacts, 3).
        rolling, spinning: moment on the first body of each contact against rolling and spin [N m], (contacts, 3).
        modes: during the stretch.
    """

    effort: Array
    coupling: Array
    drive: Array
    friction: Array
    stops: Array
    force: Array
    place: Array
    normal: Array
    rolling: Array
    spinning: Array
    modes: Modes


def stated(mechanism: Mechanism, modes: Modes, time: Array, **stated_fields: Any) -> Pieces:
    """Pieces of a motion with these times [s]; ``stated_fields``: of :class:`Pieces`; forces left out are zero."""
    contacts, joints = len(mechanism.contacts), len(mechanism.joints)
    sizes: dict[str, Sequence[int]] = {
        "effort": (len(mechanism.actuators),),
        "coupling": (len(mechanism.couplings),),
        "drive": (joints,),
        "friction": (joints,),
        "stops": (joints, 2),
        **dict.fromkeys(("force", "place", "normal", "rolling", "spinning"), (contacts, 3)),
    }
    forces: dict[str, Any] = {name: np.zeros((*time.shape, *size)) for name, size in sizes.items()}
    return Pieces(time=time, modes=modes, **(forces | stated_fields))


@dataclass(frozen=True)
class Passage:
    """A transition between two stretches: what a route states just before and just after it.

    Attributes:
        before: one point, with all forces that its causes need.
        after: one point, without forces.
        impacts: names of contacts and joints that were struck.
        settles: names of those whose rebounds are summed.
        decided: True if a guard ended the stretch; False for a break of a signal or a border of a surface.
    """

    before: Pieces
    after: Pieces
    impacts: frozenset[str] = frozenset()
    settles: frozenset[str] = frozenset()
    decided: bool = True


@dataclass(frozen=True)
class PublishedEvent:
    """An event as it is published.

    Attributes:
        name: of a contact, joint or actuator.
        time, low, high: its time and bracket [s].
        jumps: True if velocities jump there.
        strikes: True if surfaces meet, or a joint and its stop.
        settles: True if it is the last of infinitely many impacts.
        of_effort: True if an effort reaches its limit or leaves it, which is no mode of a record.
    """

    name: str
    time: float
    low: float
    high: float
    jumps: bool
    strikes: bool
    settles: bool
    of_effort: bool


@dataclass(frozen=True)
class PublishedValues:
    """Answer of a truth, SI units.

    Attributes:
        pieces: motion, contacts and forces along coordinates at each sample, a piece of one point each; NaN: not
            determined; modes and turns are those of the tile that holds the sample.
        reactions: force and moment of each joint and loop on its child, at its place there, world axes [N, N m],
            (samples, 1, connections, 6).
        values: all variables, by name, (samples, …).
        bars: their error bars.
        changes: events.
    """

    pieces: Pieces
    reactions: Array
    values: Mapping[str, Array]
    bars: Mapping[str, float]
    changes: Sequence[PublishedEvent]

    def of(self, chosen: NDArray[np.intp]) -> PublishedValues:
        """Some of the samples."""
        arrays = {item.name: getattr(self.pieces, item.name) for item in fields(Pieces)}
        taken: dict[str, Any] = {name: value[chosen] for name, value in arrays.items() if isinstance(value, np.ndarray)}
        count = len(self.reactions)
        values = {name: value[chosen] if len(value) == count else value for name, value in self.values.items()}
        return replace(self, pieces=replace(self.pieces, **taken), reactions=self.reactions[chosen], values=values)
