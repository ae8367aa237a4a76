"""Coulomb's law at several contacts at once: forces f with w = G f + c, by Gauss-Seidel over the contacts.

The components of a contact are one normal and two tangential ones. N ≥ 0, w_n ≥ 0 and N w_n = 0; friction is at most
μN, and is μN against w_t where w_t is not zero. For accelerations, c is the acceleration without contact forces; for
an impact, the velocity before it plus what restitution returns. Dry friction of a joint has no normal force but a
bound of its own; it acts along the coordinate alone.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from proofroll.core.errors import NotUnique, Refused
from proofroll.elements.mechanism.analysis import RANK
from proofroll.elements.mechanism.contacts.lemke import lemke
from proofroll.elements.mechanism.rotations import Array

Outcome = Literal["open", "stick", "slip"]
_SWEEPS = 1000
_SETTLED = 1e-12  # largest change in the last sweep, relative to the largest force
_RESTS = 1e-10  # motion of a contact that counts as none, relative to the loads
# Margin, relative to friction's bound, above which a contact slides: closer to the bound round-off decides, and no
# direction of slip would be found. :func:`robust_forces` tells if an outcome depends on a change within the accuracy
# of the parameters.
_AT_BOUND = 1e-9
# Singular value of normal responses, and motion by a split of a load, relative to the largest, that count as zero.
_SHARES = 1e-9
# Relative change of loads and friction with which an outcome is tried on both sides; an outcome that changes is not
# unique. Each further contact gets an extra 0.382 of it: equal changes would cancel between two walls.
_NUDGE, _APART = 1e-6, 0.382
# Angles between which the direction of slip is searched; the offset keeps the axes inside an interval.
_DIRECTIONS = np.linspace(-np.pi, np.pi, 73) + 0.01
_WAYS = np.array([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])


def torn(name: str, time: float) -> NotUnique:
    """Error of Painlevé's paradox at a contact, from a time on [s]."""
    return NotUnique(
        f"{name} would not press but tear from t = {time:.6g} s on: its friction makes what follows not unique or not "
        "possible (Painlevé)"
    )


def contact_forces(
    G: Array,
    c: Array,
    friction: Array,
    sliding: Sequence[Array | None],
    names: Sequence[str],
    bounds: Array | None = None,
    time: float = 0.0,
    near: float = 0.0,
) -> tuple[Array, list[Outcome]]:
    """Forces of all contacts, shape (contacts, 3), and outcome of each contact.

    Args:
        G: (3 contacts, 3 contacts).
        c: (3 contacts).
        friction: coefficient of each.
        sliding: unit vector of slip along the surface, shape (2,), or None for a contact that does not slide yet;
            friction acts against it.
        names: for messages.
        bounds: largest friction of each contact without a normal force; 0, or None: a contact with one.
        time: for messages [s].
        near: part of the loads and of friction's bound that is round-off where all contacts stick.

    Raises:
        NotUnique: the force of a contact is not unique.
        Refused: no answer is found.
    """
    f, done = np.zeros(len(c)), list[Outcome](["open"] * len(friction))
    bounds = np.zeros(len(friction)) if bounds is None else bounds
    least = _RESTS * float(np.abs(c).max())
    if len(friction) > 1 and friction.all() and not bounds.any() and all(slip is None for slip in sliding):
        held = _all_held(G, c, friction, max(near, _RESTS), max(near, _AT_BOUND))
        if held is not None:
            return held.reshape(-1, 3), ["stick"] * len(friction)
    for _ in range(_SWEEPS):
        before = f.copy()
        for k, mu in enumerate(friction):
            own = slice(3 * k, 3 * k + 3)
            free = c[own] + G[own] @ f - G[own, own] @ f[own]
            if bounds[k]:
                f[own], done[k] = _rubbing(G[own, own], free, bounds[k], sliding[k])
            else:
                f[own], done[k] = _one(G[own, own], free, mu, sliding[k], (names[k], time), least)
        if np.abs(f - before).max() <= _SETTLED * np.abs(f).max():
            w = (c + G @ f).reshape(-1, 3)
            for k in _idle(G, w, friction, sliding, done, least):
                done[k] = "slip"
            for k, along in enumerate(sliding):
                rubs = friction[k] or bounds[k]
                if done[k] == "slip" and along is None and rubs and np.linalg.norm(w[k, 1:]) <= least:
                    done[k] = "stick"  # one of several holding contacts may reach its bound while nothing moves
            return f.reshape(-1, 3), done
    if not bounds.any() and all(along is not None or not mu for along, mu in zip(sliding, friction, strict=True)):
        ways = [np.zeros(2) if along is None else along for along in sliding]
        pressed = _all_sliding(G, c, friction, ways)
        if pressed is not None:
            leaving = (c + G @ pressed.ravel())[::3] > least  # one that shares a load may carry none of it, and stay
            return pressed, ["open" if leaves else "slip" for leaves in leaving]
    raise Refused(f"forces of the contacts {', '.join(names)} at t = {time:.6g} s are not found in {_SWEEPS} sweeps")


