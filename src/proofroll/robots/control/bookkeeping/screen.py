"""Screen of mistakes by what they do in each interval of a motion that was seen.

Each interval begins at the state that was seen, and has the masses and the forces of inertia of the motion that was
seen. So errors do not add up, the state decides what a policy observes, and hundreds of laws move at once.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from proofroll.core.integrators import classical_step
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import TREATMENTS, AirRobot, Treatment
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime

_FACTORS = (0.0, 0.3, 0.6, 0.85, 0.95, 1.0, 1.05, 1.2, 1.6, 2.5)  # sizes that are tried where 1 is right
_AT_ONCE = 500  # laws that move at once: some 100 MB
_SLOPE, _ROUNDS = 1e-3, 3  # part of a size for slopes, and rounds of a fit
_AT_LIMIT, _BEYOND = 0.99, 2.5  # part of the limit of an effort that is clamped; and of the least offset that does so


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
        self._robot = AirRobot.bare(mechanism, law)
        self._states, self._coupled = [*self._between(q, v)], bool(self._robot.equations.rank)
        forces = zip(*(self._robot.forces(*state)[:4] for state in self._states[:-1]), strict=True)
        self._mass, self._inertial, self._weight, self._free = map(np.array, forces)
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
        period = law.period(self.step)
        key = (period, *law.observing)
        if key not in self._actions:
            answer, (last, _), actions = law.answer(), law.waiting(), []
            assert answer is not None  # the caller knows that there is a policy
            for k in range(0, len(self._states), period):
                seen = self._states[max(k - law.observed_lag, 0)]
                last = answer(law.observed(self._robot.state(law.begins + k * self.step, *seen), last))
                actions.append(last)
            self._actions[key] = actions
        return self._actions[key]

    def _targets(self, law: ControlLaw) -> Array:
        """Targets of a law in all steps, (steps, n)."""
        period = law.period(self.step)
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

            def rates(x: Array) -> Array:
                q, v = x[..., : self._at_v.size], x[..., self._at_v.size :][..., self._at_v]
                return np.concatenate([v, accelerated(efforts((q, v)))], axis=-1)

            if treatment == "rk4":
                q, v = np.split(classical_step(rates, np.concatenate([q, v], axis=-1), h), [self._at_v.size], axis=-1)
            else:
                v = v + h * accelerated(efforts((np.where(lag, late[0], state[0]), np.where(lag, late[1], state[1]))))
                q = q + h * v[..., self._at_v]
            late = state
        unexplained = np.einsum("kji,hkj->hki", self._roots, v - self._seen)
        return np.asarray(unexplained.reshape(len(laws), -1))

    def _instants(self, laws: Sequence[ControlLaw], rows: slice) -> tuple[Array, Array]:
        """Coordinates and rates of the driven joints at the instant before each step, of each law."""
        steps = np.arange(len(self._states) - 1)[rows]
        periods = np.array([law.period(self.step) for law in laws])
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

    def best(self, candidates: Sequence[Mistake], time: SearchTime) -> list[Screened]:
        """Mistakes with their sizes in the treatments of gains that there is time for, those that leave least first."""
        further = {item.words: _FACTORS if item.none == 1 else () for item in candidates}
        sizes = {item.words: item.starts + further[item.words] if item.sized else (1.0,) for item in candidates}
        trials = [(item, size) for item in candidates for size in sizes[item.words]]
        laws = [item.changed(self.law, size) for item, size in trials]
        screened: list[Screened] = []
        for treatment in itertools.takewhile(lambda _: not time.over, TREATMENTS):
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
            changes = _SLOPE * np.maximum(np.abs(sizes), _SLOPE)
            left, moved = (self.left(_laws(self.law, sized, tried), treatment) for tried in (sizes, sizes + changes))
            slopes = (moved - left) / changes[:, None]
            squares = np.square(slopes).sum(axis=1)
            steps = -np.divide((slopes * left).sum(axis=1), squares, out=np.zeros_like(squares), where=squares > 0)
            better = np.maximum([item.mistake.least for item in sized], sizes + steps)
            unexplained = np.square(self.left(_laws(self.law, sized, better), treatment)).mean(axis=1).tolist()
            sized = [
                replace(item, size=size, left=square) if square < item.left else item
                for item, size, square in zip(sized, better.tolist(), unexplained, strict=True)
            ]
        return fixed + sized

    def offsets(self, treatment: Treatment) -> Array:
        """Constant offset of each joint's target with which the efforts that moved it are the law's, (n).

        Where an effort is at its limit throughout, one that keeps it there, as any larger one does.
        """
        law, every = self.law, slice(None, None, self.stride)
        rates = np.diff(self._v[every], axis=0) / (self.stride * self.step)
        forces = np.einsum("kij,kj->ki", self._mass[every], rates) - self._inertial[every] - self._weight[every]
        forces[:, self._at_v] += law.armature * rates[:, self._at_v]
        turned = np.swapaxes(self._free[every], -1, -2)
        efforts = (np.linalg.pinv(turned[..., self._at_v]) @ (turned @ forces[..., None]))[..., 0]
        v = self._v[every][int(treatment == "implicit") :][: len(rates), self._at_v]
        stiff = np.where(law.kp > 0, law.kp, np.inf)
        offsets = self._q[every][:-1] + (efforts + law.kd * v) / stiff - self._targets(law)[every]
        free = np.abs(efforts) < _AT_LIMIT * law.limit
        columns = zip(offsets.T, free.T, strict=True)
        return np.array(
            [np.median(off[mask]) if mask.any() else _BEYOND * off[np.abs(off).argmax()] for off, mask in columns]
        )


def _laws(law: ControlLaw, screened: Sequence[Screened], sizes: Array) -> list[ControlLaw]:
    """The law with each of some mistakes, of these sizes."""
    return [item.mistake.changed(law, size) for item, size in zip(screened, sizes.tolist(), strict=True)]
