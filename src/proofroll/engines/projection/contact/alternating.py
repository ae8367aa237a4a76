"""Motion of a mechanism whose mode changes: steps, ends of modes within them, events.

Between two changes the equations are smooth. A change is located within a step by shorter steps of the same method, so
it is as accurate as these.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.core.events import Event
from proofroll.core.integrators import Integrator
from proofroll.elements.mechanism.dynamics.switches import Settling
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.engines.projection.smooth.dependent import DependentCoordinates

ModeT = TypeVar("ModeT")
# Number of successive modes of zero length that counts as an endless loop; a single one is possible.
WITHOUT_PROGRESS = 20
_ULPS = 4  # accuracy of located changes, in units of the last digit of the time
_CLOSES = 1e-9  # rate at the start of a step that is no round-off, relative to that at its end


class Excess(NamedTuple):
    """Distance of a state beyond one of the bounds of its mode.

    Attributes:
        which: index of the joint or contact; actuators are numbered after all of them.
        kind: kind of the bound.
        size: the distance; positive: the mode has ended.
        closing: rate of the size, of modes that end only while it grows (an overlap); inf for all others.
    """

    which: int
    kind: str
    size: float
    closing: float = math.inf


def ends_of_efforts(
    actuators: Iterable[Actuator], modes: Sequence[str], efforts: Sequence[float], begin: int
) -> list[Excess]:
    """Excess of the modes of efforts with a limit over their ends; ``begin``: index of the first effort."""
    ends = list[Excess]()
    for k, (actuator, mode, effort) in enumerate(zip(actuators, modes, efforts, strict=True), begin):
        over, under = effort - actuator.bound, -actuator.bound - effort
        if mode == "linear":
            ends += [Excess(k, "least", under), Excess(k, "greatest", over)]
        else:
            ends.append(Excess(k, "linear", -over if mode == "greatest" else -under))
    return ends


class AlternatingMotion(ABC, Generic[ModeT]):
    """Motion by an integrator that restarts with each mode; its states y are x with the time appended.

    Attributes:
        t, x: present time [s] and state.
        mode: of each joint or contact.
        events: so far.
    """

    alternates: ClassVar[str]  # name for messages of what may alternate without end
    mode: ModeT

    def __init__(
        self,
        equations: DependentCoordinates,
        stepper: Integrator,
        accept: Callable[[float, Array], Array],
        breaks: Sequence[float] = (),
    ) -> None:
        """Takes ``accept``, which projects x onto its constraints after a step, and times [s] of jumps of the rates."""
        self._equations, self._stepper, self._accept, self._breaks = equations, stepper, accept, breaks
        self._settles = Settling()
        self._idle, self.events = 0, list[Event]()

    @property
    def t(self) -> float:
        """Present time [s]."""
        return self._stepper.t

    @property
    def x(self) -> Array:
        """Present state."""
        return self._stepper.x[:-1]

    @abstractmethod
    def _excess(self, y: Array) -> list[Excess]:
        """Excess of the present mode over all of its ends."""

    @abstractmethod
    def _next(self, y: Array, which: int, kind: str) -> tuple[Array, ModeT, list[tuple[str, str]]]:
        """State and mode after an end of a mode, and events: kind and name of the joint or contact."""

    @abstractmethod
    def _rates(self, y: Array) -> Array:
        """Time derivative of y in the present mode."""

    def _look(self, y: Array) -> None:
        """Notes a state within the mode; for subclasses."""

    def _at(self, y: Array) -> Array:
        """State x of y; sets the time of drives to that of y."""
        self._equations.applied.now = float(y[-1])
        return y[:-1]

    def _accepted(self, t: float, y: Array) -> Array:
        x = self._at(y)
        accepted = self._accept(t, x)
        return y if accepted is x else np.append(accepted, y[-1])

    def _enter(self, t: float, y: Array, mode: ModeT) -> None:
        """Continues in a mode."""
        self.mode = mode
        self._stepper.begin(t, y, self._rates, self._accepted, np.ones(len(y)))

    def advance(self, t: float) -> None:
        """Moves to time t [s].

        Raises:
            Diverged: modes alternate without end, or the integration fails.
        """
        stepper = self._stepper
        stepper.aim(t)
        while stepper.t < t:
            stepper.step(min([t, *(instant for instant in self._breaks if instant > stepper.t)]), np.inf)
            beyond = [(end, self._beyond(end)) for end in self._excess(stepper.x)]
            ended = [
                (self._crossing(end, instant), end.which, end.kind) for end, instant in beyond if instant is not None
            ]
            if ended:
                self._switch(*min(ended))
                continue
            self._idle = 0
            self._look(stepper.x)
            if stepper.t in self._breaks:
                self._enter(stepper.t, stepper.x, self.mode)

    def _excess_over(self, end: Excess, y: Array) -> Excess:
        """Excess of a state over one end of the mode."""
        return next(item for item in self._excess(y) if item[:2] == end[:2])

    def _beyond(self, end: Excess) -> float | None:
        """Time within the last step at which the mode had passed an end [s]; None: it had not.

        A gap may close and open again within one step: then it is the time of the smallest gap.
        """
        from scipy.optimize import brentq

        def at(t: float) -> Excess:
            return self._excess_over(end, self._stepper.inside(t))

        end_time, begin = self._stepper.t, self._stepper.t_before
        if end.closing > 0:
            return end_time if end.size > 0 else None
        if end.size < end.closing * (end_time - begin) or at(begin).closing <= -_CLOSES * end.closing:
            return None
        lowest = float(brentq(lambda t: at(t).closing, begin, end_time))
        return lowest if at(lowest).size > 0 else None

    def _crossing(self, end: Excess, high: float) -> float:
        """Time just after a mode ended within the last step, before the time ``high`` [s]."""

        def margin(y: Array) -> float:
            return -self._excess_over(end, y).size

        return self._stepper.crossing(margin, high, _ULPS * float(np.spacing(self._stepper.t)))[1]

    def _switch(self, t: float, which: int, kind: str) -> None:
        stepper = self._stepper
        self._idle = self._idle + 1 if t <= stepper.t_before else 0
        if self._idle > WITHOUT_PROGRESS:
            raise Diverged(f"{self.alternates} alternate without end at t = {t:.6g} s")
        y, mode, happened = self._next(stepper.inside(t), which, kind)
        bracket = stepper.bracket(max(stepper.t_before, t - _ULPS * float(np.spacing(t))), t)
        self.events += [Event(event_kind, t, *bracket, name) for event_kind, name in happened]
        self._enter(t, y, mode)