def _all_sliding(G: Array, c: Array, friction: Array, ways: Sequence[Array]) -> Array | None:
    """Forces of contacts that all slide, (contacts, 3), by complementarity of their normals; None: there are none.

    Sweeps converge slowly, or not at all, where many contacts share a load.
    """
    along = np.array([[1.0, *(-mu * way)] for mu, way in zip(friction, ways, strict=True)])
    pushes = np.zeros((len(c), len(along)))
    for k, push in enumerate(along):
        pushes[3 * k : 3 * k + 3, k] = push
    normals = lemke((G @ pushes)[::3], c[::3])
    return None if normals is None else normals[:, None] * along


def _idle(
    G: Array, w: Array, friction: Array, sliding: Sequence[Array | None], done: Sequence[Outcome], least: float
) -> list[int]:
    """Open contacts that do not part, if no split of the load that they share with others changes the motion.

    Of the corners of a face that slides without turning, one may carry nothing of the load, and stays closed.

    Args:
        G: as of :func:`contact_forces`.
        w: motion, (contacts, 3).
        friction: coefficients.
        sliding: as of :func:`contact_forces`.
        done: outcomes so far.
        least: motion that counts as none.
    """
    idle = [k for k, own in enumerate(done) if own == "open" and w[k, 0] <= least]
    if not (idle and least):
        return []
    closed = [k for k, own in enumerate(done) if own != "open" or k in idle]
    pushes = np.zeros((len(G), len(closed)))  # unit normal forces with their friction
    for place, k in enumerate(closed):
        speed = float(np.linalg.norm(w[k, 1:]))
        way = w[k, 1:] / speed if speed > least else np.zeros(2)
        along = sliding[k]
        pushes[3 * k : 3 * k + 3, place] = [1.0, *(-friction[k] * (way if along is None else along))]
    normals = [3 * k for k in closed]
    _, sizes, ways = np.linalg.svd(G[np.ix_(normals, normals)])
    splits = ways[(sizes > _SHARES * sizes[0]).sum() :]
    spread = np.abs(G @ pushes @ splits.T).max(initial=0.0)
    share = np.linalg.norm(splits, axis=0) > _SHARES
    return [k for k in idle if share[closed.index(k)]] if spread <= _SHARES * np.abs(G).max() else []


def _all_held(G: Array, c: Array, friction: Array, rests: float, near: float) -> Array | None:
    """Least forces that let every contact stick, if they press within the cones of friction; else None."""
    held = np.asarray(-np.linalg.pinv(G, 1e-12, hermitian=True) @ c, dtype=np.float64)
    N, T = held[::3], np.linalg.norm(held.reshape(-1, 3)[:, 1:], axis=1)
    sticks = (
        np.abs(c + G @ held).max() <= rests * np.abs(c).max()
        and (N > 0).all()
        and (friction * N * (1 + near) >= T).all()
    )
    return held if sticks else None


def robust_forces(
    G: Array,
    c: Array,
    friction: Array,
    sliding: Sequence[Array | None],
    names: Sequence[str],
    bounds: Array | None = None,
    time: float = 0.0,
    least: float = 0.0,
) -> tuple[Array, list[Outcome], bool]:
    """Solution as of :func:`contact_forces`, and True if slightly changed pressure and friction give the same outcomes.

    A contact whose force is at most a ``least`` part of the largest force counts as open.
    """
    bounds = np.zeros(len(friction)) if bounds is None else bounds
    force, done = contact_forces(G, c, friction, sliding, names, bounds, time)
    own = np.diag(G)[::3]
    # as a force at each contact, which the holds of the other contacts balance
    lift = np.where(own > 0, (1 + _APART * np.arange(len(own))) / np.where(own > 0, own, 1), 0.0)
    nudge = _NUDGE * float(np.abs(c).max()) * G[:, ::3] @ lift

    def outcome(force: Array, done: Sequence[Outcome]) -> list[Outcome]:
        little = least * float(np.abs(force).max())
        return ["open" if each[0] <= little and least else own for each, own in zip(force, done, strict=True)]

    nominal = outcome(force, done)
    same = all(
        outcome(*contact_forces(G, c + side * nudge, friction * part, sliding, names, bounds * part, time)) == nominal
        for side, part in ((1.0, 1 - _NUDGE), (-1.0, 1 + _NUDGE))
    )
    return force, done, same


