"""Impulses of a step by blocks: Gauss-Seidel over contacts with their exact cones, dry friction and stops of joints.

It takes Pinocchio's matrices, and finds impulses where Pinocchio's own solvers stop, as with dry friction in joints.
Each block is solved exactly for the impulses of the others: a contact sticks, or slips along a direction that is the
root of one equation.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from operator import mul
from typing import NamedTuple

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.elements.mechanism.scene.rotations import Array

# Change of velocity in a sweep at which it ends: relative to the largest speed, or part of the tolerance where that is
# more; and largest number of sweeps.
_SETTLED, _PART, _SWEEPS = 1e-12, 1e-2, 2000
# Sweeps after which it may go round in circles, as contacts of one foot share its load; then each step is a part of it.
_CIRCLES, _SHORTER = 200, 0.6
# Sweeps between two solutions of all equations of what sticks and presses at once.
_TOGETHER = 2
# Sweeps without half the change, after which a change within the tolerance is round-off that no sweep takes away.
_PATIENCE = 2 * _TOGETHER
_ACCEPTED = 1e-5  # change that is taken where no solver reaches the tolerance
_TURNS, _LONGEST_TURN = 40, 0.7  # steps of a search for a direction, and the longest of them [rad]
_FLAT = 1e-12  # determinant of a contact's mobility, relative to its largest cubed, that may be round-off
_ALONG = 1e-10  # slip across a direction, relative to the largest speed, that is found


class Block(NamedTuple):
    """Rows of one contact, or of one joint's friction or stop.

    Attributes:
        first: number of the first row; those of a contact are turns that share its cone, two slips and the normal.
        friction: coefficient of a contact; None: a joint's row.
        bound: largest impulse of a joint's dry friction [N m s or N s]; inf: a stop, which only presses.
        turns: number of rows of turning.
    """

    first: int
    friction: float | None
    bound: float = math.inf
    turns: int = 0

    @property
    def least(self) -> float:
        """Least impulse of a joint's row."""
        return 0.0 if math.isinf(self.bound) else -self.bound

    @property
    def rows(self) -> slice:
        """All rows."""
        return slice(self.first, self.first + (1 if self.friction is None else 3 + self.turns))


class BlockSolver:
    """Solver of a run, which begins each time with the impulses of the last.

    Attributes:
        solved: number of problems that it has solved.
        worst: largest change of velocity in a last sweep, relative to the largest speed, of impulses that were taken.
    """

    def __init__(self, tolerance: float) -> None:
        """``tolerance``: largest change of velocity in the last sweep, relative to the largest speed."""
        self._tolerance, self._last, self.solved = tolerance, dict[int, Array](), 0
        self.worst = 0.0

    def impulses(self, G: Array, g: Array, blocks: Mapping[int, Block], otherwise: Callable[[], Array]) -> Array:
        """Impulses of the rows.

        Args:
            G: Delassus matrix of the rows.
            g: their velocities without impulses, with shifts.
            blocks: all rows, by a number that a contact or joint keeps from step to step.
            otherwise: another solver, for rows whose sweeps do not reach the tolerance.

        Raises:
            Diverged: neither finds them, or a velocity is not finite.
        """
        if not (np.isfinite(g).all() and np.isfinite(G).all()):
            raise Diverged("the state is not finite")
        guess = np.zeros(len(g))
        for number, block in blocks.items():
            guess[block.rows] = self._last.get(number, 0.0)
        impulses, change = impulses_by_blocks(G, g, list(blocks.values()), guess, self._tolerance)
        if not change <= self._tolerance:
            try:
                impulses, change = otherwise(), 0.0
            except Diverged:
                if not change <= _ACCEPTED:
                    raise
        self._last = {number: impulses[block.rows] for number, block in blocks.items()}
        self.solved, self.worst = self.solved + 1, max(self.worst, change)
        return impulses


