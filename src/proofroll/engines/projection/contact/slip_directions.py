"""Directions of slips from step to step, and their last step, in which the direction is kept."""

from collections.abc import Sequence

import numpy as np

from proofroll.elements.mechanism.contact.acting import Acting, slip_velocity
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array


class SlipDirections:
    """Unit vector of each slip at the start of a step.

    A slip that stops turns infinitely fast in the stages of a step that pass the stop, and a fixed step would let it
    circle about zero for good. A slip that a fixed step ends, by the rate of the step before, keeps its direction.
    """

    def __init__(self, step: float, least: Array) -> None:
        """Takes the size of a fixed step [s], 0 if it adapts, and speeds of each contact that count as rest [m/s]."""
        self._step, self._still = step, least
        self._toward: list[Array] = []
        self._speeds: list[float] = []
        self._time = 0.0
        self._last_step: list[bool] = []

    def begin(self, mode: Sequence[Acting]) -> None:
        """Starts with the directions of a mode, one for each contact."""
        self._toward = [np.array(contact_mode.heading or (0.0, 0.0, 0.0)) for contact_mode in mode]
        self._speeds, self._last_step = [0.0] * len(mode), [False] * len(mode)

    def look(self, t: float, mode: Sequence[Acting], touching: Sequence[Touching]) -> None:
        """Stores the directions of slips at the time ``t`` [s]."""
        span, self._time = t - self._time, t
        for k, (contact_mode, touch) in enumerate(zip(mode, touching, strict=True)):
            if contact_mode.kind != "slip":
                continue
            speed = float(np.linalg.norm(slip_velocity(touch)))
            self._last_step[k] = False
            self._toward[k] = self.heading(k, touch)
            self._last_step[k] = 0.0 < speed * span <= (self._speeds[k] - speed) * self._step
            self._speeds[k] = speed

    def passed(self, k: int, touch: Touching) -> float:
        """Speed against the direction at the start of the step [m/s]; positive: the slip has ended."""
        return -float(slip_velocity(touch) @ self._toward[k])

    def heading(self, k: int, touch: Touching) -> Array:
        """Direction of a slip; of one that counts as rest, and after its end within a step, the direction before."""
        slip, toward = slip_velocity(touch), self._toward[k]
        speed = float(np.linalg.norm(slip))
        if self._last_step[k] or speed <= self._still[k]:
            return toward
        return np.asarray(slip / speed if slip @ toward >= 0 else -slip / speed)
