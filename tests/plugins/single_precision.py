"""An engine in single or double precision, for trees of hinges or one free body, with two integration schemes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from annotated_types import Gt

from proofroll.core.engine import whole_steps
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.capabilities import MechanismCapability
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample, mechanism_of
from proofroll.elements.mechanism.scene.rotations import to_quaternion


@dataclass(frozen=True)
class SingleSettings:
    """Settings: integration scheme, step and precision."""

    formulation: Literal["euler", "rk4"] = "rk4"
    preset: Literal["matched"] = "matched"
    dt: Annotated[float, Gt(0)] = 1e-3
    precision: Literal["single", "double"] = "single"
    heavier: float = 1.0  # factor on masses and inertias; 1.001 is a wrong model
    resolution: ClassVar[str] = "dt"

    @property
    def order(self) -> int:
        """Order of the scheme."""
        return 1 if self.formulation == "euler" else 4


class Single:
    """Run of a tree of hinges or of a free body.

    A hinge's coordinate is its angle from the start; a free body has its centre and its rotation from the start.
    """

    name: ClassVar[str] = "single"
    provides: ClassVar[Mapping[str, frozenset[str]]] = dict.fromkeys(
        ("euler", "rk4"), frozenset({MechanismCapability.REVOLUTE, MechanismCapability.FREE})
    )
    settings: ClassVar[type[Any]] = SingleSettings
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        name: {"matched": SingleSettings(formulation=name)} for name in ("euler", "rk4")
    }

    @staticmethod
    def version() -> str:
        """Version of the engine."""
        return "1.0"

    @classmethod
    def build(cls, scene: Scene, settings: SingleSettings) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        return cls(scene, settings)

    def __init__(self, scene: Scene, settings: SingleSettings) -> None:
        mechanism, start = mechanism_of(scene), scene.elements[0].start  # type: ignore[attr-defined]  # of mechanisms
        self.single = np.float32 if settings.precision == "single" else np.float64
        self.dt, self.euler, self.t = settings.dt, settings.formulation == "euler", 0.0
        own, bodies, joints = self._own, mechanism.bodies, mechanism.joints
        self.places, self.turns = own(start.p_WB[0]), own(start.R_WB[0, : len(bodies)])
        self.mass = own([settings.heavier * body.mass for body in bodies])
        self.com, self.gravity = own([body.com for body in bodies]), own(mechanism.gravity)
        self.inertia = own([settings.heavier * np.array(body.inertia) for body in bodies])
        self.centres = self.places + np.einsum("bij,bj->bi", self.turns, self.com)
        self.moments = self.turns @ self.inertia @ np.swapaxes(self.turns, 1, 2)
        self.free = joints[0].kind == "free"
        index = mechanism.body_index
        self.tree = [(index[joint.child], -1 if joint.parent == "world" else index[joint.parent]) for joint in joints]
        self.anchors = own([start.point(joint.child, joint.child_position)[0] for joint in joints])
        child_axes = [joint.child_frame[:, 2] for joint in joints]
        self.axes = own([start.R_WB[0, index[j.child]] @ axis for j, axis in zip(joints, child_axes, strict=True)])
        if self.free:  # centre, turn from the start; velocity of the centre and spin in axes of the start
            w = start.w_WB[0, 0]
            v = start.v_WB[0, 0] + np.cross(w, self.centres[0] - self.places[0])
            self.q, self.v = own([*self.centres[0], 1, 0, 0, 0]), own([*v, *w])
        else:
            self.q, self.v = own(np.zeros(len(joints))), own([joint.v0[0] for joint in joints])

    def _own(self, values: Any) -> Any:
        return np.array(values, dtype=self.single)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        h = self.single(self.dt)
        for _ in range(whole_steps(self.t, t, self.dt)):
            if self.euler:
                self.v = self.v + h * self._rate(self.q, self.v)[1]
                self.q = self.q + h * self._rate(self.q, self.v)[0]
            else:
                k = [self._rate(self.q, self.v)]
                for part in (0.5, 0.5, 1.0):
                    c = self.single(part) * h
                    k.append(self._rate(self.q + c * k[-1][0], self.v + c * k[-1][1]))
                weights = self._own([1, 2, 2, 1]) / self.single(6)
                self.q = self.q + h * sum(w * one[0] for w, one in zip(weights, k, strict=True))
                self.v = self.v + h * sum(w * one[1] for w, one in zip(weights, k, strict=True))
            if self.free:
                self.q[3:] /= np.linalg.norm(self.q[3:])
        self.t = t

    def _rate(self, q: Any, v: Any) -> tuple[Any, Any]:
        """Rates of coordinates and of velocities."""
        if self.free:  # the angular velocity is in axes fixed to the body
            w, (s, x) = v[3:], (q[3], q[4:])
            inertia = self.moments[0]
            turning = np.linalg.solve(inertia, -np.cross(w, inertia @ w))
            half = self.single(0.5)
            rate = np.concatenate([[-half * (x @ w)], half * (s * w + np.cross(x, w))])
            return np.concatenate([v[:3], rate]).astype(self.single), np.concatenate([self.gravity, turning])
        n = len(q)
        mass, force = np.zeros((n, n), self.single), np.zeros(n, self.single)
        for body, (_, spin, _, centre_rates, turn_rates, bias, turning) in self._kinematics(q, v).items():
            moment = self._moment(body, q)
            load = self.mass[body] * (bias - self.gravity)
            torque = moment @ turning + np.cross(spin, moment @ spin)
            mass += self.mass[body] * centre_rates.T @ centre_rates + turn_rates.T @ moment @ turn_rates
            force += centre_rates.T @ load + turn_rates.T @ torque
        return v, np.linalg.solve(mass, -force)

    def _moment(self, body: int, q: Any) -> Any:
        turn = self._turned(q)[body][0]
        return turn @ self.moments[body] @ turn.T

    def _turned(self, q: Any) -> dict[int, tuple[Any, Any]]:
        """Displacement of each body from the start: body -> rotation R and shift s, x -> R x + s."""
        found = {-1: (np.eye(3, dtype=self.single), self._own(np.zeros(3)))}
        for (body, parent), anchor, axis, angle in zip(self.tree, self.anchors, self.axes, q, strict=True):
            turn, shift = found[parent]
            x, y, z = axis
            cross = self._own([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            own = np.eye(3, dtype=self.single) + np.sin(angle) * cross
            own = turn @ (own + (self.single(1) - np.cos(angle)) * cross @ cross)
            found[body] = own, turn @ anchor + shift - own @ anchor
        return found

    def _kinematics(self, q: Any, v: Any) -> dict[int, tuple[Any, ...]]:
        """Kinematics by body.

        Centre, angular velocity, velocity of the centre, Jacobians of centre and rotation, and accelerations of both at
        zero joint accelerations.
        """
        n, turned, found = len(q), self._turned(q), {}
        zero, none = self._own(np.zeros(3)), np.zeros((3, n), self.single)
        found[-1] = (zero, zero, zero, none, none, zero, zero)
        for j, ((body, parent), anchor, axis) in enumerate(zip(self.tree, self.anchors, self.axes, strict=True)):
            centre, spin, velocity, by_rates, turns, bias, turning = found[parent]
            turn, shift = turned[parent]
            place, about = turn @ anchor + shift, turn @ axis
            own_turn, own_shift = turned[body]
            own = own_turn @ self.centres[body] + own_shift
            arm, lever = place - centre, own - place
            own_spin = spin + about * v[j]
            own_turning = turning + np.cross(spin, about * v[j])
            own_turns = turns.copy()
            own_turns[:, j] = about
            at = by_rates + np.cross(turns.T, arm).T
            own_rates = at + np.cross(own_turns.T, lever).T
            own_velocity = velocity + np.cross(spin, arm) + np.cross(own_spin, lever)
            at_bias = bias + np.cross(turning, arm) + np.cross(spin, np.cross(spin, arm))
            own_bias = at_bias + np.cross(own_turning, lever) + np.cross(own_spin, np.cross(own_spin, lever))
            found[body] = own, own_spin, own_velocity, own_rates, own_turns, own_bias, own_turning
        del found[-1]
        return found

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`; numbers of its own precision as doubles."""
        if self.free:
            s, x = self.q[3], self.q[4:]
            cross = self._own([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])
            turns = {0: np.eye(3, dtype=self.single) + 2 * s * cross + 2 * cross @ cross}
            state = {0: (self.q[:3], turns[0] @ self.v[3:], self.v[:3])}
        else:
            turns = {body: turn for body, (turn, _) in self._turned(self.q).items() if body >= 0}
            state = {body: found[:3] for body, found in self._kinematics(self.q, self.v).items()}
        rows = []
        for body in range(len(self.mass)):
            centre, spin, velocity = state[body]
            turn = turns[body] @ self.turns[body]
            back = -turn @ self.com[body]
            rows.append((centre + back, velocity + np.cross(spin, back), spin, turn))
        p, v, w, R = (np.array(part, dtype=np.float64) for part in zip(*rows, strict=True))
        return MechanismSample(p, v, w, np.array([to_quaternion(one) for one in R]))

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        mass, com, inertia, gravity, places, axes = (
            x.astype(np.float64) for x in (self.mass, self.com, self.inertia, self.gravity, self.anchors, self.axes)
        )
        if self.free:
            return MechanismBuilt(mass, com, inertia, gravity=gravity)
        rates, turnings = self._rate(self.q, self.v)[1], []
        found, accelerations = self._kinematics(self.q, self.v), []
        for body in range(len(mass)):
            _, spin, _, by_rates, turns, bias, turning = found[body]
            turned, back = turns @ rates + turning, -self.turns[body] @ self.com[body]
            accelerations.append(
                by_rates @ rates + bias + np.cross(turned, back) + np.cross(spin, np.cross(spin, back))
            )
            turnings.append(turned)
        own = (np.array(part, dtype=np.float64) for part in (accelerations, turnings))
        return MechanismBuilt(mass, com, inertia, places, axes, gravity, None, None, None, *own)


class OnePrecision(Single):
    """An engine with one precision for its whole process, that of its first run, as if a library had a switch."""

    name: ClassVar[str] = "one_precision"
    presets: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "euler": {"matched": SingleSettings(formulation="euler", precision="double")},
        "rk4": {"matched": SingleSettings()},
    }
    _switched: ClassVar[list[str]] = []

    @classmethod
    def build(cls, scene: Scene, settings: SingleSettings) -> Self:
        """See :class:`proofroll.core.engine.Engine`."""
        cls._switched.append(settings.precision)
        if settings.precision != cls._switched[0]:
            raise RuntimeError(f"this process computes in {cls._switched[0]} precision")
        return super().build(scene, settings)