def _rubbing(G: Array, c: Array, bound: float, sliding: Array | None) -> tuple[Array, Outcome]:
    """Force and outcome of friction without a normal, along a line, while all other forces stay."""
    if sliding is not None:
        return np.array([0.0, *(-bound * sliding)]), "slip"
    held = -np.linalg.pinv(G, 1e-12, hermitian=True) @ c
    size = float(np.linalg.norm(held))
    return (held, "stick") if size <= bound * (1 + _AT_BOUND) else (held * (bound / size), "slip")


def _one(
    G: Array, c: Array, mu: float, sliding: Array | None, where: tuple[str, float], least: float
) -> tuple[Array, Outcome]:
    """Force and outcome of one contact while the other forces stay; a motion up to ``least`` counts as none.

    ``where``: its name and the time [s], for messages.
    """
    if c[0] >= 0:
        return np.zeros(3), "open"
    if sliding is not None or not mu:
        return _pressing(G, c, mu, np.zeros(2) if sliding is None else sliding, where), "slip"
    from scipy.optimize import brentq  # half a second, which most uses of a mechanism do not need

    held = -np.linalg.pinv(G, 1e-12, hermitian=True) @ c
    rests = float(np.abs(c + G @ held).max()) <= least  # joints may let a contact that rebounds do nothing but slide
    if rests and np.linalg.norm(held[1:]) <= mu * held[0] * (1 + _AT_BOUND):
        return held, "stick"

    def across(angle: float) -> float:
        """Component of the slip perpendicular to the direction that friction opposes; zero at the solution."""
        t = np.array([np.cos(angle), np.sin(angle)])
        w = c + G @ _pressing(G, c, mu, t, where)
        return float(w[2] * t[0] - w[1] * t[1])

    values = _across(G, c, mu, where)
    pairs = zip(_DIRECTIONS[:-1], _DIRECTIONS[1:], values[:-1], values[1:], strict=True)
    for low, high, at_low, at_high in pairs:
        if at_low * at_high > 0:
            continue
        angle = low if at_low == 0 else brentq(across, low, high, xtol=1e-15, rtol=1e-15)
        t = np.array([np.cos(angle), np.sin(angle)])
        f = _pressing(G, c, mu, t, where)
        if (c + G @ f)[1:] @ t > 0:
            return f, "slip"
    raise Refused("no direction of slip at {} at t = {:.6g} s is against its friction".format(*where))


def _across(G: Array, c: Array, mu: float, where: tuple[str, float]) -> Array:
    """Component of the slip perpendicular to what friction opposes, for each of the searched directions."""
    along = np.vstack([np.ones(len(_DIRECTIONS)), -mu * _WAYS])
    response = G[0] @ along
    if response.min() <= 0:
        raise torn(*where)
    w = c[1:, None] + G[1:] @ (along * (-c[0] / response))
    return np.asarray(w[1] * _WAYS[0] - w[0] * _WAYS[1])


def _pressing(G: Array, c: Array, mu: float, t: Array, where: tuple[str, float]) -> Array:
    """Force of a contact that slides along t with its gap kept closed. Raises NotUnique in Painlevé's paradox."""
    along = np.array([1.0, *(-mu * t)])
    response = float(G[0] @ along)
    if response <= 0:
        raise torn(*where)
    return np.asarray(-c[0] / response * along)


def least_motion_for(W: Array, K: Array, violation: Array) -> Array:
    """Motion of least kinetic energy that makes these violations of rows K, (nv)."""
    return np.asarray(W @ K.T @ (np.linalg.pinv(K @ W @ K.T, RANK, hermitian=True) @ violation))
