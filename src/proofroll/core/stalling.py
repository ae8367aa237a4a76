"""Detects that an adaptive step has collapsed: many steps in a row, each tiny against the largest."""

from proofroll.core.errors import Diverged

# A step is tiny below this part of the largest; it stalls after this many tiny steps in a row. Smooth motions need no
# such steps: a slide of a million times the crank's mass drives it through its dead point in a thousandth of the usual
# time, and is not stalled.
_PART, _STEPS = 1e-7, 20


class Stalled(Diverged):
    """An adaptive step has collapsed, as at a singular pose."""


class StepWatch:
    """Watches the step sizes of one run."""

    def __init__(self) -> None:
        self._largest, self._small = 0.0, 0

    def took(self, t: float, length: float, landing: bool) -> None:
        """Records a step.

        Args:
            t: its end [s].
            length: its length [s].
            landing: True if it was shortened to end at a sample.

        Raises:
            Stalled: too many tiny steps in a row; the text has the time.
        """
        self._largest = max(self._largest, length)
        self._small = 0 if landing or length > _PART * self._largest else self._small + 1
        if self._small > _STEPS:
            raise Stalled(f"DOP853 stalls at t = {t:.6g} s: its steps shrink, as at a singular pose")
