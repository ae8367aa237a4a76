"""Coulomb's law at several contacts at once: forces f with w = G f + c, by Gauss-Seidel over the contacts.

The components of a contact are one normal and two tangential ones. N ≥ 0, w_n ≥ 0 and N w_n = 0; friction is at most
μN, and is μN against w_t where w_t is not zero. For accelerations, c is the acceleration without contact forces; for
an impact, the velocity before it plus what restitution returns. Dry friction of a joint has no normal force but a
bound of its own; it acts along the coordinate alone.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from proofroll.core.arrays import uneven
from proofroll.core.errors import Refused
from proofroll.elements.mechanism.contact.distributions import best_distribution, cones_of
from proofroll.elements.mechanism.contact.one_contact import AT_BOUND, ModeKind, force_of_one, rubbing
from proofroll.elements.mechanism.contact.rolling_and_spin import Presser
from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.scene.rotations import Array

_SWEEPS = 1000
_SETTLED = 1e-12  # largest change in the last sweep, relative to the largest force
_RESTS = 1e-10  # motion of a contact that counts as none, relative to the loads
# Singular value of normal responses, and motion by a split of a load, relative to the largest, that count as zero.
_SHARES = 1e-9
# Relative change of loads and friction with which an outcome is tried on both sides; an outcome that changes is not
# unique. Each further contact gets an extra 0.382 of it: equal changes would cancel between two walls.
_NUDGE, _APART = 1e-6, 0.382
_ROUND_OFF = 1e-14  # of motions, in parts of what they are the sum of: a light body between heavy ones has 2e-16
NULL = 1e-12  # response to forces, relative to the largest of unit rows, that counts as none: round-off is 1e-16


def largest_friction(friction: Any, normal: Any) -> Any:
    """Largest friction by coefficients, which may be infinite, and normal forces; 0 without a normal force."""
    unbounded = np.isinf(friction)
    return np.where(
        unbounded, np.where(np.greater(normal, 0), np.inf, 0.0), np.where(unbounded, 0.0, friction) * normal
    )


def natural_rows(G: Array) -> Array:
    """Natural unit of each row of responses, the root of the force that it needs: bodies of any mass may touch."""
    diagonal = np.diag(G)
    return np.asarray(1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0)))


def returning(slides: Array, restitution: Array, sideways: Array) -> Array:
    """Slides before an impact plus what restitution returns of them, (3 contacts,), where a contact closes.

    Args:
        slides: first components along the normals, (3 contacts,).
        restitution: of the normal speeds.
        sideways: of the slips.
    """
    parts = slides.reshape(-1, 3).copy()
    closes = parts[:, 0] < 0
    parts[closes, 0] *= 1 + restitution[closes]
    parts[closes, 1:] *= 1 + sideways[closes, None]
    return np.asarray(parts.ravel())


def contact_forces(
    G: Array,
    c: Array,
    friction: Array,
    sliding: Sequence[Array | None],
    names: Sequence[str],
    bounds: Array | None = None,
    time: float = 0.0,
    near: float = 0.0,
    static: Array | None = None,
    guess: Sequence[ModeKind] | None = None,
    pressed_by: Sequence[Presser | None] | None = None,
) -> tuple[Array, list[ModeKind]]:
    """Forces of all contacts, shape (contacts, 3), and outcome of each contact.

    Args:
        G: (3 contacts, 3 contacts).
        c: (3 contacts).
        friction: coefficient of each while it slips.
        sliding: unit vector of slip along the surface, shape (2,), or None for a contact that does not slide yet;
            friction acts against it.
        names: for messages.
        bounds: largest friction of each contact without a normal force; 0, or None: a contact with one.
        time: for messages [s].
        near: part of the loads and of friction's bound that is round-off where all contacts stick.
        static: coefficient of each while it sticks; None: as while it slips.
        guess: outcomes whose forces the sweeps start from; None: all press that can.
        pressed_by: contact whose normal force bounds the moment of a friction against turning; None: an own normal
            force, or a bound. While it slips, resistance against motion has no influence on that, and opposes its rate.

    Raises:
        NotUnique: the force of a contact is not unique.
        Refused: no answer is found.
    """
    done = list[ModeKind](["open"] * len(friction))
    bounds = np.zeros(len(friction)) if bounds is None else bounds
    pressing = [None] * len(friction) if pressed_by is None else pressed_by
    turns = any(by is not None for by in pressing)
    _check_directions(G, c, names, time)
    f = np.zeros(len(c)) if turns else _guessed(G, c, friction, sliding, bounds, guess)
    static = friction if static is None else static
    least = _RESTS * float(np.abs(c).max())

    def led(k: int) -> bool:
        """True for resistance against motion whose contact slips."""
        by = pressing[k]
        return by is not None and bool(by.bend) and done[by.place] == "slip"

    if len(friction) > 1 and (friction + bounds).all() and all(slip is None for slip in sliding):
        sticking_forces = _all_held(
            G, c, static, bounds, max(near, _RESTS), max(near, AT_BOUND), [by and by.place for by in pressing]
        )
        if sticking_forces is not None:
            return sticking_forces.reshape(-1, 3), ["stick"] * len(friction)
    for _ in range(_SWEEPS):
        last_forces = f.copy()
        for k, mu in enumerate(friction):
            part = slice(3 * k, 3 * k + 3)
            free = c[part] + G[part] @ f - G[part, part] @ f[part]
            by = pressing[k]
            bound = bounds[k] if by is None else mu * max(float(f[3 * by.place]), 0.0)
            if by is not None and (not bound or (led(k) and sliding[k] is None)):
                f[part], done[k] = _against_rate(c + G @ f, (k, by.place), by.bend, bound, least)
            elif bound:
                f[part], done[k] = rubbing(G[part, part], free, bound, sliding[k])
            else:
                f[part], done[k] = force_of_one(
                    G[part, part], free, (mu, static[k]), sliding[k], (names[k], time), least
                )
        if len(friction) == 1 or np.abs(f - last_forces).max() <= _SETTLED * np.abs(f).max():
            w = (c + G @ f).reshape(-1, 3)
            for k in [] if turns else _idle(G, w, friction, sliding, done, least):
                done[k] = "slip"
            for k, way in enumerate(sliding):
                rubs = friction[k] or bounds[k]
                if done[k] == "slip" and way is None and rubs and not led(k) and np.linalg.norm(w[k, 1:]) <= least:
                    done[k] = "stick"  # one of several holding contacts may reach its bound while nothing moves
            return f.reshape(-1, 3), done
    together = None if bounds.any() or turns else _together(G, c, friction, sliding, least)
    if together is not None:
        return together
    raise Refused(f"forces of the contacts {', '.join(names)} at t = {time:.6g} s are not found in {_SWEEPS} sweeps")


def _against_rate(
    rates: Array, which: tuple[int, int], bend: float, bound: float, least: float
) -> tuple[Array, ModeKind]:
    """Moment against the rate at which a ball's centre begins to move, and outcome; ``which``: it, what presses."""
    (across, aside), (slide, slide_aside) = (rates[3 * k + 1 : 3 * k + 3].tolist() for k in which)
    rate = np.array([0.0, across - bend * slide_aside, aside + bend * slide])  # with n × (x, y) = (-y, x)
    size = float(np.linalg.norm(rate))
    return (-bound / size * rate, "slip") if bound and size > least else (np.zeros(3), "open")


