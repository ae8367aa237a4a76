"""Last instants of a slip in the plane, below FAINT, for both routes: by the logarithm of its speed, then a line.

The slower a slip, the faster it turns: its equations are stiff in time, and smooth in that logarithm. A slip that slows
gently has turned long before, and its equations are stiff in that logarithm, too: it is a line at once.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from typing_extensions import override

from proofroll.elements.mechanism.contact.modes import ROUND_OFF, ContactMode
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.truth.numerics.hybrid import Stretch
from proofroll.truth.numerics.picard import PicardSteps, StatesInside

_DECAY = 2.0  # decrease of the logarithm in a step; from round-off on the slip is a line

# Slip speeds at states (state, places), and changes of the states until the slip would stop at its present rate.
Decay = Callable[[Array], tuple[Array, Array]]
# Changes of a state until a slip stops without a turn, at its first rates and in fact; None: it turns.
LineOf = Callable[[Array], tuple[Array, Array] | None]


class _Step(NamedTuple):
    """A step: its first and last place, the time of its last state [s], and the states within."""

    start: float
    end: float
    time: float
    inside: StatesInside


@dataclass(frozen=True)
class StoppingSlip(Stretch[ContactMode]):
    """Last instants of a slip.

    Attributes:
        steps: in the logarithm of the speed.
        line: state at the start of the line.
        begun: change along the line at the rates of its start.
    """

    steps: Sequence[_Step] = ()
    line: Any = None
    begun: Any = None

    @property
    @override
    def middle(self) -> float:
        return (float(self.line[-1]) + self.end) / 2

    def at(self, times: Array) -> Array:
        """States at times [s] within it, shape (times, state)."""
        return np.array([self._at(time) for time in times.tolist()])

    def _at(self, time: float) -> Array:
        from scipy.optimize import brentq

        step = next((step for step in self.steps if time < step.time), None)
        if step is None:
            span = self.end - float(self.line[-1])
            share = min(1.0, (time - float(self.line[-1])) / span) if span else 1.0
            return np.asarray(self.line + share * self.begun + share**2 * (self.last - self.line - self.begun))

        def late(place: float) -> float:
            return float(step.inside(np.array([place]))[-1, 0]) - time

        begins = late(step.start) >= 0
        place = step.start if begins else brentq(late, step.start, step.end, xtol=1e-15)
        return np.asarray(step.inside(np.array([place]))[:, 0])


def stopping_slip(
    time: float, state: Array, mode: ContactMode, guard: int, decay: Decay, line_of: LineOf
) -> StoppingSlip:
    """Last instants of a slip from a time [s] and state on; ``guard``: that it stops."""
    start, steps, integrator, place = state, list[_Step](), PicardSteps(lambda states: decay(states)[1]), 0.0
    last = float(np.log(np.maximum(decay(state[:, None])[0], ROUND_OFF) / ROUND_OFF)[0])
    while (line := line_of(state)) is None and place < last:
        end, state, inside = integrator.step(place, state, min(last, place + _DECAY))
        steps.append(_Step(place, end, float(state[-1]), inside))
        place = end
    if line is None:
        change = np.asarray(decay(state[:, None])[1][:, 0])
        line = change, change
    begun, change = line
    ended = state + change
    return StoppingSlip(
        start=time,
        end=float(ended[-1]),
        mode=mode,
        first=start,
        last=ended,
        guard=guard,
        steps=steps,
        line=state,
        begun=begun,
    )
