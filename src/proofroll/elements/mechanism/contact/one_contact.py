"""Coulomb's law at one contact, while the forces of all others stay."""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.touching import torn
from proofroll.elements.mechanism.scene.rotations import Array

ModeKind = Literal["open", "stick", "slip"]  # of a contact between two events
# Margin, relative to friction's bound, above which a contact slides: closer to the bound round-off decides, and no
# direction of slip would be found. :func:`.robust_forces` tells if an outcome depends on a change within the accuracy
# of the parameters.
AT_BOUND = 1e-9
# Angles between which the direction of slip is searched; the offset keeps the axes inside an interval.
_DIRECTIONS = np.linspace(-np.pi, np.pi, 73) + 0.01
_WAYS = np.array([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])


def rubbing(G: Array, c: Array, bound: float, sliding: Array | None) -> tuple[Array, ModeKind]:
    """Force and outcome of friction without a normal, along a line or in a plane, while all other forces stay."""
    if sliding is not None:
        return np.array([0.0, *(-bound * sliding)]), "slip"
    force = -np.linalg.pinv(G, 1e-12, hermitian=True) @ c
    size = float(np.linalg.norm(force))
    if size <= bound * (1 + AT_BOUND):
        return force, "stick"
    low, high = np.linalg.eigvalsh(G[1:, 1:])
    if high - low <= AT_BOUND * high or low <= AT_BOUND * high:  # alike in all directions, or along a line alone
        return force * (bound / size), "slip"

    def moved(t: Array) -> Array:
        return np.asarray((c[1:] - bound * (G[1:, 1:] @ t).T).T)

    for t in _parallel(moved, _cross(moved(_WAYS), _WAYS)):
        if moved(t) @ t > 0:
            return np.array([0.0, *(-bound * t)]), "slip"
    raise Refused("no solution for friction against turning that depends on the direction")


def _cross(w: Array, t: Array) -> Array:
    """Component of a plane vector, or of several, perpendicular to a unit vector each; (2,) or (2, vectors)."""
    return np.asarray(w[1] * t[0] - w[0] * t[1])


def _parallel(moved: Callable[[Array], Array], across: Array) -> Iterator[Array]:
    """Directions along which a contact moves if its friction acts along them, (2,) each.

    Args:
        moved: motion by the direction of friction, (2,).
        across: its component perpendicular to each of the searched directions.
    """
    from scipy.optimize import brentq  # half a second, which most uses of a mechanism do not need

    def way(angle: float) -> Array:
        return np.array([np.cos(angle), np.sin(angle)])

    def turned(angle: float) -> float:
        return float(_cross(moved(way(angle)), way(angle)))

    for low, high, at_low, at_high in zip(_DIRECTIONS[:-1], _DIRECTIONS[1:], across[:-1], across[1:], strict=True):
        if at_low * at_high <= 0:
            yield way(low if at_low == 0 else brentq(turned, low, high, xtol=1e-15, rtol=1e-15))


def force_of_one(
    G: Array, c: Array, friction: tuple[float, float], sliding: Array | None, place: tuple[str, float], least: float
) -> tuple[Array, ModeKind]:
    """Force and outcome of one contact while the other forces stay; a motion up to ``least`` counts as none.

    ``friction``: coefficients while it slips and sticks; ``place``: its name and the time [s], for messages.
    """
    mu, static = friction
    if c[0] >= 0:
        return np.zeros(3), "open"
    if np.isinf(mu):
        return _held(G, c, sliding, place, least), "stick"
    if sliding is not None or not mu:
        return _pressing(G, c, mu, np.zeros(2) if sliding is None else sliding, place), "slip"
    sticking_force = -np.linalg.pinv(G, 1e-12, hermitian=True) @ c
    # Joints may let a contact that rebounds do nothing but slide.
    rests = float(np.abs(c + G @ sticking_force).max()) <= least
    if rests and np.linalg.norm(sticking_force[1:]) <= static * sticking_force[0] * (1 + AT_BOUND):
        return sticking_force, "stick"

    def moved(t: Array) -> Array:
        return np.asarray((c + G @ _pressing(G, c, mu, t, place))[1:])

    for t in _parallel(moved, _across(G, c, mu, place)):
        if moved(t) @ t > 0:
            return _pressing(G, c, mu, t, place), "slip"
    raise Refused("no direction of slip at {} at t = {:.6g} s is against its friction".format(*place))


def _held(G: Array, c: Array, sliding: Array | None, place: tuple[str, float], least: float) -> Array:
    """Force of a contact that never slips.

    Raises:
        Refused: the contact slides, or nothing can hold it.
        NotUnique: the contact would tear.
    """
    sticking_force = np.asarray(-np.linalg.pinv(G, 1e-12, hermitian=True) @ c)
    if sliding is not None or float(np.abs(c + G @ sticking_force).max()) > least:
        raise Refused("{} at t = {:.6g} s would slip, but has friction = inf; give it a number".format(*place))
    if sticking_force[0] <= 0:
        raise torn(*place)
    return sticking_force


def _across(G: Array, c: Array, mu: float, place: tuple[str, float]) -> Array:
    """Component of the slip perpendicular to what friction opposes, for each of the searched directions."""
    directions = np.vstack([np.ones(len(_DIRECTIONS)), -mu * _WAYS])
    response = G[0] @ directions
    if response.min() <= 0:
        raise torn(*place)
    w = c[1:, None] + G[1:] @ (directions * (-c[0] / response))
    return _cross(w, _WAYS)


def _pressing(G: Array, c: Array, mu: float, t: Array, place: tuple[str, float]) -> Array:
    """Force of a contact that slides along t with its gap kept closed. Raises NotUnique in Painlevé's paradox."""
    direction = np.array([1.0, *(-mu * t)])
    response = float(G[0] @ direction)
    if response <= 0:
        raise torn(*place)
    return np.asarray(-c[0] / response * direction)