def _check_directions(G: Array, c: Array, names: Sequence[str], time: float) -> None:
    """Refuse contacts whose normal is not defined."""
    if not (np.isfinite(G).all() and np.isfinite(c).all()):
        raise Refused(
            f"contacts {', '.join(names)} at t = {time:.6g} s: one of them has no direction: centres or axes coincide"
        )


def _guessed(
    G: Array,
    c: Array,
    friction: Array,
    sliding: Sequence[Array | None],
    bounds: Array,
    guess: Sequence[ModeKind] | None,
) -> Array:
    """Forces for a guess of outcomes, from which sweeps start; zero where a direction of slip is not known."""
    rows, pushes, f = list[int](), list[Array](), np.zeros(len(c))
    for k, slip in enumerate(sliding):
        kind = "stick" if slip is None else "slip"
        if guess is not None:
            kind = guess[k]
        if kind == "open":
            continue
        if kind == "stick" and slip is None and (friction[k] or bounds[k]):
            ways = [1, 2] if bounds[k] else [0, 1, 2]
            rows += [3 * k + way for way in ways]
            pushes += [np.eye(len(c))[3 * k + way] for way in ways]
        elif slip is None and (friction[k] or bounds[k]):
            return np.zeros(len(c))
        elif bounds[k]:
            assert slip is not None
            f[3 * k + 1 : 3 * k + 3] = -bounds[k] * slip
        else:
            push = np.zeros(len(c))
            push[3 * k : 3 * k + 3] = [1.0, *(-friction[k] * (np.zeros(2) if slip is None else slip))]
            rows.append(3 * k)
            pushes.append(push)
    if not rows:
        return f
    D = np.array(pushes).T
    forces = f + D @ np.linalg.lstsq((G @ D)[rows], -(c + G @ f)[rows], rcond=_SHARES)[0]
    return np.asarray(forces) if (forces[::3] >= 0).all() else np.zeros(len(c))


