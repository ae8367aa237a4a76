"""Slip that starts from rest in a plane: its first instants, by collocation, for both routes.

The slower such a slip is, the faster friction turns it towards the direction that holds its balance: its equations are
stiff, and have no direction at rest. But the motion on which all others fall is smooth in time. With the slide u = |u|
t along a unit vector t of the surface, and e normal to t in the surface, u · e = 0 at all times, and so

    u̇ · e + |u| t · ė = 0.

Nodes of a polynomial in time carry the angle of t, as friction acts against t, and the states that follow from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.acting import Acting, ContactMode, slip_velocity
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.truth.numerics.hybrid import Stretch
from proofroll.truth.switching.contact_guards import SolvedContacts

# First length of the beginning, in natural units, and how often it is halved where the iteration does not settle or the
# nodes do not resolve the motion. The longer it is, the less stiff is what follows.
_FIRST, _HALVINGS = 2.0, 20
SHORTEST = _FIRST * 2.0**-_HALVINGS  # of beginnings
_RESOLVED = 1e-14  # last coefficients of the states' series, relative to their sizes, that count as zero
_SLOWEST = 0.7  # change of a round over that of the round before, above which the iteration does not settle
_ROUNDS = 40  # of the iteration at most
_SETTLED = 1e-15  # change of states and angles in the last round, relative to their sizes
_STALLED = 1e-13  # change below which a round that changes no less than the one before is round-off
_TURN = 1e-4  # rad: by which the response to the direction of friction is measured
_FREE = 1e-6  # response to that direction, relative to the friction's own, below which other contacts fix the direction

Rate = Callable[[Array, ContactMode], Array]
Solve = Callable[[Array, ContactMode], SolvedContacts]


@dataclass(frozen=True)
class BegunSlip(Stretch[ContactMode]):
    """The first instants of a slip from rest, by Chebyshev polynomials; an event may end it before these do.

    Attributes:
        length: of the polynomials [s].
        nodes: coefficients of states.
        ways: coefficients of the direction against which friction acts.
    """

    length: float = 0.0
    nodes: Any = None
    ways: Any = None

    def _of(self, series: Any, times: Array) -> Array:
        return np.asarray(chebyshev.chebval(2 * (times - self.start) / self.length - 1, series).T)

    def at(self, times: Array) -> Array:
        """States at times [s] within it, shape (times, state)."""
        return self._of(self.nodes, times)

    def mode_at(self, time: float) -> ContactMode:
        """Mode with the direction against which friction acts at a time [s]."""
        x, y, z = self._of(self.ways, np.array(time)).tolist()
        return tuple(own._replace(heading=(x, y, z)) if own.leads else own for own in self.mode)


class _Nodes:
    """Chebyshev points of [0, 1] with both ends; integrals to each, and derivatives at each, of what they interpolate.

    Attributes:
        places: of the points.
        to_series: coefficients by values.
        integral, derivative: matrices.
    """

    def __init__(self, count: int) -> None:
        points = -np.cos(np.pi * np.arange(count) / (count - 1))
        values, ones = chebyshev.chebvander(points, count - 1), np.eye(count)
        self.places, self.to_series = (points + 1) / 2, np.linalg.inv(values)
        integrals = [chebyshev.chebint(series, lbnd=-1) for series in ones]
        slopes = [chebyshev.chebder(series) for series in ones]
        self.integral = np.array([chebyshev.chebval(points, s) for s in integrals]).T @ self.to_series / 2
        self.derivative = np.array([chebyshev.chebval(points, s) for s in slopes]).T @ self.to_series * 2


def leading(own: Acting, normal: Array, force: Array) -> Acting:
    """Mode in which a contact leaves rest in its plane, against the ``force`` that held it; ``own``: before."""
    held = force - normal * (normal @ force)
    x, y, z = (-held / np.linalg.norm(held)).tolist()
    return own._replace(kind="slip", heading=(x, y, z), leads=True)


def leaving_slips(mode: ContactMode, solved: SolvedContacts, held: Mapping[int, Array]) -> dict[int, Acting]:
    """Slips that start at the bound of friction, opposite to the friction that ``held`` each contact."""
    found = {}
    for k, force in held.items():
        line = solved.mode[k].along
        if line is None:
            found[k] = leading(mode[k], solved.touching[k].normal, force)
            continue
        sign = -1.0 if np.dot(line, force) > 0 else 1.0
        x, y, z = (sign * component for component in line)
        found[k] = mode[k]._replace(kind="slip", along=(x, y, z), heading=(x, y, z))
    return found


def begun_slip(
    time: float, state: Array, mode: ContactMode, until: float, rate: Rate, solve: Solve, count: int, name: str
) -> BegunSlip:
    """First instants of the slip that leads in a mode, from a time [s] on, at most to ``until`` [s].

    Contacts of one face that lead together slip in one direction. Neither an end of this slip nor a change of another
    contact is asked for.

    Args:
        time: of the start.
        state: at the start.
        mode: in which one or more contacts lead.
        until: at most.
        rate: of a state in a mode.
        solve: motion and forces of a state in a mode.
        count: of nodes.
        name: of the contact, for messages.

    Raises:
        Refused: other contacts fix its direction, or it does not grow.
    """
    k = next(number for number, own in enumerate(mode) if own.leads)
    length, nodes = min(_FIRST, until - time), _Nodes(count)
    for _ in range(_HALVINGS):
        settled = _settled(state, mode, k, length, nodes, rate, solve)
        if settled is not None:
            states, ways = settled
            return BegunSlip(
                start=time,
                end=until if length == until - time else time + length,
                mode=mode,
                first=state,
                last=states[-1],
                guard=None,
                length=length,
                nodes=nodes.to_series @ states,
                ways=nodes.to_series @ ways,
            )
        length /= 2
    raise held_or_stopped(name, time)


def held_or_stopped(name: str, time: float) -> Refused:
    """Error that others hold or stop a slip at the time at which it begins [s]."""
    return Refused(
        f"{name} begins to slip from rest at t = {time:.6g} s as others hold or stop it: no route of the truth follows "
        "that; end before, or take more friction"
    )


def _settled(
    state: Array, mode: ContactMode, k: int, length: float, nodes: _Nodes, rate: Rate, solve: Solve
) -> tuple[Array, Array] | None:
    """States and directions at the nodes of a beginning of a ``length``.

    None: the iteration does not settle, or nothing slips.
    """
    count = len(nodes.places)
    start = np.array(mode[k].heading)

    def led(angle: float, y: Array) -> tuple[Acting, Array, Array, SolvedContacts, Array]:
        """Mode, direction and its normal in the surface, solution and rate at an angle from the first direction."""
        for_normal = solve(y, mode).touching[k].normal
        ahead = start - for_normal * (for_normal @ start)
        ahead = ahead / np.linalg.norm(ahead)
        aside = cross(for_normal, ahead)
        c, s = np.cos(angle), np.sin(angle)
        x, y_, z = (c * ahead + s * aside).tolist()
        own = mode[k]._replace(heading=(x, y_, z))
        now = tuple(each._replace(heading=(x, y_, z)) if each.leads else each for each in mode)
        return own, np.array([x, y_, z]), c * aside - s * ahead, solve(y, now), rate(y, now)

    # response of the slide across to the angle of friction
    sides = [led(angle, state) for angle in (-_TURN, _TURN)]
    across = sides[0][2] + sides[1][2]
    across = across / np.linalg.norm(across)
    rates = [side[3].slide_rate[k] for side in sides]
    answer = float(across @ (rates[1] - rates[0])) / (2 * _TURN)
    if not abs(answer) > _FREE * float(np.abs(rates).max()) / _TURN:
        return None
    states, angles, before = np.repeat(state[None], count, axis=0), np.zeros(count), np.inf
    for number in range(_ROUNDS):
        points = [led(angle, y) for angle, y in zip(angles, states, strict=True)]
        speeds = np.array([slip_velocity(point[3].touching[k]) @ point[1] for point in points])
        turning = nodes.derivative @ np.array([point[2] for point in points]) / length
        left = [
            point[3].slide_rate[k] @ point[2] + speed * (point[1] @ turn)
            for point, speed, turn in zip(points, speeds, turning, strict=True)
        ]
        turns = -np.array(left) / answer
        turns[0] = 0.0
        new = state + length * nodes.integral @ np.array([point[4] for point in points])
        change = max(float(np.abs(turns).max()), float(np.abs(new - states).max()))
        states, angles = new, angles + turns
        # the first round moves states alone, and the second one is the first to turn the slip
        if not np.isfinite(change) or (number > 1 and change > _STALLED and change > _SLOWEST * before):
            return None
        if change <= _SETTLED or (change <= _STALLED and change >= before / 2):
            tail = np.abs((nodes.to_series @ states)[-2:]).max()
            resolved = tail <= _RESOLVED * max(1.0, float(np.abs(states).max()))
            return (states, np.array([point[1] for point in points])) if resolved else None
        before = change
    return None
