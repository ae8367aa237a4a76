"""Distributions of a load that contacts share: the one that keeps the inequalities of contact best.

Forces f + S w with any weights w cause one motion. Their friction holds if any w keeps all N ≥ 0 and T ≤ μN: the set of
these is convex. The largest margin of all inequalities is found by Newton's method on a logarithmic barrier of the
cones (S. Boyd and L. Vandenberghe, Convex Optimization, 2004, section 11.6), and extrapolated to none.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from proofroll.elements.mechanism.dynamics.analysis import RANK
from proofroll.elements.mechanism.scene.rotations import Array

# Weights of the barrier, relative to the forces. The margins of the last two lie on a line in the weight, whose end at
# zero is known to about the square of the last.
_BARRIERS = 10.0 ** -np.array([0, 2, 4, 6, 7, 8])
_NEWTON = 50  # steps for one weight at most; about five are taken
_CENTRED = 1e-7  # Newton decrement that counts as none; the error of the margin is this part of the barrier's weight
_FULL = 0.25  # Newton decrement below which full steps are taken: they converge quadratically
_ROUND_OFF = 1e-13  # force of a contact, relative to the largest, that counts as none
# Largest weights that are tried, relative to the load, and those above which they grow without bound: by contacts that
# press each other.
_FARTHEST, _JAMMED = 1e4, 1e3


class ContactCones(NamedTuple):
    """Inequalities T ≤ r of contacts, whose bounds r and forces T are linear in the weights of a distribution.

    Attributes:
        bound: r without weights [N], (contacts,).
        bound_rates: its change with the weights, (contacts, ways).
        held: T without weights [N], (contacts, 3).
        held_rates: its change with the weights, (contacts, 3, ways).
    """

    bound: Array
    bound_rates: Array
    held: Array
    held_rates: Array

    def hold(self, weights: Array, near: float) -> bool:
        """True if all contacts press and are held; ``near``: part of a bound by which friction may exceed it."""
        bound, friction = self.bound + self.bound_rates @ weights, self.held + self.held_rates @ weights
        size = float(np.abs(np.column_stack([bound, friction])).max(initial=0.0))
        least = _ROUND_OFF * size  # of a contact that bears nothing of a load
        return bool((bound * (1 + near) + least >= np.linalg.norm(friction, axis=1)).all() and (bound >= -least).all())


class Distribution(NamedTuple):
    """Distribution of a shared load with the largest margin.

    Attributes:
        margin: least r − T of the contacts that share it [N]; negative: no distribution keeps all inequalities.
        weights: of the ways to split the load, (ways,).
        speeds: of the contacts in the motion that starts where the margin is zero, relative; their sum is 1.
    """

    margin: float
    weights: Array
    speeds: Array


def cones_of(
    kinds: Sequence[str],
    normals: Array,
    friction: Array,
    bounds: Array,
    pressed_by: Sequence[int | None],
    force: Array,
    shifts: Array,
) -> ContactCones:
    """Inequalities of closed contacts.

    Args:
        kinds: mode of each contact: ``open``, ``slip`` or ``stick``.
        normals: of the contacts, (contacts, 3).
        friction: coefficient of each while it sticks.
        bounds: largest friction of contacts without a normal force; 0 of others.
        pressed_by: contact whose normal force bounds the friction; None: the own.
        force: one distribution, (contacts, 3).
        shifts: changes with the ways to split the load, (contacts, 3, ways).
    """
    count, ways = shifts.shape[0], shifts.shape[2]
    whole = np.concatenate([force[:, :, None], shifts], axis=2)
    pressed = np.einsum("ki,kiw->kw", normals, whole)
    across = whole - normals[:, :, None] * pressed[:, None]
    r, T = np.zeros((count, 1 + ways)), np.zeros((count, 3, 1 + ways))
    for k, (kind, by) in enumerate(zip(kinds, pressed_by, strict=True)):
        if kind == "stick" and bounds[k]:
            r[k, 0], T[k] = bounds[k], across[k]
        elif kind == "stick" and by is not None:
            r[k], T[k] = friction[k] * pressed[by], whole[k]
        elif kind == "stick" and np.isfinite(friction[k]):
            r[k], T[k] = friction[k] * pressed[k], across[k]
        elif kind != "open" and by is None and not bounds[k]:
            r[k] = pressed[k]
    return ContactCones(r[:, 0], r[:, 1:], T[:, :, 0], T[:, :, 1:])


def best_distribution(cones: ContactCones) -> Distribution | None:
    """Distribution with the largest margin; None: no weight changes an inequality.

    Where contacts can press each other without bound, as a wedge between two walls, nothing says how much they do: that
    is the distribution without weights.
    """
    count, ways = cones.bound_rates.shape
    rates = np.concatenate([cones.bound_rates[:, None], cones.held_rates], axis=1)
    sharing = np.flatnonzero(np.abs(rates).max(axis=(1, 2), initial=0.0) > RANK)
    if not len(sharing):
        return None
    _, sizes, seen = np.linalg.svd(rates[sharing].reshape(-1, ways))
    basis = seen[: int((sizes > RANK * sizes[0]).sum())].T  # ways that an inequality sees
    size = float(np.abs(np.column_stack([cones.bound, cones.held])[sharing]).max()) or 1.0
    values = np.column_stack([cones.bound, cones.held])[sharing] / size
    answers = _most(values, rates[sharing] @ basis)
    margin, weights, speeds = ((10 * near - far) / 9 for far, near in zip(*answers, strict=True))
    whole = np.zeros(count)
    if float(np.linalg.norm(weights)) > _JAMMED:
        room = cones.bound[sharing] - np.linalg.norm(cones.held[sharing], axis=1)
        whole[sharing[np.argmin(room)]] = 1.0
        return Distribution(float(room.min()), np.zeros(ways), whole)
    whole[sharing] = speeds
    return Distribution(size * float(margin[0]), size * basis @ weights, whole)


def _most(values: Array, rates: Array) -> list[tuple[Array, Array, Array]]:
    """Margin, weights and multipliers by the last two barriers.

    Args:
        values: bounds and forces without weights, relative to the largest, (contacts, 4).
        rates: their changes with the weights, (contacts, 4, ways).
    """
    count, _, ways = rates.shape
    # components of bounds and forces first, then contacts, so that one product serves all; last unknown: the margin
    sides = np.zeros((4 * count, ways + 1))
    sides[:, :-1] = rates.transpose(1, 0, 2).reshape(4 * count, ways)
    sides[:count, -1] = -1.0
    plain, x, answers = values.T.ravel(), np.zeros(ways + 1), list[tuple[Array, Array, Array]]()
    x[-1] = float((values[:, 0] - np.linalg.norm(values[:, 1:], axis=1)).min()) - 1.0
    mirror = np.array([1.0, -1.0, -1.0, -1.0])[:, None]
    for weight in _BARRIERS:
        for _ in range(_NEWTON):
            s = (plain + sides @ x).reshape(4, count)
            room = (mirror * s * s).sum(axis=0)
            pulls = mirror * (-2 / room)
            slopes = (sides * (pulls * s).reshape(-1, 1)).reshape(4, count, -1).sum(axis=0)
            gradient = slopes.sum(axis=0)
            hessian = sides.T @ (sides * pulls.reshape(-1, 1)) + slopes.T @ slopes
            gradient[-1] -= 1 / weight
            far = _FARTHEST**2 - float(x[:-1] @ x[:-1])
            outward = np.append(2 * x[:-1] / far, 0.0)
            gradient, hessian = gradient + outward, hessian + outward[:, None] * outward
            hessian[range(ways), range(ways)] += 2 / far
            step = -np.linalg.solve(hessian, gradient)
            decrement = float(np.sqrt(max(-float(gradient @ step), 0.0)))
            x = x + step / (1.0 if decrement < _FULL else 1 + decrement)
            if decrement < _CENTRED:
                break
        s = (plain + sides @ x).reshape(4, count)
        answers.append((x[-1:], x[:-1], 2 * weight * s[0] / (mirror * s * s).sum(axis=0)))
    return answers[-2:]
