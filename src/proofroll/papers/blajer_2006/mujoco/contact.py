"""Contact reactions as MuJoCo computed them, and the rolling resistance that MuJoCo cannot express."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from proofroll.core.arrays import FloatArray

# Numbers of user data that foreseen_normal_force keeps.
MEMORY = 4


def contact_force(model: Any, data: Any, geom: int) -> FloatArray:
    """Sum of the contact forces on a geom in the world [N], shape (3,); zero without contact."""
    total = np.zeros(3)
    wrench = np.zeros(6)
    for index in range(data.ncon):
        contact = data.contact[index]  # a slice of the list would copy all of MuJoCo's contacts
        mujoco.mj_contactForce(model, data, index, wrench)
        # The frame's first axis points from geom[0] to geom[1], and the force is the one on geom[1].
        sign = 1.0 if contact.geom[1] == geom else -1.0
        total += sign * contact.frame.reshape(3, 3).T @ wrench[:3]
    return total


def foreseen_normal_force(data: Any, N: float) -> float:
    """Normal force at ``data.time`` [N], extrapolated from those that MuJoCo found in the two evaluations before.

    The torque of the rolling resistance is needed before MuJoCo solves for the forces of the same instant; holding
    the last value would be an error of first order. The memory lies in ``data.userdata``, so that it is copied with
    the state: time of the evaluation before, time and force of the one before that, slope. ``N`` [N] is the normal
    force of the evaluation before.
    """
    t = float(data.time)
    memory = data.userdata
    last, time_before, N_before, slope = memory[:MEMORY].tolist()
    if last > time_before:
        slope = (N - N_before) / (last - time_before)
    memory[0], memory[1], memory[2], memory[3] = t, last, N, slope  # faster than a slice
    return max(float(N + slope * (t - last)), 0.0)


def contact_coefficient(model: Any, data: Any, geoms: tuple[int, int]) -> float:
    """Coefficient of friction [1] that MuJoCo combined for the first contact; without contact, would combine."""
    if data.ncon:
        contact = data.contact[0]
        return float(contact.friction[0]) if contact.dim > 1 else 0.0
    sliding = max(model.geom_condim[index] for index in geoms) > 1
    return float(max(model.geom_friction[index, 0] for index in geoms)) if sliding else 0.0


@dataclass(frozen=True)
class Resistance:
    """The torque of rolling resistance.

    Attributes:
        f: distance by which the normal force is shifted forward [m].
    """

    f: float

    def apply(self, torque: Any, N: float, e1: Sequence[float], v: Sequence[float]) -> None:
        """Writes the moment -f N (v/V) × e1 [N m] into ``torque``, with the normal force N [N] of MuJoCo's own contact.

        ``e1`` points from the ball to the wall, ``v`` [m/s] is the velocity of the centre in the world. MuJoCo's own
        rolling friction (condim 6) does not model it: there sliding and rolling share one cone. Scalars, because this
        runs at each step and numpy's overhead on three numbers would outweigh MuJoCo's work.
        """
        v0, v1, v2 = v
        e0, e1_, e2 = e1
        speed = math.hypot(v0, v1, v2)
        scale = -self.f * N / speed if speed else 0.0
        torque[0] = scale * (v1 * e2 - v2 * e1_)
        torque[1] = scale * (v2 * e0 - v0 * e2)
        torque[2] = scale * (v0 * e1_ - v1 * e0)

    def lever(self) -> float:
        """Lever arm of the resistance torque at N = 1 N [m]."""
        torque = np.zeros(3)
        self.apply(torque, 1.0, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        return float(np.linalg.norm(torque))
