"""Motions of the projection method that go from mode to mode: where a mode ends, and what ends the run."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.core.dop853 import TIGHTEST
from proofroll.core.errors import Diverged
from proofroll.core.integrators import INTEGRATORS
from proofroll.engines.projection.contact.alternating import AlternatingMotion, Excess
from proofroll.engines.projection.contact.contact_modes import ContactMotion
from proofroll.engines.projection.contact.joint_modes import SwitchedMotion


class Bouncing(AlternatingMotion[str]):
    """A point that falls from 1 m and leaves the ground with half its speed, or with none."""

    alternates = "bounces"

    def __init__(self, stepper: Any, part: float) -> None:
        equations: Any = SimpleNamespace(applied=SimpleNamespace(now=0.0))
        super().__init__(equations, stepper, lambda _, x: x)
        self._part = part
        self._enter(0.0, np.array([1.0, 0.0, 0.0]), "flies")

    def _rates(self, y: Any) -> Any:
        return np.array([y[1], -9.81, 1.0])

    def _excess(self, y: Any) -> list[Excess]:
        return [Excess(0, "impact", -float(y[0]), -float(y[1]))]

    def _next(self, y: Any, which: int, kind: str) -> tuple[Any, str, list[tuple[str, str]]]:
        assert (which, kind) == (0, "impact")
        after = [0.0 if self._part else -1e-12, -self._part * y[1], y[2]]
        return np.array(after), "flies", [("impact", "ground")]


@pytest.mark.parametrize(("name", "resolution"), [("rk4", 1e-2), ("dop853", 1e-10)])
def test_a_mode_ends_where_its_margin_does(name: str, resolution: float) -> None:
    """Impacts are located far below the step, and each has its time in its bracket."""
    motion = Bouncing(INTEGRATORS[name](resolution), 0.5)
    motion.advance(1.0)
    fall = np.sqrt(2 / 9.81)
    assert [event.time for event in motion.events] == pytest.approx([fall, 2 * fall], rel=1e-10)
    assert all(event.time_low <= event.time <= event.time_high for event in motion.events)
    assert {event.name for event in motion.events} == {"ground"}


class Stopping(AlternatingMotion[str]):
    """A slip in two dimensions that friction ends while it turns; its direction has no value where it is zero."""

    alternates = "slips"
    counted = 0

    def __init__(self, stepper: Any) -> None:
        equations: Any = SimpleNamespace(applied=SimpleNamespace(now=0.0))
        super().__init__(equations, stepper, lambda _, x: x)
        self._enter(0.0, np.array([1.0, 0.5, 0.0]), "slip")

    def _look(self, y: Any) -> None:
        self._toward = self._heading(y)

    def _heading(self, y: Any) -> Any:
        size = np.hypot(*y[:2])
        return y[:2] / size * (1 if y[:2] @ self._toward >= 0 else -1) if size else self._toward

    def _enter(self, t: float, y: Any, mode: str) -> None:
        self._toward = y[:2]
        super()._enter(t, y, mode)

    def _rates(self, y: Any) -> Any:
        self.counted += 1
        return np.append(-self._heading(y) + [-y[1], y[0]] if self.mode == "slip" else np.zeros(2), 1.0)

    def _excess(self, y: Any) -> list[Excess]:
        return [Excess(0, "still", -float(y[:2] @ self._toward), float(self.mode == "slip"))]

    def _crossing(self, end: Excess, high: float) -> float:
        self.counted = 0
        return super()._crossing(end, high)

    def _next(self, y: Any, which: int, kind: str) -> tuple[Any, str, list[tuple[str, str]]]:
        assert (which, kind) == (0, "still")
        self.located = self.counted
        return y, "stick", [("stick", "ground")]


def test_a_stop_is_located_without_coming_near_it_each_time_anew() -> None:
    """Short steps lead to where a slip ends: they are taken once, and its time has the digits of the method."""
    motion = Stopping(INTEGRATORS["dop853"](TIGHTEST))
    motion.advance(2.0)
    assert [event.time for event in motion.events] == pytest.approx([np.hypot(1.0, 0.5)], abs=1e-13)
    assert motion.located < 1000  # rates: 675, and 1,565 where each trial begins with the step that holds the stop


@pytest.mark.drill
def test_modes_that_end_at_once_end_the_run() -> None:
    """Twenty changes without any progress are an endless loop."""
    with pytest.raises(Diverged, match="bounces alternate without end"):
        Bouncing(INTEGRATORS["dop853"](1e-10), 0.0).advance(1.0)


def test_joints_and_contacts_go_from_mode_to_mode_alike() -> None:
    """Steps, search and events stand once for switched joints and for contacts."""
    for name in ("advance", "_crossing", "_switch"):
        assert getattr(SwitchedMotion, name) is getattr(ContactMotion, name) is getattr(AlternatingMotion, name)
