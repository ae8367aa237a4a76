"""Screen of mistakes by what they do in each interval of a motion that was seen.

Each interval begins at the state that was seen, and has the masses and the forces of inertia of the motion that was
seen. So errors do not add up, the state decides what a policy observes, and hundreds of laws move at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import null_space

from proofroll.core.engine import whole_steps
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake

_FACTORS = (0.0, 0.3, 0.6, 0.85, 0.95, 1.0, 1.05, 1.2, 1.6, 2.5)  # sizes that are tried, 1 being right
_AT_ONCE = 500  # laws that move at once: some 100 MB
_SLOPE, _ROUNDS = 1e-3, 3  # part of a size for slopes, and rounds of a fit
_ALONE = (-0.4, -0.2, -0.1, 0.1, 0.2, 0.4)  # values of a number that are tried [rad, m, or parts]
_SWEEPS, _HELPS = 4, 0.7  # sweeps through these values, and the part that a sweep must leave at most
# Treatments of gains: kd at the velocity before a step, or after it; or at four stages.
Treatment = Literal["explicit", "implicit", "rk4"]
TREATMENTS: tuple[Treatment, ...] = ("explicit", "implicit", "rk4")


@dataclass(frozen=True)
class Screened:
    """Mistake as the screen sees it.

    Attributes:
        mistake: the mistake.
        size: its size that leaves least; 1 where it has none.
        treatment: of gains.
        left: mean square of the velocities that it leaves unexplained, weighted with masses.
    """

    mistake: Mistake
    size: float
    treatment: Treatment
    left: float


class MistakeScreen:
    """Trials of laws in each interval of a motion.

    Attributes:
        law: of the controller as it should be.
        stride: steps in an interval.
    """

    def __init__(self, mechanism: Mechanism, law: ControlLaw, q: Array, v: Array, step: float, stride: int) -> None:
        self.law, self.step, self.stride = law, step, stride
        bare = law.change(armature=np.zeros(len(law.joints)), gravity=1.0)
        self._robot = AirRobot(mechanism, bare)
        weightless = AirRobot(replace(mechanism, gravity=(0.0, 0.0, 0.0)), bare)
        self._states, self._coupled = [*self._between(q, v)], bool(self._robot.equations.rank)
        mass, inertial, weight, free = [], [], [], []
        for state in self._states[:-1]:
            M = self._robot.equations.inertial(self._robot.equations.tree.at(*state))[1]
            mass.append(M)
            inertial.append(M @ weightless.equations.solve(*state).acceleration)
            weight.append(M @ self._robot.equations.solve(*state).acceleration - inertial[-1])
            free.append(null_space(self._robot.equations.rows(state[0]).C) if self._coupled else np.eye(len(M)))
        self._mass, self._inertial, self._weight = np.array(mass), np.array(inertial), np.array(weight)
        self._free = np.array(free)  # directions that couplings allow, (steps, nv, freedoms)
        self._roots = np.linalg.cholesky(self._mass[::stride])
        self._seen = v[1:]
        places = self._robot.driven
        self._at_v = places[:, 1]
        self._q = np.array([item[0][places[:, 0]] for item in self._states])
        self._v = np.array([item[1] for item in self._states])
        self._actions: dict[tuple[object, ...], list[Array]] = {}

    def _between(self, q: Array, v: Array) -> list[tuple[Array, Array]]:
        """States at all steps, between samples by constant accelerations."""
        states = []
        for row in range(len(q) - 1):
            slope = (v[row + 1] - v[row]) / (self.stride * self.step)
            for k in range(self.stride):
                t = k * self.step
                moved = q[row] if k == 0 else self._robot.equations.tree.moved(q[row], t * v[row] + t * t / 2 * slope)
                states.append((moved, v[row] + t * slope))
        return [*states, (q[-1], v[-1])]

    def _acted(self, law: ControlLaw) -> list[Array]:
        """Actions at the instants of a law, which observes the motion that was seen."""
        period = max(1, whole_steps(0.0, 1 / law.rate, self.step) + law.extra_steps)
        key = (period, *law.observing)
        if key not in self._actions:
            answer, (last, _), actions = law.answer(), law.waiting(), []
            assert answer is not None  # the caller knows that there is a policy
            for k in range(0, len(self._states), period):
                last = answer(law.observed(self._robot.state(law.begins + k * self.step, *self._states[k]), last))
                actions.append(last)
            self._actions[key] = actions
        return self._actions[key]

    def _targets(self, law: ControlLaw) -> Array:
        """Targets of a law in all steps, (steps, n)."""
        period = max(1, whole_steps(0.0, 1 / law.rate, self.step) + law.extra_steps)
        times = law.begins + self.step * np.arange(0, len(self._states), period)
        actions = [None] * len(times) if law.policy is None else self._acted(law)
        counts, targets = law.waiting()[0], []
        for action, time in zip(actions, times, strict=True):
            counts = counts if action is None else law.smoothed(action, counts)
            targets.append(law.target(None if action is None else counts, float(time)))
        delayed = np.array([*law.waiting()[1], *targets])
        return delayed[np.arange(len(self._states) - 1) // period]

    def left(self, laws: Sequence[ControlLaw], treatment: Treatment) -> Array:
        """Velocities that laws leave unexplained, weighted with masses, (laws, numbers)."""
        parts = [laws[k : k + _AT_ONCE] for k in range(0, len(laws), _AT_ONCE)]
        return np.concatenate([self._left(part, treatment) for part in parts])

    def _left(self, laws: Sequence[ControlLaw], treatment: Treatment) -> Array:
        targets = np.array([self._targets(law) for law in laws])
        kp, kd, limit, armature, factor = (
            np.array([getattr(law, name) * np.ones(len(law.joints)) for law in laws])[:, None]
            for name in ("kp", "kd", "limit", "armature", "effort_factor")
        )
        gravity = np.array([law.gravity for law in laws])[:, None, None]
        lag, holds = (
            np.array([bool(getattr(law, name)) for law in laws])[:, None, None] for name in ("lag", "hold_effort")
        )
        every, h = slice(None, None, self.stride), self.step
        q, v = (np.tile(item[:-1][every], (len(laws), 1, 1)) for item in (self._q, self._v))
        previous = np.maximum(np.arange(len(self._states) - 1)[every] - 1, 0)
        late = (
            np.tile(self._q[previous], (len(laws), 1, 1)),
            np.tile(self._v[previous][..., self._at_v], (len(laws), 1, 1)),
        )
        for k in range(self.stride):
            rows = slice(k, None, self.stride)
            state = q, v[..., self._at_v]
            instants = self._instants(laws, rows) if holds.any() else None
            inertial = self._inertial[rows] + gravity * self._weight[rows]
            inverse = None if treatment == "implicit" else self._inverses(rows, armature[:, 0])

            def efforts(
                seen: tuple[Array, Array], instants: tuple[Array, Array] | None = instants, rows: slice = rows
            ) -> Array:
                at_q, at_v = (
                    seen if instants is None else (np.where(holds, *pair) for pair in zip(instants, seen, strict=True))
                )
                return np.asarray(factor * np.clip(kp * (targets[:, rows] - at_q) - kd * at_v, -limit, limit))

            def accelerated(
                acting: Array, inverse: Array | None = inverse, inertial: Array = inertial, rows: slice = rows
            ) -> Array:
                load = inertial.copy()
                load[..., self._at_v] += acting
                if inverse is not None:
                    return np.asarray(np.einsum("hkij,hkj->hki", inverse, load))
                free = (np.abs(acting) < limit) & ~holds  # what is clamped does not follow
                return self._solved(rows, armature + h * np.where(free, kd, 0.0), load)

            acting = efforts((np.where(lag, late[0], state[0]), np.where(lag, late[1], state[1])))
            if treatment != "rk4":
                v = v + h * accelerated(acting)
                q = q + h * v[..., self._at_v]
            else:
                rates = [(state[1], accelerated(acting))]
                for part in (h / 2, h / 2, h):
                    moved = state[1] + part * rates[-1][1][..., self._at_v]
                    rates.append((moved, accelerated(efforts((q + part * rates[-1][0], moved)))))
                q = q + h / 6 * (rates[0][0] + 2 * rates[1][0] + 2 * rates[2][0] + rates[3][0])
                v = v + h / 6 * (rates[0][1] + 2 * rates[1][1] + 2 * rates[2][1] + rates[3][1])
            late = state
        unexplained = np.einsum("kji,hkj->hki", self._roots, v - self._seen)
        return np.asarray(unexplained.reshape(len(laws), -1))

    def _instants(self, laws: Sequence[ControlLaw], rows: slice) -> tuple[Array, Array]:
        """Coordinates and rates of the driven joints at the instant before each step, of each law."""
        steps = np.arange(len(self._states) - 1)[rows]
        periods = np.array([max(1, whole_steps(0.0, 1 / law.rate, self.step) + law.extra_steps) for law in laws])
        instants = steps // periods[:, None] * periods[:, None]
        return self._q[instants], self._v[instants][..., self._at_v]

    def _inverses(self, rows: slice, armature: Array) -> Array:
        """Inverse mass matrices at steps for the armatures of laws (laws, n), (laws, steps, nv, nv)."""
        kinds, number = np.unique(armature, axis=0, return_inverse=True)
        return np.asarray(self._inverse(self._mass[rows], self._free[rows], kinds[:, None])[number.ravel()])

    def _inverse(self, mass: Array, free: Array, added: Array) -> Array:
        """Inverses of mass matrices with armatures that are added, among the directions that couplings allow."""
        shape = np.broadcast_shapes(mass.shape[:-2], added.shape[:-1])
        matrices = np.broadcast_to(mass, (*shape, *mass.shape[-2:])).copy()
        matrices[..., self._at_v, self._at_v] += added
        if not self._coupled:
            return np.asarray(np.linalg.inv(matrices))
        turned = np.swapaxes(free, -1, -2)
        return np.asarray(free @ np.linalg.inv(turned @ matrices @ free) @ turned)

    def _solved(self, rows: slice, added: Array, load: Array) -> Array:
        """Accelerations at steps under loads (laws, steps, nv), for armatures (laws, steps, n)."""
        answer = np.empty_like(load)
        for k, (M, free) in enumerate(zip(self._mass[rows], self._free[rows], strict=True)):
            kinds, number = np.unique(added[:, k], axis=0, return_inverse=True)
            answer[:, k] = np.einsum("hij,hj->hi", self._inverse(M, free, kinds)[number.ravel()], load[:, k])
        return answer

    @property
    def unexplained(self) -> float:
        """Mean square of the velocities that the law itself leaves unexplained, with the best treatment of gains."""
        return min(float(np.square(self.left([self.law], treatment)).mean()) for treatment in TREATMENTS)

    def best(self, candidates: Sequence[Mistake]) -> list[Screened]:
        """Mistakes with their sizes in each treatment of gains, those that leave least first."""
        trials = [(item, size) for item in candidates for size in (item.trials or _FACTORS if item.sized else (1.0,))]
        laws = [item.changed(self.law, size) for item, size in trials]
        screened: list[Screened] = []
        for treatment in TREATMENTS:
            squares = np.square(self.left(laws, treatment)).mean(axis=1)
            ranked: dict[str, Screened] = {}
            for number in np.argsort(squares):
                mistake, size = trials[number]
                ranked.setdefault(mistake.words, Screened(mistake, size, treatment, float(squares[number])))
            screened += self._fitted([*ranked.values()], treatment)
        return sorted(screened, key=lambda item: item.left)

    def _fitted(self, items: list[Screened], treatment: Treatment) -> list[Screened]:
        """Mistakes with sizes that fit best, by Gauss-Newton, all at once."""
        fixed, sized = ([item for item in items if item.mistake.sized is kind] for kind in (False, True))
        for _ in range(_ROUNDS if sized else 0):
            sizes = np.array([item.size for item in sized])
            changes = _SLOPE * np.maximum(sizes, _SLOPE)
            left, moved = (self.left(_laws(self.law, sized, tried), treatment) for tried in (sizes, sizes + changes))
            slopes = (moved - left) / changes[:, None]
            squares = np.square(slopes).sum(axis=1)
            steps = -np.divide((slopes * left).sum(axis=1), squares, out=np.zeros_like(squares), where=squares > 0)
            better = np.maximum(0.0, sizes + steps)
            unexplained = np.square(self.left(_laws(self.law, sized, better), treatment)).mean(axis=1).tolist()
            sized = [
                replace(item, size=size, left=square) if square < item.left else item
                for item, size, square in zip(sized, better.tolist(), unexplained, strict=True)
            ]
        return fixed + sized

    def numbers(self, law: Callable[[Array], ControlLaw], count: int, treatment: Treatment) -> tuple[Array, float]:
        """Numbers of a law with which it leaves least, and what it leaves.

        Gauss-Newton, again from other values of each number alone: where an effort is clamped, slopes tell nothing.
        """
        best = np.zeros(count), float(np.square(self.left([law(np.zeros(count))], treatment)).mean())
        for _ in range(_SWEEPS):
            trials = np.array([best[0]] * (count * len(_ALONE)))
            trials[np.arange(len(trials)), np.repeat(np.arange(count), len(_ALONE))] = np.tile(_ALONE, count)
            squares = np.square(self.left([law(values) for values in trials], treatment)).mean(axis=1)
            squares_by_number = squares.reshape(count, -1)
            several = np.where(
                squares_by_number.min(axis=1) < best[1], np.array(_ALONE)[squares_by_number.argmin(axis=1)], best[0]
            )
            starts = [best[0], trials[int(np.argmin(squares))], several]
            descent = min((self._descended(law, start, treatment) for start in starts), key=lambda pair: pair[1])
            if descent[1] > _HELPS * best[1]:
                break
            best = descent
        return best

    def _descended(self, law: Callable[[Array], ControlLaw], start: Array, treatment: Treatment) -> tuple[Array, float]:
        """Numbers of a law that leave least, and what they leave, by Gauss-Newton with halved steps."""
        values, least, tried = start, math.inf, start
        step = np.zeros(len(start))
        for _ in range(2 * _ROUNDS):
            rows = self.left([law(tried), *(law(tried + change) for change in _SLOPE * np.eye(len(start)))], treatment)
            square = float(np.square(rows[0]).mean())
            if square < least:
                values, least = tried, square
                step = -np.linalg.lstsq((rows[1:] - rows[0]).T / _SLOPE, rows[0], rcond=None)[0]
            else:
                step = step / 2
            tried = values + step
        return values, least


def _laws(law: ControlLaw, screened: Sequence[Screened], sizes: Array) -> list[ControlLaw]:
    """The law with each of some mistakes, of these sizes."""
    return [item.mistake.changed(law, size) for item, size in zip(screened, sizes.tolist(), strict=True)]
