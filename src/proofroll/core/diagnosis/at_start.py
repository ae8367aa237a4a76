"""Hypotheses about vectors at time 0, from the certificate alone."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence
from proofroll.core.diagnosis.lines import differing
from proofroll.core.diagnosis.vectors import Reported

# In this order: a state that is wrong makes all that follows wrong, and not the other way round.
_STATE = (("velocity", "the velocity", "m/s"), ("spin", "the angular velocity", "rad/s"))
_RATES = (
    ("acceleration", "the acceleration", "m/s^2"),
    ("angular acceleration", "the angular acceleration", "rad/s^2"),
)


@dataclass(frozen=True)
class AtStart:
    """Signs, units and axes of velocities and accelerations at time 0.

    Attributes:
        frames: of an element at time 0, in which a vector may be given by mistake; each of shape (vectors, 3, 3).
        follows: quantities that follow from the velocities.
        rates: whether accelerations are looked at, where nothing else differs.
    """

    frames: Callable[[Any], Mapping[str, FloatArray]]
    follows: frozenset[str]
    rates: bool = True
    id: str = "said at time 0"
    grounds: str = "the scene's own vectors with another sign, unit or axes are those of the certificate"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        wrong = {str(line["quantity"]): line for line in differing(evidence.lines)}
        state = {name for name, _, _ in _STATE}
        rates = {name for name, _, _ in _RATES}
        for vectors, others in ((_STATE, state | rates | self.follows), (_RATES if self.rates else (), set())):
            for name, what, unit in vectors:
                if name not in wrong or not set(wrong) <= others | {name}:
                    continue
                said, true = (np.reshape(wrong[name][key], (-1, 3)) for key in ("found", "expected"))
                if said.shape != true.shape:
                    continue
                frames = {key: frame[None] for key, frame in self.frames(evidence.element).items()}
                yield from Reported(name, what, unit, said[None], true[None], np.zeros(1), frames).causes(evidence.step)
