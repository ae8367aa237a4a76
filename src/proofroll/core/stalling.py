"""Early end of integrations whose adaptive step has collapsed, or that would take too many steps."""

from proofroll.core.errors import Diverged

# A step is tiny below this part of the largest; it stalls after this many tiny steps in a row. Smooth motions need no
# such steps: a slide of a million times the crank's mass drives it through its dead point in a thousandth of the usual
# time, and is not stalled.
_PART, _STEPS = 1e-7, 20
_MOST = 200_000  # largest number of steps of an integration
_PACE = 2000  # number of steps by which the number of all is predicted


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


class StepCount:
    """Counts the steps of an integration from ``start`` to ``until`` [s]."""

    def __init__(self, start: float, until: float) -> None:
        self._steps, self._before, self._until = 0, start, until

    def took(self, t: float) -> None:
        """Records a step that ended at time t [s].

        Raises:
            Diverged: at the pace of the last steps there will be too many.
        """
        self._steps += 1
        if self._steps % _PACE:
            return
        ahead, self._before = _PACE * (self._until - t) / (t - self._before), t
        if self._steps + ahead > _MOST:
            raise Diverged(
                f"at the pace of its first {self._steps} steps, which reached t = {t:.6g} s, DOP853 needs more than "
                f"{_MOST}: slow down or soften the fastest oscillation, or ask for a shorter time"
            )