def impulses_by_blocks(
    G: Array, g: Array, blocks: Sequence[Block], guess: Array, tolerance: float
) -> tuple[Array, float]:
    """Impulses, and the change of velocity in the last sweep relative to the largest speed; see :class:`BlockSolver`.

    Args:
        G: Delassus matrix of the rows.
        g: their velocities without impulses, with shifts.
        blocks: all rows.
        guess: impulses to begin with.
        tolerance: change of velocity, relative to the largest speed, below which sweeps end as soon as it stalls.
    """
    f, speed = guess.copy(), float(np.abs(g).max()) or 1.0
    u, change, settled = g + G @ f, math.inf, max(_SETTLED, _PART * tolerance)
    if guess.any():  # mostly what stuck still sticks
        f, u = _closer(G, g, u, f, blocks)
    joints = [(block.first, block.least, block.bound) for block in blocks if block.friction is None]
    contacts = [
        (block.rows, G[block.rows, block.rows].tolist(), G[block.rows], block.friction)
        for block in blocks
        if block.friction is not None
    ]
    shared = {block.first: _SharedCone(G[block.rows, block.rows], block) for block in blocks if block.turns}
    diagonal = G.diagonal().tolist()
    part = 1.0  # of the way to a block's own solution
    least, fell = math.inf, 0  # smallest change, and the last sweep that halved it
    for sweep in range(1, _SWEEPS):
        part = part if sweep % _CIRCLES else _SHORTER * part
        change = 0.0
        for row, lowest, bound in joints:
            old, mobility = float(f[row]), diagonal[row]
            if step := part * (min(max(old - float(u[row]) / mobility, lowest), bound) - old):
                u += step * G[row]
                f[row] += step
                change = max(change, abs(step * mobility))
        for rows, mobility, response, friction in contacts:
            impulse, velocities = f[rows].tolist(), u[rows].tolist()
            free = [
                velocity - sum(map(mul, responses, impulse))
                for velocity, responses in zip(velocities, mobility, strict=True)
            ]
            cone = shared.get(rows.start)
            new = cone.impulse(free) if cone else _contact(mobility, free, friction, impulse, speed)
            steps = [part * (a - b) for a, b in zip(new, impulse, strict=True)]
            if any(steps):
                u += steps @ response
                f[rows] += steps
                change = max(change, *(abs(step * mobility[k][k]) for k, step in enumerate(steps)))
        if change < least / 2:
            least, fell = change, sweep
        stalls = sweep - fell >= _PATIENCE and change <= tolerance * part * speed
        if stalls or not change > settled * part * speed:
            break
        if sweep % _TOGETHER == 0 and part == 1.0:
            f, u = _closer(G, g, u, f, blocks)
    return f, change / (part * speed)


def _closer(G: Array, g: Array, u: Array, f: Array, blocks: Sequence[Block]) -> tuple[Array, Array]:
    """Impulses and velocities with all that sticks and presses solved at once; unchanged if that leaves a cone."""
    closer = f + _at_once(G, u, f, blocks)
    sizes = closer.tolist()
    if all(_allowed(sizes[block.rows], block) for block in blocks):
        return closer, g + G @ closer
    return f, u


def _at_once(G: Array, u: Array, f: Array, blocks: Sequence[Block]) -> Array:
    """Change of impulses that stops all rows that stick or press, while slips keep their directions."""
    sizes, sticking, slipping = f.tolist(), list[int](), list[slice]()
    for block in blocks:
        own_rows, impulse = block.rows, sizes[block.rows]
        if block.friction is None:
            sticking += [block.first] if 0 < abs(impulse[0]) < block.bound else []
        elif math.hypot(*impulse[:-1]) < block.friction * impulse[-1] * (1 - _SETTLED):
            sticking += range(own_rows.start, own_rows.stop)
        elif impulse[-1] > 0:
            slipping.append(own_rows)
    change = np.zeros(len(f))
    if not sticking and not slipping:
        return change
    held = [*sticking, *(own_rows.stop - 1 for own_rows in slipping)]
    rows, moves = G[held], [f[own_rows] / f[own_rows.stop - 1] for own_rows in slipping]
    slip_columns = [rows[:, own_rows] @ move for own_rows, move in zip(slipping, moves, strict=True)]
    parts = np.linalg.lstsq(np.column_stack([rows[:, sticking], *slip_columns]), -u[held], rcond=None)[0]
    change[sticking] = parts[: len(sticking)]
    for own_rows, move, part in zip(slipping, moves, parts[len(sticking) :], strict=True):
        change[own_rows] = part * move
    return change


def _allowed(impulse: Sequence[float], block: Block) -> bool:
    """True if a block can have an impulse, but for round-off."""
    if block.friction is None:
        return block.least <= impulse[0] <= block.bound
    return math.hypot(*impulse[:-1]) <= block.friction * impulse[-1] * (1 + _SETTLED)


def _contact(
    G: Sequence[Sequence[float]], b: Sequence[float], mu: float, guess: Sequence[float], speed: float
) -> list[float]:
    """Impulse of a contact: slips and normal; ``b``: its velocity without it, ``guess``: the one before."""
    if b[2] >= 0:
        return [0.0, 0.0, 0.0]
    if not mu:
        return [0.0, 0.0, -b[2] / G[2][2]]
    x, y, normal = _sticking(G, b)
    if normal > 0 and math.hypot(x, y) <= mu * normal:
        return [x, y, normal]
    best, least = list(guess), math.inf
    directions = [(-guess[0], -guess[1]), (b[0], b[1]), (-x, -y)]
    for x, y in directions:
        if not (x or y):
            continue
        impulse, off = _slipping(G, b, mu, math.atan2(y, x))
        if off < least:
            best, least = impulse, off
        if least < _ALONG * speed:
            break
    return best


