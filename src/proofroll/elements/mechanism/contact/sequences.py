"""Impacts of several contacts one after the other, in many orders, in the space of their slides."""

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.core.number_format import number
from proofroll.elements.mechanism.contact.modes import REST
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.scene.rotations import Array

# Impulses of contacts struck together, (3 contacts,), from the changes of their slides by unit impulses, their slides
# (3 contacts,) and their indices.
Strike = Callable[[Array, Array, list[int]], Array]

_CLOSES = 4e-15  # normal speed, relative to the largest slide before an impact, that counts as none
_ALIKE = 1e-9  # difference of normal speeds, relative to the largest slide, with which a face lands flat
# Difference of outcomes, relative to the largest jump of a velocity, up to which an impact has an outcome. Feet of a
# robot that land together differ by 3e-5.
SPREAD = 1e-3
# Difference of impacts in turn from that of all contacts at one time, up to which it counts as an error of the model:
# routes take one each, so that it is part of the bars.
AT_ONCE = 1e-2
_MOST = 4000  # impacts of one sequence at most
_ALL = 3  # groups of which every order is tried; of more, those round the groups, both ways


class Outcomes(NamedTuple):
    """Outcomes of the sequences of an impact.

    Attributes:
        impulses: sum over the impacts of each contact, for each order, (orders, 3 contacts).
        complete: True if every sequence comes to its end: nothing closes any more.
    """

    impulses: Array
    complete: bool


def groups_of(pairs: Sequence[str], slides: Array, *, together: bool) -> list[list[int]]:
    """Indices of contacts that are struck together: all, or corners of a face that land at the same speed.

    A face that lands flat touches all over, and no real face is so flat that its corners have an order.

    Args:
        pairs: pair of each contact.
        slides: before the impact, (3 contacts,).
        together: True if the scene takes all contacts at one time.
    """
    if together:
        return [list(range(len(pairs)))]
    least = max(_ALIKE * float(np.abs(slides).max()), REST)
    groups: list[list[int]] = []
    for k, pair in enumerate(pairs):
        alike = (g for g in groups if pairs[g[0]] == pair and abs(slides[3 * g[0]] - slides[3 * k]) <= least)
        group = next(alike, None)
        if group is None:
            groups.append([k])
        else:
            group.append(k)
    return groups


def sequences(G: Array, slides: Array, groups: Sequence[list[int]], strike: Strike) -> Outcomes:
    """Sums of impulses of each contact, by orders in which groups of contacts that close are struck.

    An order is a list of priorities, or it goes round. A group is struck as often as others close it again.

    Args:
        G: changes of all slides by unit impulses, (3 contacts, 3 contacts); first components are along the normals.
        slides: before the impact, (3 contacts,).
        groups: indices of contacts that are struck together.
        strike: law of the impact of one group.
    """
    results: list[Array] = []
    complete = True
    for order, round_robin in _orders(groups):
        impulses = _sequence(G, slides, strike, order, round_robin=round_robin)
        complete &= impulses is not None
        if impulses is not None and not any(np.array_equal(impulses, result) for result in results):
            results.append(impulses)
    return Outcomes(np.array(results).reshape(-1, len(slides)), complete)


def left_by(slides: Array, least: float) -> list[str]:
    """Mode of each contact behind an impact (open, slip or stick), from the slides after it, (3 contacts,).

    ``least``: speed above which a contact moves.
    """
    parts = slides.reshape(-1, 3)
    slips = np.where(np.linalg.norm(parts[:, 1:], axis=1) > least, "slip", "stick")
    return list(np.where(parts[:, 0] > least, "open", slips).tolist())


