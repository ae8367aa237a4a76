"""Record of a mechanism's motion, the same for both routes of the truth."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.rotations import Array


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
        named: see :func:`~proofroll.elements.mechanism.dynamics.named_forces.named_forces`, (times, forces).
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
    named: Array
    residual: Array

    def placed(self, mechanism: Mechanism) -> Placed:
        """The recorded motion of the mechanism."""
        known_q = self.q if self.q.shape[1] else None  # a route that integrates poses has no coordinates at first
        return Placed(
            mechanism=mechanism,
            time=self.time,
            p_WB=self.p_WB,
            v_WB=self.v_WB,
            w_WB=self.w_WB,
            q_WB=self.q_WB,
            known_q=known_q,
        )

    def first(self, count: int) -> "Record":
        """The record of its first times alone."""
        return Record(**{item.name: getattr(self, item.name)[:count] for item in fields(self)})


def record_of(time: Array, samples: list[dict[str, Any]]) -> Record:
    """Record of samples; each is a dictionary of the record's other fields at one time."""
    names = [item.name for item in fields(Record) if item.name != "time"]
    return Record(time=time, **{name: np.array([sample[name] for sample in samples]) for name in names})
