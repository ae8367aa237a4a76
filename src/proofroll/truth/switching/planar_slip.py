"""Slip that starts from rest in a plane: its first instants, by collocation, for both routes.

The slower such a slip is, the faster friction turns it towards the direction that holds its balance: its equations are
stiff, and have no direction at rest. But the motion on which all others fall is smooth in time. With the slide u = |u|
t along a unit vector t of the surface, and e normal to t in the surface, u · e = 0 at all times, and so

    u̇ · e + |u| t · ė = 0.

Nodes of a polynomial in time carry the angle of t, as friction acts against t, and the states that follow from it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from proofroll.core.arrays import cross as cross_of_rows
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.modes import Acting, ContactMode, direction_of
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.numerics.hybrid import Stretch
from proofroll.truth.switching.contact_guards import SolvedContacts

# First length of the beginning, in natural units, and how often it is halved where the iteration does not settle or the
# nodes do not resolve the motion. The longer it is, the less stiff is what follows.
_FIRST, _HALVINGS = 2.0, 20
SHORTEST = _FIRST * 2.0**-_HALVINGS  # of beginnings
_RESOLVED = 1e-14  # last coefficients of the states' series, relative to their sizes, that count as zero
# Change of a round over the larger one of the two rounds before, above which the iteration does not settle: where
# friction's direction first turns with the square of time, as a rolling resistance turns it, its change is seen one
# round after that of the states.
_SLOWEST = 0.7
_ROUNDS = 40  # of the iteration at most
_SETTLED = 1e-15  # change of states and angles in the last round, relative to their sizes
_STALLED = 1e-13  # change below which a round that changes no less than the one before is round-off
_TURN = 1e-4  # rad: by which the response to the direction of friction is measured
_FREE = 1e-6  # response to that direction, relative to the friction's own, below which other contacts fix the direction

_EMPTY = np.zeros((0, 0))

Rate = Callable[[Array, ContactMode], Array]
Solve = Callable[[Array, ContactMode], SolvedContacts]


class LedValues(NamedTuple):
    """Values at states of a mode in which a slip leads.

    Attributes:
        rates: of the states, (states, state).
        normals: of the surface at the first contact that leads, (states, 3).
        slides: its velocities, (states, 3).
        slide_rates: rates of these, (states, 3).
        guards: (states, guards); empty: not compiled.
    """

    rates: Array
    normals: Array
    slides: Array
    slide_rates: Array
    guards: Array = _EMPTY


# Values at states (states, state) with directions (states, 3) against which friction of all that leads acts.
Led = Callable[[Array, Array], LedValues]


@dataclass(frozen=True)
class BegunSlip(Stretch[ContactMode]):
    """The first instants of a slip from rest, by Chebyshev polynomials; an event may end it before these do.

    Attributes:
        length: of the polynomials [s].
        nodes: coefficients of states.
        ways: coefficients of the direction against which friction acts.
        compiled: values at states and directions; None: the mode is not compiled.
    """

    length: float = 0.0
    nodes: Any = None
    ways: Any = None
    compiled: Led | None = None

    def _of(self, series: Any, times: Array) -> Array:
        return np.asarray(chebyshev.chebval(2 * (times - self.start) / self.length - 1, series).T)

    def at(self, times: Array) -> Array:
        """States at times [s] within it, shape (times, state)."""
        return self._of(self.nodes, times)

    def mode_at(self, time: float) -> ContactMode:
        """Mode with the direction against which friction acts at a time [s]."""
        return with_heading(self.mode, self._of(self.ways, np.array(time)))

    def directions_at(self, times: Array) -> Array:
        """Directions against which friction acts at times [s], (times, 3)."""
        return self._of(self.ways, times)


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


def leading(acting: Acting, normal: Array, force: Array) -> Acting:
    """Mode of a contact that leaves rest in its plane, against the ``force`` that held it; ``acting``: mode before."""
    friction = force - normal * (normal @ force)
    x, y, z = (-friction / np.linalg.norm(friction)).tolist()
    return acting._replace(kind="slip", heading=(x, y, z), leads=True)


def leaving_slips(mode: ContactMode, solved: SolvedContacts, forces: Mapping[int, Array]) -> dict[int, Acting]:
    """Slips that start at the bound of friction, opposite to the friction that held each contact, in ``forces``."""
    slips = {}
    for k, force in forces.items():
        line = solved.mode[k].along
        if line is None:
            slips[k] = leading(mode[k], solved.touching[k].normal, force)
            continue
        sign = -1.0 if np.dot(line, force) > 0 else 1.0
        x, y, z = (sign * component for component in line)
        slips[k] = mode[k]._replace(kind="slip", along=(x, y, z), heading=(x, y, z))
    return slips


def with_heading(mode: ContactMode, way: Array) -> ContactMode:
    """The mode in which what leads slips in a direction, shape (3,)."""
    heading = direction_of(way)
    return tuple(acting._replace(heading=heading) if acting.leads else acting for acting in mode)


def led_by(mode: ContactMode, rate: Rate, solve: Solve) -> Led:
    """Values in a mode in which a slip leads, in numbers; ``rate``, ``solve``: of a state in a mode."""
    k = next(number for number, acting in enumerate(mode) if acting.leads)

    def value(state: Array, direction: Array) -> tuple[Array, Array, Array, Array]:
        led = with_heading(mode, direction)
        solved = solve(state, led)
        return rate(state, led), solved.touching[k].normal, solved.touching[k].slide, solved.slide_rate[k]

    return lambda *arguments: LedValues(*map(np.array, zip(*map(value, *arguments), strict=True)))


def begun_slip(
    time: float, state: Array, mode: ContactMode, until: float, led: Led, count: int, name: str
) -> BegunSlip:
    """First instants of the slip that leads in a mode, from a time [s] on, at most to ``until`` [s].

    Contacts of one face that lead together slip in one direction. Neither an end of this slip nor a change of another
    contact is asked for.

    Args:
        time: of the start.
        state: at the start.
        mode: in which one or more contacts lead.
        until: at most.
        led: values in that mode at states and directions.
        count: of nodes.
        name: of the contact, for messages.

    Raises:
        Refused: other contacts fix its direction, or it does not grow.
    """
    heading = next(acting.heading for acting in mode if acting.leads)
    length, nodes = min(_FIRST, until - time), _Nodes(count)
    for _ in range(_HALVINGS):
        settled = _settled(state, np.array(heading), length, nodes, led)
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


def _settled(state: Array, start: Array, length: float, nodes: _Nodes, led: Led) -> tuple[Array, Array] | None:
    """States and directions at the nodes of a beginning of a ``length``; ``start``: the first direction.

    None: the iteration does not settle, or nothing slips.
    """

    def directed(angles: Array, normals: Array) -> tuple[Array, Array]:
        """Directions at angles from the first one, and their normals in the surface."""
        ahead = start - normals * (normals @ start)[:, None]
        ahead = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
        aside, c, s = cross_of_rows(normals, ahead), np.cos(angles)[:, None], np.sin(angles)[:, None]
        return c * ahead + s * aside, c * aside - s * ahead

    normal, count = led(state[None], start[None]).normals, len(nodes.places)
    # response of the slide across to the angle of friction
    ways, across = directed(np.array([-_TURN, _TURN]), np.repeat(normal, 2, axis=0))
    rates, middle = led(np.repeat(state[None], 2, axis=0), ways).slide_rates, across.sum(axis=0)
    answer = float(middle / np.linalg.norm(middle) @ (rates[1] - rates[0])) / (2 * _TURN)
    if not abs(answer) > _FREE * float(np.abs(rates).max()) / _TURN:
        return None
    states, angles, changes = np.repeat(state[None], count, axis=0), np.zeros(count), [np.inf, np.inf]
    normals = np.repeat(normal, count, axis=0)
    for number in range(_ROUNDS):
        ways, across = directed(angles, normals)
        solutions = led(states, ways)
        normals = solutions.normals
        speeds = np.sum(solutions.slides * ways, axis=1)
        turning = nodes.derivative @ across / length
        left = np.sum(solutions.slide_rates * across, axis=1) + speeds * np.sum(ways * turning, axis=1)
        turns = np.linalg.solve(speeds[:, None] * nodes.derivative / length - answer * np.eye(count), left)
        turns[0] = 0.0
        new = state + length * nodes.integral @ solutions.rates
        change = max(float(np.abs(turns).max()), float(np.abs(new - states).max()))
        states, angles = new, angles + turns
        # the first round moves states alone, and the second one is the first to turn the slip
        if not np.isfinite(change) or (number > 2 and change > _STALLED and change > _SLOWEST * max(changes[-2:])):
            return None
        if change <= _SETTLED or (change <= _STALLED and change >= changes[-1] / 2):
            tail = np.abs((nodes.to_series @ states)[-2:]).max()
            resolved = tail <= _RESOLVED * max(1.0, float(np.abs(states).max()))
            return (states, ways) if resolved else None
        changes.append(change)
    return None
