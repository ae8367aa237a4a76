"""Stall of an error control: many steps in a row, each tiny against the largest."""

from proofroll.core.errors import Diverged

# No smooth motion needs such steps. A slide of a million times the crank's mass drives the crank through its dead point
# in a thousandth of the usual time, and is smooth.
_PART, _STEPS = 1e-7, 20


class Stalled(Diverged):
    """The steps of an error control stall, as at a singular pose."""


class StepWatch:
    """Looks at the steps of one run, one after the other."""

    def __init__(self) -> None:
        self._largest, self._small = 0.0, 0

    def took(self, t: float, length: float, landing: bool) -> None:
        """After a step to time ``t`` [s] of this length [s]; ``landing``: a sample ended it, not the error control.

        Raises:
            Stalled: with the time.
        """
        self._largest = max(self._largest, length)
        self._small = 0 if landing or length > _PART * self._largest else self._small + 1
        if self._small > _STEPS:
            raise Stalled(f"DOP853 stalls at t = {t:.6g} s: its steps shrink, as at a singular pose")
