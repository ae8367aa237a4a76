"""Route 1 for mechanisms with dry friction, stops or effort limits: joint coordinates, modes by complementarity."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.joint_coordinates import JointCoordinates
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import HOLDING, STOPPED, Mode, held_joints
from proofroll.truth.hybrid import Stretch, StretchLaw, Transition
from proofroll.truth.mechanism.joint_stretches import JointStretches, guard_values, near_stops, noise_of, reversed_mode


class SwitchedTree(JointStretches):
    """Stretches of a mechanism in the coordinates of its tree; the last component of a state is the time.

    Implements :class:`proofroll.truth.hybrid.HybridRoute`.
    """

    def __init__(self, equations: JointCoordinates, tolerance: float) -> None:
        self.equations, self.joints = equations, equations.switched
        self.limited = tuple(actuator for actuator, *_ in equations.limited)
        self._nq = equations.mechanism.nq
        super().__init__(self._nq + equations.mechanism.nv + 1, tolerance)

    @property
    def start(self) -> Array:
        """State at time 0."""
        return np.append(np.concatenate(self.equations.mechanism.start()), 0.0)

    def begin(self) -> Transition[Mode]:
        """See the protocol."""
        state = self.start
        mode, margin = self.equations.decided(*self._parts(state), 0.0)
        return Transition(state, mode, (), margin)

    def _law(self, state: Array, mode: Mode) -> StretchLaw:
        q, v = self._parts(state)
        corrected = self.equations.followed(mode)
        return StretchLaw(
            rates=lambda y: np.append(self.equations.rate(float(y[-1]), y[:-1], mode), 1.0),
            guards=lambda y: self._guards(y, mode),
            corrected=lambda y: np.append(corrected(y[:-1]), y[-1]),
            noise=noise_of(self.joints, self.limited, mode, *self._along(state), self._wanted(float(state[-1]), q, v)),
            near=near_stops(self.joints, mode),
        )

    def _at_rest(self, stretch: Stretch[Mode], state: Array, stopped: Sequence[int]) -> tuple[Array, Mode, float]:
        q, v = self._parts(state)
        v[[self.joints[k].velocity for k in stopped]] = 0.0
        return state, *self.equations.decided(q, v, stretch.end)

    def _hit(self, stretch: Stretch[Mode], state: Array, which: int, stop: float) -> tuple[Array, Mode, float, float]:
        joint, (q, v) = self.joints[which], self._parts(state)
        # Held joints are at rest; this removes round-off.
        for other, own in zip(self.joints, stretch.mode, strict=False):
            if own in HOLDING:
                v[other.velocity] = 0.0
            if own in STOPPED:
                q[other.coordinate] = other.low if own == "low" else other.high
        q[joint.coordinate] = stop
        speed = abs(float(v[joint.velocity]))
        v[:], margin = self.equations.struck(q, v, which)
        delay, rebound = 0.0, abs(float(v[joint.velocity]))
        if self._settles(which, speed, joint.restitution):
            pull, falling = (
                abs(float(self.equations.solve(q, v, mode, time=stretch.end).acceleration[joint.velocity]))
                for mode in (reversed_mode(stretch.mode, which), stretch.mode)
            )
            v[joint.velocity] = 0.0
            delay = self._bouncing(joint.name, rebound, pull, joint.restitution, falling)
        decided, after = self.equations.decided(q, v, stretch.end)
        return state, decided, min(margin, after), delay

    def bodies(self, state: Array) -> tuple[Array, Array, Array, Array]:
        """Places, velocities, quaternions and angular velocities of all bodies, world axes."""
        motion = self.equations.tree.at(*self._parts(state))
        turned = Rotation.from_matrix(motion.R_WB[:-1]).as_quat(scalar_first=True)
        return motion.p_WB[:-1], motion.v_WB[:-1], turned, motion.w_WB[:-1]

    def holding(self, state: Array, mode: Mode) -> Array:
        """Force of dry friction or of a stop along each switched joint's coordinate, N or N m."""
        holding = self.equations.solve(*self._parts(state), mode, time=float(state[-1])).holding
        force = np.array([joint.push(own) for joint, own in zip(self.joints, mode, strict=False)])
        force[held_joints(mode)] = holding
        return force

    def _parts(self, state: Array) -> tuple[Array, Array]:
        return state[: self._nq], state[self._nq : -1]

    def _wanted(self, time: float, q: Array, v: Array) -> list[float]:
        return [float(item.wanted(time, q[at_q], v[at_v])) for item, at_q, at_v in self.equations.limited]

    def _guards(self, state: Array, mode: Mode) -> FloatArray:
        q, v = self._parts(state)
        holds = any(own in HOLDING for own in mode)
        force = self.holding(state, mode) if holds else np.zeros(len(self.joints))
        return guard_values(
            self.joints, self.limited, mode, *self._along(state), force, self._wanted(float(state[-1]), q, v)
        )

    def _along(self, state: Array) -> tuple[Array, Array]:
        q, v = self._parts(state)
        return q[[joint.coordinate for joint in self.joints]], v[[joint.velocity for joint in self.joints]]
