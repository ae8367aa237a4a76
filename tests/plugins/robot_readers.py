"""Faulty readers of robot files: they refuse, crash, hang or give invalid answers."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np


class Raising:
    """Reader that raises an error with markup and line breaks in its text."""

    kinds: ClassVar[tuple[str, ...]] = ("urdf",)
    options: ClassVar[Mapping[str, str]] = {}
    tolerances: ClassVar[Mapping[str, float]] = {}
    says: ClassVar[str] = ""

    def version(self) -> str:
        """See :class:`proofroll.robots.protocol.RobotReader`."""
        return "9.9"

    def read(self, _: Any) -> Any:
        """Raises RuntimeError."""
        raise RuntimeError("cannot <b>read</b>\n[bold]this[/bold]")


class Crashing(Raising):
    """Reader that ends its process."""

    def read(self, _: Any) -> Any:
        """Aborts the process."""
        os.abort()


class Hanging(Raising):
    """Reader that never answers."""

    def read(self, _: Any) -> Any:
        """Sleeps for 1000 s."""
        time.sleep(1000)


class Odd(Raising):
    """Reader that reports two joints of the same name."""

    def read(self, request: Any) -> Any:
        """Reading with two joints of the same name."""
        from proofroll.robots.protocol import Reading

        count = request.states.count
        zero = np.zeros((count, 2))
        return Reading(("j1", "j1"), (1, 1), {}, {}, {}, {}, {}, np.zeros((count, 2, 2)), zero, zero)


class Misshapen(Raising):
    """Reader whose arrays have a wrong number of states."""

    def read(self, request: Any) -> Any:
        """Reading with poses for twice the requested number of states."""
        from proofroll.robots.protocol import Reading

        count = request.states.count
        zero = np.zeros((count, 1))
        place = {"j1": np.zeros((2 * count, 3))}
        one = {"j1": 1.0}, {"j1": np.zeros(3)}, {"j1": np.eye(3)}
        turned = {"j1": np.zeros((2 * count, 3, 3))}
        return Reading(("j1",), (1,), *one, place, turned, np.zeros((count, 1, 1)), zero, zero)


class Broken(Raising):
    """Reader with a programming mistake."""

    def read(self, _: Any) -> Any:
        """Reads an attribute that does not exist."""
        return self.nothing_of_that_name
