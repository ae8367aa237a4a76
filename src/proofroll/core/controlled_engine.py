"""Engine under a controller: the harness advances it to each instant, reads it, asks for targets, and sets them.

No adapter calls a policy, and no signal changes within a step. A target belongs to the steps that begin at its instant.
"""

import time
from typing import Any

from proofroll.core.element import Element
from proofroll.core.element_abilities import HeldValues, HoldsTargets
from proofroll.core.engine import whole_steps
from proofroll.core.engine_abilities import TakesTargets
from proofroll.core.errors import InputError, Refused

# Distance between an instant and a time that was asked for, relative to the time, that round-off explains.
_SAME = 1e-9


class CommandedEngine:
    """Engine with a controller; everything but ``advance`` is the engine's own.

    Attributes:
        engine: the engine that it advances.
        asking: wall and processor time for reading states and asking the controller [s], which are not the engine's.
    """

    def __init__(self, engine: Any, commands: HeldValues, step: float | None) -> None:
        """Sets the targets of time 0. ``step``: fixed step of the engine [s]; None: it adapts."""
        self.engine, self._commands, self._step = engine, commands, step
        self._t, self._next, self.asking = 0.0, 0.0, (0.0, 0.0)
        self._set(0.0)

    def _set(self, t: float) -> None:
        wall, processor = time.perf_counter(), time.process_time()
        values = self._commands.values(t, self.engine.sample())
        self.asking = (self.asking[0] + time.perf_counter() - wall, self.asking[1] + time.process_time() - processor)
        self.engine.drive(values)
        self._next = self._commands.next_instant(t)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`; stops at every instant on the way.

        Raises:
            InputError: the step does not divide the time between two instants.
        """
        while self._next <= t * (1 + _SAME):
            stop = t if abs(self._next - t) <= _SAME * t else self._next
            self._require_steps(stop)
            self.engine.advance(stop)
            self._t = stop
            self._set(stop)
        if t > self._t:
            self.engine.advance(t)
            self._t = t

    def _require_steps(self, stop: float) -> None:
        if self._step is None:
            return
        try:
            whole_steps(self._t, stop, self._step)
        except InputError:
            advice = (
                f"a target changes at {stop:g} s, and no whole number of steps leads there from {self._t:g} s; choose "
                "a step that divides the time between instants"
            )
            raise InputError("dt", self._step, advice) from None

    def __getattr__(self, name: str) -> Any:
        if name == "engine":  # not yet there, as in a copy that is being made
            raise AttributeError(name)
        return getattr(self.engine, name)


def bare(engine: Any) -> Any:
    """The engine that a controller commands, or the engine itself: what it is able to do is asked of it alone.

    From Python 3.12 on checks of protocols do not look at what ``__getattr__`` hands on.
    """
    return engine.engine if isinstance(engine, CommandedEngine) else engine


def commanded(engine: Any, element: Element, step: float | None) -> Any:
    """Engine of an element under its controller; the engine itself if there is none.

    Raises:
        Refused: the adapter cannot set targets.
    """
    if isinstance(engine, CommandedEngine):
        return engine
    commands = element.commands() if isinstance(element, HoldsTargets) else None
    if commands is None:
        return engine
    if not isinstance(engine, TakesTargets):
        raise Refused("our adapter cannot set targets between two instants yet; it is no fault of the engine")
    return CommandedEngine(engine, commands, step)
