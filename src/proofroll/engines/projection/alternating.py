"""Motion of a mechanism in one mode after another: steps, ends of modes within them, events.

Between two switches the equations are smooth; a switch is located within a step by shorter steps of the same method, so
that it is as accurate as these.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from typing import ClassVar, Generic, NamedTuple, TypeVar

import numpy as np

from proofroll.core.errors import Diverged
from proofroll.core.events import Event
from proofroll.core.integrators import Integrator
from proofroll.elements.mechanism.drives import Actuator
from proofroll.elements.mechanism.rotations import Array
from proofroll.elements.mechanism.switches import Settling
from proofroll.engines.projection.dependent import DependentCoordinates

ModeT = TypeVar("ModeT")
# A mode that ends where it started is possible; as many in a row as this are an endless loop.
WITHOUT_PROGRESS = 20
_ULPS = 4  # of the time, to which switches are located


class Excess(NamedTuple):
    """Excess of a mode over one of its ends.

    Attributes:
        which: number of the joint or contact.
        kind: of the end.
        size: positive where the mode has ended.
        closing: whether it moves towards that end.
    """

    which: int
    kind: str
    size: float
    closing: bool


def ends_of_efforts(
    motors: Iterable[Actuator], modes: Sequence[str], wanted: Sequence[float], first: int
) -> list[Excess]:
    """Excess of the modes of efforts with a limit over their ends; these are numbered from ``first`` on."""
    ends = list[Excess]()
    for k, (motor, mode, effort) in enumerate(zip(motors, modes, wanted, strict=True), first):
        over, under = effort - motor.bound, -motor.bound - effort
        if mode == "linear":
            ends += [Excess(k, "least", under, True), Excess(k, "greatest", over, True)]
        else:
            ends.append(Excess(k, "linear", -over if mode == "greatest" else -under, True))
    return ends


class AlternatingMotion(ABC, Generic[ModeT]):
    """Motion by an integrator, which begins anew with each mode; its states y are x and the time.

    Attributes:
        t, x: present time [s] and state.
        mode: of each joint or contact.
        events: so far.
    """

    alternates: ClassVar[str]  # what does so without end, in words
    mode: ModeT

    def __init__(
        self,
        equations: DependentCoordinates,
        stepper: Integrator,
        accept: Callable[[float, Array], Array],
        breaks: Sequence[float] = (),
    ) -> None:
        """Takes what puts x back on its constraints after a step, and times at which rates jump [s]."""
        self._equations, self._stepper, self._accept, self._breaks = equations, stepper, accept, breaks
        self._settles = Settling()
        self._idle, self.events = 0, list[Event]()

    @property
    def t(self) -> float:
        """Present time [s]."""
        return self._stepper.t

    @property
    def x(self) -> Array:
        """State now."""
        return self._stepper.x[:-1]

    @abstractmethod
    def _excess(self, y: Array) -> list[Excess]:
        """Excess of the present mode over all of its ends."""

    @abstractmethod
    def _next(self, y: Array, which: int, kind: str) -> tuple[Array, ModeT, list[tuple[str, str]]]:
        """State, mode and happenings, each with the name of what it happens to, where a mode has ended."""

    @abstractmethod
    def _rates(self, y: Array) -> Array:
        """Rates of x in the present mode."""

    def _look(self, y: Array) -> None:
        """Sees a state that lies within the mode."""

    def _at(self, y: Array) -> Array:
        """X of a state, to whose time drives are set."""
        self._equations.applied.now = float(y[-1])
        return y[:-1]

    def _accepted(self, t: float, y: Array) -> Array:
        x = self._at(y)
        accepted = self._accept(t, x)
        return y if accepted is x else np.append(accepted, y[-1])

    def _enter(self, t: float, y: Array, mode: ModeT) -> None:
        """Goes on in a mode."""
        self.mode = mode
        self._stepper.begin(t, y, lambda y: np.append(self._rates(y), 1.0), self._accepted, np.ones(len(y)))

    def advance(self, t: float) -> None:
        """Moves to time t [s]; raises Diverged where modes alternate without end, or the integration gives up."""
        stepper = self._stepper
        stepper.aim(t)
        while stepper.t < t:
            stepper.step(min([t, *(at for at in self._breaks if at > stepper.t)]), np.inf)
            ended = [one for one in self._excess(stepper.x) if one.size > 0 and one.closing]
            if ended:
                self._switch(*min((self._crossing(one), one.which, one.kind) for one in ended))
                continue
            self._idle = 0
            self._look(stepper.x)
            if stepper.t in self._breaks:
                self._enter(stepper.t, stepper.x, self.mode)

    def _crossing(self, end: Excess) -> float:
        """Time just after a mode ended within the last step [s]."""

        def margin(y: Array) -> float:
            return -next(one.size for one in self._excess(y) if one[:2] == end[:2])

        now = self._stepper.t
        return self._stepper.crossing(margin, now, _ULPS * float(np.spacing(now)))[1]

    def _switch(self, t: float, which: int, kind: str) -> None:
        stepper = self._stepper
        self._idle = self._idle + 1 if t <= stepper.t_before else 0
        if self._idle > WITHOUT_PROGRESS:
            raise Diverged(f"{self.alternates} alternate without end at t = {t:.6g} s")
        y, mode, happened = self._next(stepper.inside(t), which, kind)
        bracket = stepper.bracket(max(stepper.t_before, t - _ULPS * float(np.spacing(t))), t)
        self.events += [Event(each, t, *bracket, name) for each, name in happened]
        self._enter(t, y, mode)