def _all_sliding(G: Array, c: Array, friction: Array, ways: Sequence[Array]) -> Array | None:
    """Forces of contacts that all slide, (contacts, 3), by complementarity of their normals; None: there are none.

    Sweeps converge slowly, or not at all, where many contacts share a load.
    """
    directions = np.array([[1.0, *(-mu * way)] for mu, way in zip(friction, ways, strict=True)])
    pushes = np.zeros((len(c), len(directions)))
    for k, push in enumerate(directions):
        pushes[3 * k : 3 * k + 3, k] = push
    normals = lemke((G @ pushes)[::3], c[::3])
    return None if normals is None else normals[:, None] * directions


def _together(
    G: Array, c: Array, friction: Array, sliding: Sequence[Array | None], least: float
) -> tuple[Array, list[ModeKind]] | None:
    """Forces and outcomes of contacts that all slide already, or set off in one direction; None: neither."""
    if all(way is not None or not mu for way, mu in zip(sliding, friction, strict=True)):
        ways = [np.zeros(2) if way is None else way for way in sliding]
        pressed = _all_sliding(G, c, friction, ways)
        if pressed is None:
            return None
        leaving = (c + G @ pressed.ravel())[::3] > least  # one that shares a load may carry none of it, and stay
        return pressed, ["open" if leaves else "slip" for leaves in leaving]
    if np.isfinite(friction).all() and all(way is None for way in sliding):
        pressed = _all_setting_off(G, c, friction, least)
        return None if pressed is None else (pressed, ["slip"] * len(friction))
    return None


def _all_setting_off(G: Array, c: Array, friction: Array, least: float) -> Array | None:
    """Forces of contacts at rest that all set off in the direction that they would have without friction; None: not so.

    Sweeps converge slowly, or not at all, where feet of one body share friction at its bound.
    """
    free = c.reshape(-1, 3)[:, 1:]
    speeds = np.linalg.norm(free, axis=1)
    if speeds.min() <= least:
        return None
    ways = free / speeds[:, None]
    pressed = _all_sliding(G, c, friction, list(ways))
    if pressed is None:
        return None
    moves = (c + G @ pressed.ravel()).reshape(-1, 3)
    ahead = np.einsum("ki,ki->k", moves[:, 1:], ways)
    aside = moves[:, 1:] - ahead[:, None] * ways
    sets_off = ahead.min() > 0 and np.abs(aside).max() <= least and np.abs(moves[:, 0]).max() <= least
    return pressed if sets_off else None


