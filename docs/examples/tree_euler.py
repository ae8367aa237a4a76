"""A complete engine of mechanisms: the mass matrix of a tree of joints, stepped by semi-implicit Euler."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import numpy as np
from annotated_types import Gt

from proofroll import adapter

JOINTS = frozenset(
    {adapter.MechanismCapability.FIXED, adapter.MechanismCapability.REVOLUTE, adapter.MechanismCapability.PRISMATIC}
)


@dataclass(frozen=True)
class Settings:
    formulation: Literal["tree"] = "tree"
    preset: Literal["default"] = "default"
    dt: Annotated[float, Gt(0)] = 1e-3  # step [s]
    resolution = "dt"
    order = 1  # and, if it computes in float32, precision = "single"; nothing means double


class TreeEuler:
    """Semi-implicit Euler on the equations in joint coordinates."""

    name: ClassVar[str] = "tree_euler"
    provides: ClassVar[Mapping[str, frozenset[str]]] = {"tree": JOINTS}
    settings: ClassVar[type[Settings]] = Settings
    presets: ClassVar[Mapping[str, Mapping[str, Settings]]] = {"tree": {"default": Settings()}}

    @staticmethod
    def version() -> str:
        return "1.0"

    @classmethod
    def build(cls, scene: adapter.Scene, settings: Settings) -> TreeEuler:
        return cls(adapter.mechanism_of(scene), settings.dt)

    def __init__(self, mechanism: adapter.Mechanism, dt: float) -> None:
        self.mechanism, self.tree, self.dt, self.t = mechanism, adapter.Tree(mechanism), dt, 0.0
        self.q, self.v = mechanism.start()

    def acceleration(self) -> adapter.Array:
        motion, n = self.tree.at(self.q, self.v), len(self.v)  # of all bodies, the last one is the world
        M, push = np.zeros((n, n)), np.zeros(n)
        for i, body in enumerate(self.mechanism.bodies):
            R, w, J, bias = motion.R_WB[i], motion.w_WB[i], motion.J[i], motion.bias[i]
            c, inertia = R @ body.com, R @ body.inertia @ R.T
            linear = J[:3] - adapter.skew(c) @ J[3:]
            drift = bias[:3] + np.cross(bias[3:], c) + np.cross(w, np.cross(w, c))
            M += body.mass * linear.T @ linear + J[3:].T @ inertia @ J[3:]
            push += body.mass * linear.T @ (np.array(self.mechanism.gravity) - drift)
            push -= J[3:].T @ (inertia @ bias[3:] + np.cross(w, inertia @ w))
        return np.asarray(np.linalg.solve(M, push))

    def advance(self, t: float) -> None:
        for _ in range(adapter.whole_steps(self.t, t, self.dt)):
            self.v = self.v + self.dt * self.acceleration()
            self.q = self.q + self.dt * self.v
        self.t = t

    def sample(self) -> adapter.MechanismSample:
        motion = self.tree.at(self.q, self.v)
        turned = np.array([adapter.to_quaternion(R) for R in motion.R_WB[:-1]])
        return adapter.MechanismSample(motion.p_WB[:-1], motion.v_WB[:-1], motion.w_WB[:-1], turned)

    def built(self) -> adapter.MechanismBuilt:
        masses = np.array([body.mass for body in self.mechanism.bodies])
        return adapter.MechanismBuilt(mass=masses, gravity=np.array(self.mechanism.gravity), mobility=len(self.v))