class _SharedCone:
    """A contact whose slips and turns share a cone.

    What slips has friction F against its slip u = -λ F: with the eigenvalues of the mobility along the surface, while
    the normal velocity is 0, |F| = mu N is one equation for λ.
    """

    def __init__(self, G: Array, block: Block) -> None:
        """Takes the responses of its rows, the normal last."""
        self._mu, self._easy, self._push = block.friction or 0.0, float(G[-1, -1]), G[:-1, -1]
        sizes, self._ways = np.linalg.eigh(G[:-1, :-1] - np.outer(self._push, self._push) / self._easy)
        self._sizes = np.where(sizes > _FLAT * sizes[-1], sizes, math.inf).tolist()  # nothing moves along the others
        self._pulls: list[float] = (self._ways.T @ self._push).tolist()

    def impulse(self, b: Sequence[float]) -> list[float]:
        """Impulse of its rows; ``b``: its velocity without it."""
        from scipy.optimize import brentq  # half a second, which few runs need

        if b[-1] >= 0:
            return [0.0] * len(b)
        parts = ((self._push * (b[-1] / self._easy) - b[:-1]) @ self._ways).tolist()

        def along(resistance: float) -> list[float]:
            return [part / (size + resistance) for part, size in zip(parts, self._sizes, strict=True)]

        def normal(friction: Sequence[float]) -> float:
            return -float(sum(map(mul, self._pulls, friction)) + b[-1]) / self._easy

        def excess(resistance: float) -> float:
            friction = along(resistance)
            return math.hypot(*friction) - self._mu * normal(friction)

        resistance, most = 0.0, max(size for size in self._sizes if math.isfinite(size))
        if excess(0.0) > 0:
            while excess(most) > 0:
                most *= 4.0
            resistance = float(brentq(excess, 0.0, most, xtol=_SETTLED**2 * most, rtol=_SETTLED))
        friction = along(resistance)
        return [*(self._ways @ friction).tolist(), normal(friction)]


def _sticking(G: Sequence[Sequence[float]], b: Sequence[float]) -> tuple[float, float, float]:
    """Impulse by which a contact comes to rest: the solution of G f = -b."""
    (g00, g01, g02), (_, g11, g12), (_, _, g22) = G
    c00, c01, c02 = g11 * g22 - g12 * g12, g02 * g12 - g01 * g22, g01 * g12 - g02 * g11
    c11, c12, c22 = g00 * g22 - g02 * g02, g01 * g02 - g00 * g12, g00 * g11 - g01 * g01
    size = -(g00 * c00 + g01 * c01 + g02 * c02)
    if -size <= _FLAT * max(g00, g11, g22) ** 3:  # a body that moves in a plane alone: it gives way in two directions
        x, y, normal = np.linalg.lstsq(np.array(G), -np.array(b), rcond=_FLAT)[0].tolist()
        return x, y, normal
    return (
        (b[0] * c00 + b[1] * c01 + b[2] * c02) / size,
        (b[0] * c01 + b[1] * c11 + b[2] * c12) / size,
        (b[0] * c02 + b[1] * c12 + b[2] * c22) / size,
    )


def _slipping(G: Sequence[Sequence[float]], b: Sequence[float], mu: float, angle: float) -> tuple[list[float], float]:
    """Impulse N (-mu cos, -mu sin, 1) of a slip in the direction of an angle near this one, and the slip across it.

    N stops the approach; the direction is that of the slip that is left. The slip across is inf where none is found.
    """
    (g00, g01, g02), (_, g11, g12), (_, _, g22) = G
    step = math.inf
    for _ in range(_TURNS):
        c, s = math.cos(angle), math.sin(angle)
        press = g22 - mu * (g02 * c + g12 * s)
        if press <= 0:
            return [0.0, 0.0, 0.0], math.inf
        normal = -b[2] / press
        pull_x, pull_y = g02 - mu * (g00 * c + g01 * s), g12 - mu * (g01 * c + g11 * s)
        x, y = b[0] + normal * pull_x, b[1] + normal * pull_y
        if abs(step) < _SETTLED:
            break
        rate = normal * mu * (g12 * c - g02 * s) / press
        dx = rate * pull_x + normal * mu * (g00 * s - g01 * c)
        dy = rate * pull_y + normal * mu * (g01 * s - g11 * c)
        slope = c * dy - s * dx - (s * y + c * x)
        if not slope:
            break
        step = min(max(-(c * y - s * x) / slope, -_LONGEST_TURN), _LONGEST_TURN)
        angle += step
    impulse = [-mu * normal * c, -mu * normal * s, normal]
    return impulse, abs(c * y - s * x) if c * x + s * y >= 0 else math.inf
