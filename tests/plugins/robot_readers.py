"""Readers of robot files that do their worst."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from typing import Any, ClassVar


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


class Broken(Raising):
    """Has a mistake of its own."""

    def read(self, _: Any) -> Any:
        """Asks for what is not there."""
        return self.nothing_of_that_name
