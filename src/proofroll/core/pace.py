"""Pace of a truth: how far it has come, and the processor time that it may take."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from proofroll.core.errors import Diverged

_EVERY = 1.0  # s of processor time between two messages
_TELLING = 0.01  # part of a route from which its pace is told: the first steps are shorter than those to come
AT = "truth at "  # beginning of a line that a worker prints about it
# Route, or check -> part of the limit that is used when it ends; then motions are sampled. Where nothing switches both
# are followed again from a start beside. A closed form is checked about as long as its witness takes.
_ROUTES = {"first": 0.4, "second": 0.8, "laws": 0.9, "early": 0.95, "steps": 1.0, "witness": 0.5}
_SMOOTH = 0.6875
# Processor time of a sample [s] that all but the dearest need; number of samples by which a time is foretold.
_SAMPLE, _FEW = 0.1, 16
_CHECKED = "its end, held against the laws"


class OutOfTime(Diverged):
    """A truth has taken the processor time that it may; what it has found so far is known."""


class Pace:
    """Pace of the truth that this process computes.

    Attributes:
        until: last time of the truth [s].
        text: time that is reached and, after the first steps, time that is still needed, or that routes have ended;
            empty: no truth is made.
        over: True if the last truth was ended by its limit.
        reason: why a truth ends that is ended by its limit.
        aloud: True in a worker, whose lines the process that started it reads.
    """

    def __init__(self) -> None:
        self.text, self.reason, self.over, self.until, self.aloud = "", "", False, 0.0, False
        self._tell: Callable[[str], object] = str
        self._limit, self._began = math.inf, 0.0
        self._route, self._begun, self._end, self._told, self._part = "", (0.0, 0.0), math.inf, 0.0, 1.0

    @contextmanager
    def limited(self, seconds: float, tell: Callable[[str], object] = str) -> Iterator[None]:
        """Context manager of a truth.

        Args:
            seconds: processor time after which it ends where it is.
            tell: called with the text about every second.
        """
        self._limit, self._tell, self.over = seconds, tell, False
        self.reason = f"its limit of {seconds:g} s of processor time was reached"
        self._began = self._told = time.process_time()
        try:
            yield
        finally:
            self._limit = math.inf
            self._route = self.text = ""
            self._tell("")  # what was told before is over

    def follow(self, route: str, end: float, *, smooth: bool = False) -> None:
        """Begins a route, or a check, to an end in its own unit of time.

        ``route``: ``first`` or ``second``, or the only one by ``steps``; the check of ``laws``; the ``witness`` of a
        closed form; the first route with its rebounds cut ``early``. ``smooth``: nothing switches.
        """
        self._route, self._begun, self._end = route, (time.process_time(), -1.0), end
        self._part = _ROUTES[route] * (_SMOOTH if smooth else 1.0)

    def fitting(self, times: Any, sample: Callable[[Any], object]) -> int:
        """Number of the first of some times, at least one, for whose samples the limit leaves processor time.

        ``times``: an array. ``sample``: finds samples at some of them, to see what a few take where all may not fit.
        """
        left = self._began + self._limit - time.process_time()
        if left > _SAMPLE * len(times):
            return len(times)
        few = times[:: -(-len(times) // _FEW)]
        begun = time.process_time()
        sample(few)
        each = (time.process_time() - begun) / len(few)
        count = len(times) if each * len(times) <= max(left, 0.0) else max(1, int(left / each) - len(few))
        self.over = self.over or count < len(times)
        return count

    def leave(self) -> None:
        """Ends a route: what follows has no forecast."""
        self._route, self.text = "", _CHECKED if self.text and self._limit < math.inf else ""
        if self.text:
            self._tell(self.text)

    def reached(self, t: float) -> None:
        """Records the time that a route has reached, in its own unit.

        Raises:
            OutOfTime: the limit is used, and the route has begun.
        """
        if not self._route:
            return
        used, part = time.process_time(), t / self._end
        if t > 0 and used - self._began > self._part * self._limit:
            self.over = True
            raise OutOfTime(self.reason, t)
        if self._begun[1] < 0:  # what came before, like compiling, says nothing of the pace
            self._begun = used, part
        came = part - self._begun[1]
        if came > 0 and used - self._told > _EVERY:
            self._told, whole = used, (used - self._begun[0]) / came
            left = whole * (1 - part) + (whole if self._route == "first" else 0.0)
            forecast = f", about {left:.0f} s left" if came > _TELLING else ""
            self.text = f"{part * self.until:.3g} of {self.until:.3g} s{forecast}"
            self._tell(self.text)


PACE = Pace()