def refuse_spread(
    jumps: Array,
    outcomes: Outcomes,
    names: Iterable[str],
    time: float,
    at_once: Array | None = None,
    *,
    alike: bool = True,
) -> None:
    """Refuses an impact whose outcomes differ too much.

    Args:
        jumps: change of the velocities by each outcome, in columns.
        outcomes: of all orders.
        names: of the contacts, for messages.
        time: for messages [s].
        at_once: change of the velocities by the impact of all contacts at one time; None: not compared.
        alike: True if that impact leaves the same contacts open, slipping and sticking.

    Raises:
        NotUnique: the outcomes of the orders differ by more than ``SPREAD`` of the largest jump of a velocity, or by
            more than ``AT_ONCE`` from the impact of all at one time, or leave other contacts closed.
    """
    both = jumps if at_once is None else np.column_stack([at_once, jumps])
    size = float(np.abs(both).max(initial=0.0)) or 1.0
    by_order, by_law = (float(np.ptp(spread, axis=1).max(initial=0.0)) / size for spread in (jumps, both))
    if not outcomes.complete:
        why = "one after the other they hit each other infinitely often"
    elif by_order > SPREAD:
        why = f"its outcome depends on their order, by {number(by_order, 2)} of the jump of the velocities"
    elif by_law > AT_ONCE or not alike:
        why = f"impacts in turn and at once differ by {number(by_law, 2)} of the jump of the velocities"
        why += "" if alike else ", and in which contacts stick, slip or open"
    else:
        return
    raise NotUnique(
        f"an impact at t = {time:.6g} s presses {' and '.join(names)} at once: {why}; "
        'impacts = "together" in the scene takes them at one time'
    )


def _orders(groups: Sequence[list[int]]) -> list[tuple[tuple[list[int], ...], bool]]:
    """Orders of groups, each as priorities and going round."""
    index = tuple(groups)
    if len(index) == 1:
        return [(index, False)]
    if len(index) <= _ALL:
        orders = list(itertools.permutations(index))
    else:
        turned = [index[k:] + index[:k] for k in range(len(index))]
        orders = turned + [order[::-1] for order in turned]
    return [(order, way) for order in orders for way in (False, True)]


def _sequence(
    G: Array, slides: Array, strike: Strike, order: Sequence[list[int]], *, round_robin: bool
) -> Array | None:
    """Sums of the impulses of one sequence, (3 contacts,); None: it does not end."""
    w, impulses, last = slides.copy(), np.zeros(len(slides)), -1
    least = _CLOSES * float(np.abs(slides).max())
    rows = [np.concatenate([np.arange(3 * k, 3 * k + 3) for k in group]) for group in order]
    for _ in range(_MOST):
        places = [place for place, row in enumerate(rows) if w[row[::3]].min() < -least]
        if not places:
            return impulses
        last = next((place for place in places if round_robin and place > last), places[0])
        row = rows[last]
        impulse = strike(G[np.ix_(row, row)], w[row], order[last])
        impulses[row] += impulse
        w = w + G[:, row] @ impulse
    return None


def ordered(G: Array, lossy: Array, hit: Array) -> tuple[int, int] | None:
    """Two contacts whose order decides the outcome of an impact; None: it is the same in any order.

    Impacts without coupling are independent. Smooth plastic contacts, if none opens another, press more and more in any
    order, up to the least impulses after which nothing closes (least elements of Z-matrices: R. W. Cottle, J.-S. Pang
    and R. E. Stone, The Linear Complementarity Problem, 1992). Moreau's law for all contacts at once gives the same.

    Args:
        G: changes of all slides by unit impulses, (3 contacts, 3 contacts).
        lossy: True for contacts with friction or restitution.
        hit: True for contacts that close, or that the outcome presses.
    """
    blocks, least = G.reshape(len(hit), 3, len(hit), 3), RANK * float(np.abs(G).max())
    coupled = np.abs(blocks).max(axis=(1, 3)) > least
    opens = (blocks[:, 0, :, 0] > least) & ~np.eye(len(hit), dtype=bool)
    for a, b in itertools.combinations(np.flatnonzero(hit).tolist(), 2):
        if coupled[a, b] and (opens[[a, b]].any() or lossy[coupled[a] | coupled[b]].any()):
            return a, b
    return None
