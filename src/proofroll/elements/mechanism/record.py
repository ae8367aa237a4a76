"""What a route of the truth records of a mechanism, in an order that both routes keep."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from proofroll.elements.mechanism.rotations import Array


@dataclass(frozen=True)
class Record:
    """A motion at sampled times, SI units, world axes; bodies, joints and loops in the order of the mechanism.

    Attributes:
        time: s, (times).
        p_WB, v_WB: origin of each body's frame and its velocity, (times, bodies, 3).
        q_WB: unit quaternion wxyz of each body, (times, bodies, 4).
        w_WB: angular velocity, rad/s, (times, bodies, 3).
        q, v: coordinates (times, nq) and velocities (times, nv) of the tree.
        wrench: force and moment on the child (joints) or on body_b (loops), at the joint, of all that the joint
            transmits: constraint, spring, damper and drive; N, N m, (times, joints + loops, 6).
        residual: largest violation of a constraint, m or 1, and of its rate, (times, 2).
    """

    time: Array
    p_WB: Array
    v_WB: Array
    q_WB: Array
    w_WB: Array
    q: Array
    v: Array
    wrench: Array
    residual: Array


def gathered(time: Array, samples: list[dict[str, Any]]) -> Record:
    """The record of samples that hold its other fields at each time."""
    names = [item.name for item in fields(Record) if item.name != "time"]
    return Record(time=time, **{name: np.array([sample[name] for sample in samples]) for name in names})
