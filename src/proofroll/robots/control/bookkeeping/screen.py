"""Motion of a robot in the air that was seen, against motions under laws, and a screen of mistakes by intervals.

Each interval of the screen begins at the state that was seen, and has the masses and the forces of inertia of the
motion that was seen. So errors do not add up, the state decides what a policy observes, and hundreds of laws move at
once.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from proofroll.core.diagnosis.fitting import least_squares_parameters
from proofroll.core.errors import Diverged, Refused
from proofroll.core.integrators import classical_step
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import SCHEMES, TREATMENTS, AirRobot, AirScheme, Treatment, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime

SHOWN = 0.1  # s: a mistake of bookkeeping shows in the air within it
WHOLE = 1e-6  # part of a step by which an interval may miss a whole number of steps
_RATES = 0.05  # s: weight of velocities beside places, the time in which a mistake shows
_SMALL = 1e-3  # least size that slopes are scaled by [rad, m, kg m² or 1]
# Distance that is none; the same in parts of the rounding of the motion's numbers.
_NOTHING, _OF_ROUNDING = 1e-9, 30.0
_OPPOSITE = (AirScheme("explicit"), AirScheme("implicit"))  # schemes that differ most
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


@dataclass(frozen=True)
class SeenMotion:
    """Motion of a robot in the air, from time 0 at equal intervals.

    Attributes:
        time: [s].
        q, v: coordinates and velocities of the mechanism, (times, nq) and (times, nv).
        rounding: of its numbers.
    """

    time: Array
    q: Array
    v: Array
    rounding: float = 0.0

    @property
    def bar(self) -> float:
        """Distance from another motion that is none."""
        return max(_NOTHING, _OF_ROUNDING * self.rounding)

    def until(self, end: float) -> SeenMotion:
        """The motion up to a time [s]."""
        count = int(np.searchsorted(self.time, end * (1 + 1e-9), side="right"))
        return replace(self, time=self.time[:count], q=self.q[:count], v=self.v[:count])


@dataclass
class LawMotions:
    """Motions of a robot under laws, by the steps of schemes, against the motion that was seen.

    Attributes:
        mechanism: the robot.
        law: of its controller as it should be.
        seen: the motion.
        step: of the schemes [s].
        robots: equations of the robot, by armature and gravity.
        stride: steps between samples.
        schemes: all that differ for this robot.
    """

    mechanism: Mechanism
    law: ControlLaw
    seen: SeenMotion
    step: float
    robots: dict[tuple[bytes, float], AirRobot] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.stride = round(float(self.seen.time[1] - self.seen.time[0]) / self.step)
        self.turning = np.zeros(self.mechanism.nq, dtype=bool)
        self.quaternions = []
        for joint, place in zip(self.mechanism.joints, self.mechanism.q_slices, strict=True):
            self.turning[place] = joint.kind == JointKind.REVOLUTE
            if joint.kind in WITH_QUATERNION:
                self.quaternions.append(slice(place.stop - 4, place.stop))
        damped = any(joint.damping for joint in self.mechanism.joints)
        floats = bool(self.quaternions)
        self.schemes = [item for item in SCHEMES if floats >= item.along_base and damped >= item.damped]

    def schemes_of(self, treatment: Treatment) -> list[AirScheme]:
        """Schemes that treat gains in one way."""
        return [scheme for scheme in self.schemes if scheme.treatment == treatment]

    def robot(self, law: ControlLaw) -> AirRobot:
        """Robot with the armature and the gravity of a law."""
        key = (law.armature.tobytes(), law.gravity)
        if key not in self.robots:
            self.robots[key] = AirRobot(self.mechanism, law)
        return self.robots[key]

    def apart(self, row: int, q: Array, v: Array) -> Array:
        """Differences between a state and the one seen at a sample."""
        off = q - self.seen.q[row]
        off[self.turning] = (off[self.turning] + math.pi) % (2 * math.pi) - math.pi
        for place in self.quaternions:
            off[place] = 2 * (q[place] * np.sign(q[place] @ self.seen.q[row][place]) - self.seen.q[row][place])
        return np.concatenate([off, _RATES * (v - self.seen.v[row])])

    def differences(self, law: ControlLaw, scheme: AirScheme, bound: float = math.inf) -> list[Array]:
        """Differences at the samples, until one exceeds the bound or the motion blows up."""
        count = len(self.seen.time)
        differences: list[Array] = []
        start = (self.seen.q[0].copy(), self.seen.v[0].copy())
        steps = steps_in_air(self.robot(law), law, start, self.step, scheme)
        try:
            for row, item in enumerate(itertools.islice(steps, 0, self.stride * (count - 1) + 1, self.stride)):
                differences.append(self.apart(row, item.q, item.v))
                if not np.abs(differences[-1]).max() <= bound:
                    break
        except (Diverged, Refused):
            pass
        return differences

    def left(self, law: ControlLaw, scheme: AirScheme, bound: float = math.inf) -> Array:
        """Differences at all samples, one after another; NaN if one exceeds the bound or is lacking."""
        differences = self.differences(law, scheme, bound)
        if len(differences) < len(self.seen.time) or not np.abs(differences[-1]).max() <= bound:
            return np.array(np.nan)
        return np.concatenate(differences)

    def spread(self) -> float:
        """Distance between motions under the law by explicit and by implicit steps; infinite if one blows up."""
        apart = float(np.abs(np.subtract(*(self.left(self.law, scheme) for scheme in _OPPOSITE))).max())
        return apart if math.isfinite(apart) else math.inf

    def imitated(self, scheme: AirScheme) -> bool:
        """True if explicit kd with an armature of h kd more moves as implicit kd does."""
        armed = self.law.change(armature=self.law.armature + self.step * self.law.kd)
        same = scheme.treatment == "implicit" and self.law.kd.any()
        return bool(same and self.distance(armed, scheme._replace(treatment="explicit")) <= self.seen.bar)

    def distance(self, law: ControlLaw, scheme: AirScheme, bound: float = math.inf) -> float:
        """Largest difference at all samples; infinite if it exceeds the bound."""
        largest = float(np.abs(self.left(law, scheme, bound)).max())
        return largest if math.isfinite(largest) else math.inf

    def fit(self, law: Callable[[Array], ControlLaw], start: Array, scheme: AirScheme, rounds: int) -> Array:
        """Numbers of a law with which the samples fit best."""
        scale = np.maximum(np.abs(start), _SMALL)

        def left(parts: Array) -> Array:
            return self.left(law(scale * parts), scheme)

        return np.asarray(scale * least_squares_parameters(left, start / scale, 1.0, rounds))
