"""Readers of robot files that do their worst."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np


class Raising:
    """Refuses with an error of its own."""

    kinds: ClassVar[tuple[str, ...]] = ("urdf",)
    options: ClassVar[Mapping[str, str]] = {}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = ""

    def version(self) -> str:
        """A version."""
        return "9.9"

    def read(self, _: Any) -> Any:
        """Raises, with markup and line breaks in its words."""
        raise RuntimeError("cannot <b>read</b>\n[bold]this[/bold]")


class Crashing(Raising):
    """Ends its process."""

    def read(self, _: Any) -> Any:
        """Aborts."""
        os.abort()


class Hanging(Raising):
    """Never answers."""

    def read(self, _: Any) -> Any:
        """Sleeps."""
        time.sleep(1000)


class Odd(Raising):
    """Answers with two joints of one name."""

    def read(self, request: Any) -> Any:
        """A reading whose second joint is called as the first."""
        from proofroll.robots.protocol import Reading

        count = request.states.count
        zero = np.zeros((count, 2))
        return Reading(("j1", "j1"), (1, 1), {}, {}, {}, {}, {}, np.zeros((count, 2, 2)), zero, zero)


class Misshapen(Raising):
    """Answers with arrays of another number of states."""

    def read(self, request: Any) -> Any:
        """A reading with poses of twice as many states as were asked."""
        from proofroll.robots.protocol import Reading

        count = request.states.count
        zero = np.zeros((count, 1))
        place = {"j1": np.zeros((2 * count, 3))}
        one = {"j1": 1.0}, {"j1": np.zeros(3)}, {"j1": np.eye(3)}
        turned = {"j1": np.zeros((2 * count, 3, 3))}
        return Reading(("j1",), (1,), *one, place, turned, np.zeros((count, 1, 1)), zero, zero)


class Broken(Raising):
    """Has a mistake of its own."""

    def read(self, _: Any) -> Any:
        """Asks for what is not there."""
        return self.nothing_of_that_name
