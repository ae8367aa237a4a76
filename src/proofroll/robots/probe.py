"""Probe: a small fixed policy without a task, whose actions depend on every part of an observation.

Open-loop targets cannot show a mistake in an observation; this policy can, in the first tenth of a second.
"""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.scene.policy import Observation

_SEED, _WIDTH = 49, 64
# Scales that bring rates and velocities to the size of angles.
_RATES, _SPINS, _SPEEDS = 0.1, 0.25, 0.5


def make(joints: Sequence[str]) -> Callable[[Observation], FloatArray]:
    """Policy of two hidden layers with fixed random weights; actions are of order 1.

    Its observation: gravity, angular velocity and velocity in the axes of the base, coordinates, rates, last action.
    """
    count, random = len(joints), np.random.default_rng(_SEED)
    sizes = (9 + 3 * count, _WIDTH, _WIDTH, count)
    layers = [
        random.normal(0.0, 1.0 / np.sqrt(columns), (rows, columns)) for columns, rows in itertools.pairwise(sizes)
    ]

    def act(seen: Observation) -> FloatArray:
        speed = seen.R_WB.T @ seen.v_WB_W
        parts = [seen.gravity_B, _SPINS * seen.w_WB_B, _SPEEDS * speed, seen.q, _RATES * seen.v, seen.last]
        signal = np.concatenate(parts)
        for layer in layers[:-1]:
            signal = np.tanh(layer @ signal)
        action: FloatArray = layers[-1] @ signal
        return action

    return act