def _idle(
    G: Array, w: Array, friction: Array, sliding: Sequence[Array | None], done: Sequence[ModeKind], least: float
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
    idle = [k for k, kind in enumerate(done) if kind == "open" and w[k, 0] <= least]
    if not (idle and least):
        return []
    closed_contacts = [k for k, kind in enumerate(done) if kind != "open" or k in idle]
    pushes = np.zeros((len(G), len(closed_contacts)))  # unit normal forces with their friction
    for place, k in enumerate(closed_contacts):
        speed = float(np.linalg.norm(w[k, 1:]))
        way = w[k, 1:] / speed if speed > least else np.zeros(2)
        slip = sliding[k]
        mu = friction[k] if np.isfinite(friction[k]) else 0.0  # what never slips has no friction of a slip
        pushes[3 * k : 3 * k + 3, place] = [1.0, *(-mu * (way if slip is None else slip))]
    normals = [3 * k for k in closed_contacts]
    _, sizes, ways = np.linalg.svd(G[np.ix_(normals, normals)])
    splits = ways[(sizes > _SHARES * sizes[0]).sum() :]
    spread = np.abs(G @ pushes @ splits.T).max(initial=0.0)
    share = np.linalg.norm(splits, axis=0) > _SHARES
    return [k for k in idle if share[closed_contacts.index(k)]] if spread <= _SHARES * np.abs(G).max() else []


def _all_held(
    G: Array, c: Array, friction: Array, bounds: Array, rests: float, near: float, pressing: Sequence[int | None]
) -> Array | None:
    """Forces that let every contact stick and press within the bounds of friction, in any distribution; else None."""
    scale = natural_rows(G)
    values, vectors = np.linalg.eigh(G * np.outer(scale, scale))
    whole = values > NULL * values[-1]
    forces: Array = -scale * (vectors[:, whole] @ ((vectors[:, whole].T @ (scale * c)) / values[whole]))
    rounded = _ROUND_OFF * float((scale * (np.abs(G) @ np.abs(forces))).max())
    if np.abs(scale * (c + G @ forces)).max() > max(rests * float(np.abs(scale * c).max()), rounded):
        return None
    count = len(friction)
    cones = cones_of(
        kinds=["stick"] * count,
        normals=np.tile([1.0, 0.0, 0.0], (count, 1)),
        friction=friction,
        bounds=bounds,
        pressed_by=pressing,
        force=forces.reshape(count, 3),
        shifts=(scale[:, None] * vectors[:, ~whole]).reshape(count, 3, -1),
    )
    if cones.hold(np.zeros(len(whole) - whole.sum()), near):
        return forces
    best = best_distribution(cones)
    if best is None or not cones.hold(best.weights, near):
        return None
    return np.asarray(forces + scale * (vectors[:, ~whole] @ best.weights))


def robust_forces(
    G: Array,
    c: Array,
    friction: Array,
    sliding: Sequence[Array | None],
    names: Sequence[str],
    bounds: Array | None = None,
    time: float = 0.0,
    least: float = 0.0,
    static: Array | None = None,
    pressed_by: Sequence[Presser | None] | None = None,
) -> tuple[Array, list[ModeKind], bool]:
    """Solution as of :func:`contact_forces`, and True if slightly changed pressure and friction give the same outcomes.

    A contact whose normal force moves it by at most a ``least`` part of the largest such motion counts as open.
    """
    bounds = np.zeros(len(friction)) if bounds is None else bounds
    static = friction if static is None else static
    force, done = contact_forces(G, c, friction, sliding, names, bounds, time, static=static, pressed_by=pressed_by)
    # as a force at each contact that presses, which the holds of the other contacts balance
    diagonal, pressing = np.diag(G)[::3], [None] * len(friction) if pressed_by is None else pressed_by
    presses = (diagonal > 0) & (bounds == 0) & np.array([by is None for by in pressing])
    lift = np.where(presses, (1 + _APART * np.arange(len(diagonal))) / np.where(presses, diagonal, 1), 0.0)
    nudge = _NUDGE * float(np.abs(c).max()) * G[:, ::3] @ lift

    def outcome(force: Array, done: Sequence[ModeKind]) -> list[ModeKind]:
        speeds = diagonal * force[:, 0]
        little = least * float(speeds.max())
        return ["open" if speed <= little and least else kind for speed, kind in zip(speeds, done, strict=True)]

    nominal = outcome(force, done)
    same = all(
        outcome(
            *contact_forces(
                G,
                c + side * nudge,
                friction * part,
                sliding,
                names,
                bounds * part,
                time,
                static=static * part,
                guess=done,
                pressed_by=pressed_by,
            )
        )
        == nominal
        for side, part in ((1.0, 1 - _NUDGE), (-1.0, 1 + _NUDGE))
    )
    return force, done, same


def least_motion_for(W: Array, K: Array, violation: Array) -> Array:
    """Motion of least kinetic energy that makes these violations of rows K, (nv)."""
    return np.asarray(W @ K.T @ (np.linalg.pinv(K @ W @ K.T, RANK, hermitian=True) @ violation))


_PIVOTS = 50  # at most, for each unknown
_ZERO = 1e-12  # entries of the tableau, relative to the largest of their column, that count as zero


def lemke(M: Array, q: Array) -> Array | None:
    """Solution z, shape (n,), of a linear complementarity problem; None: the method ends on a ray."""
    n = len(q)
    scale = float(np.abs(q).max(initial=0.0))
    if q.min(initial=0.0) >= 0:
        return np.zeros(n)
    # w − M z − d z0 = q; the entries of d differ, so that no two rows leave at once where contacts are alike
    d = uneven(n)
    tableau = np.column_stack([np.eye(n), -M, -d, q / scale])
    basis = list(range(n))  # w is 0 … n − 1, z is n … 2n − 1, z0 is 2n
    row, entering = int(np.argmin(tableau[:, -1] / d)), 2 * n
    for _ in range(_PIVOTS * n):
        leaving = basis[row]
        tableau[row] /= tableau[row, entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, entering], tableau[row])
        basis[row] = entering
        if leaving == 2 * n:
            break
        entering = leaving + n if leaving < n else leaving - n
        column = tableau[:, entering]
        able = np.flatnonzero(column > _ZERO * np.abs(column).max())
        if not len(able):
            return None
        ratios = np.maximum(tableau[able, -1], 0.0) / column[able]
        ties = able[ratios <= ratios.min() + _ZERO]
        row = next((int(k) for k in ties if basis[k] == 2 * n), int(ties[0]))
    else:
        return None
    z = np.zeros(2 * n + 1)
    z[basis] = tableau[:, -1]
    return scale * np.maximum(z[n : 2 * n], 0.0)
