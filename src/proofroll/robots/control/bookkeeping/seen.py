"""Motion of a robot in the air that was seen, and motions under laws against it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from proofroll.core.diagnosis.fitting import least_squares_parameters
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.joint_kinds import WITH_QUATERNION, JointKind
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.air import SCHEMES, AirRobot, AirScheme, Treatment, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw

SHOWN = 0.1  # s: a mistake of bookkeeping shows in the air within it
WHOLE = 1e-6  # part of a step by which an interval may miss a whole number of steps
_RATES = 0.05  # s: weight of velocities beside places, the time in which a mistake shows
_SMALL = 1e-3  # least size that slopes are scaled by [rad, m, kg m² or 1]
# Distance that is none; the same in parts of the rounding of the motion's numbers.
_NOTHING, _OF_ROUNDING = 1e-9, 30.0
_OPPOSITE = (AirScheme("explicit"), AirScheme("implicit"))  # schemes that differ most


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
