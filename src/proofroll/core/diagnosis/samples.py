"""Hypotheses that a right motion is told wrongly, of any element with poses and twists.

Its variables are ``p_WB``, ``v_WB``, ``w_WB`` and perhaps ``q_WB``; what else is said of it, its kind tests itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, Evidence, above_round_off, apart, hypothesis
from proofroll.core.diagnosis.clocks import late, said_delay, stretched
from proofroll.core.diagnosis.lines import single_precision
from proofroll.core.diagnosis.quaternions import quaternions, rounded
from proofroll.core.diagnosis.vectors import Reported

if TYPE_CHECKING:
    import xarray as xr

TWIST = ("p_WB", "v_WB", "w_WB")
# Fewer samples tell no frame and no time.
_FEWEST = 3


def both(evidence: Evidence) -> tuple[xr.Dataset, xr.Dataset] | None:
    """Run and truth, if they are of the same times and of some."""
    run, truth = evidence.run, evidence.truth
    if run is None or truth is None or run.sizes["time"] != truth.sizes["time"] or run.sizes["time"] < _FEWEST:
        return None
    return run, truth


@hypothesis("float32", "every number of the run, or each built one that differs, is exactly a float32")
def single_precision_run(evidence: Evidence) -> Iterator[Cause]:
    """Numbers of 24 bits."""
    yield from single_precision(evidence.lines)
    if evidence.run is not None and evidence.truth is not None:
        yield from rounded(evidence.run, evidence.truth, TWIST)


@dataclass(frozen=True)
class AnotherClock:
    """All that is said belongs to another time than it is said to.

    Attributes:
        state: of an element and a run: all that is said of the motion [m], shape (time, …).
        covers: what it explains.
    """

    state: Callable[[Any, xr.Dataset], FloatArray]
    covers: tuple[str, ...]
    id: str = "late"
    grounds: str = "the whole state is the true one, at times that are shifted by one time or stretched by one factor"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        found = both(evidence)
        if found is None:
            return
        said, true = (self.state(evidence.element, data) for data in found)
        if said.shape != true.shape or not above_round_off(apart(said, true), float(np.max(np.abs(true)))):
            return
        time = found[1]["time"].to_numpy()
        moved = late(time, said, true)
        if moved is not None:
            delay, before, after = moved
            says = f"every sample is {said_delay(delay, evidence.step)}: the motion is right at another time"
            remedy = "advance(t) has to end at t, neither a step before nor after it"
            yield Cause("late", says, "state", "m", before, after, remedy, 1, self.covers)
        paced = stretched(time, said, true)
        if paced is not None:
            rate, before, after = paced
            says = f"the engine's time runs {rate:.6g} times as fast as it says: the motion is right at other times"
            remedy = "the step that the engine takes is not the one that is counted"
            yield Cause("clock", says, "state", "m", before, after, remedy, 1, self.covers)

    def proven(self, evidence: Evidence) -> bool:
        """Whether the clock explains the run, so that no single variable is to blame."""
        return any(cause.proven for cause in self.test(evidence))


@dataclass(frozen=True)
class ReportedVectors:
    """Positions, velocities and angular velocities, one by one.

    Attributes:
        units: variable -> what it is in words, and its unit.
        frames: in which they may be given by mistake, at each time of the true run.
        clock: which explains all of them, if it does.
        least: size below which a variable of an element stands still.
        besides: what else one of them may be.
    """

    units: Mapping[str, tuple[str, str]]
    frames: Callable[[Evidence], Mapping[str, FloatArray]]
    clock: AnotherClock
    least: Callable[[Any, str], float] = lambda *_: 0.0
    besides: Callable[[Reported, Evidence], Iterable[Cause]] = lambda *_: ()
    id: str = "said"
    grounds: str = (
        "the true vectors with another sign, unit, order of axes, frame, limit or time are what the engine says, "
        "sample by sample; no equation is needed"
    )

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        found = both(evidence)
        if found is None or self.clock.proven(evidence):
            return
        run, truth = found
        time, frames = truth["time"].to_numpy(), self.frames(evidence)
        for name, (what, unit) in self.units.items():
            said, true, least = run[name].to_numpy(), truth[name].to_numpy(), self.least(evidence.element, name)
            told = Reported.after_start(name, what, unit, said, true, time, frames, least)
            yield from told.causes(evidence.step)
            yield from self.besides(told, evidence)


@dataclass(frozen=True)
class Attitudes:
    """Quaternions are in another order, of inverse rotations, or not of unit length.

    Attributes:
        true: the true ones, scalar first, shape (time, …, 4).
    """

    true: Callable[[Evidence], FloatArray]
    id: str = "quaternion"
    grounds: str = "the true quaternions in another order or inverted are what is said, up to their sign"

    def test(self, evidence: Evidence) -> Iterator[Cause]:
        """See :class:`proofroll.core.diagnosis.Hypothesis`."""
        found = both(evidence)
        if found is not None and "q_WB" in found[0]:
            yield from quaternions(found[0]["q_WB"].to_numpy(), self.true(evidence))
