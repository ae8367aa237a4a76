"""A run that fails, as a program that shows the failure needs it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FailedRun:
    """A run beyond a boundary of a stability map, for a program that shows its failure.

    Attributes:
        scene, parameters, engine, version, settings, resolution, until, every: the case.
        where: the point of the map, for a person.
        boundary: ``stable`` or ``accurate``.
        failure: its name.
        silent: whether the engine does not say so.
        truth: the true run, or None.
        scale, allowed: range of the deciding observable, and part of it that its error may be.
        note: why the program asks proofroll, or nothing.
    """

    scene: str
    parameters: Mapping[str, float]
    engine: str
    version: str
    settings: Mapping[str, Any]
    resolution: str
    until: float
    every: float
    where: str
    boundary: str
    failure: str
    silent: bool
    truth: xr.Dataset | None
    scale: float
    allowed: float
    note: str

    def lines(self, what: str, head: str) -> list[str]:
        """The first words of a program with these lines of imports: ``what`` fails where, and what it needs."""
        numbers = ", ".join(f"{name} = {value:g}" for name, value in self.parameters.items()) or "default parameters"
        settings = ", ".join(f"{key}={value}" for key, value in self.settings.items())
        needs = " and ".join(imported(head))
        return [
            f"{self.engine} {self.version}: {self.failure} ({self.where}).",
            "",
            f"{what} ({self.scene}, {numbers}).",
            f"Beyond the largest {self.resolution} that is {self.boundary}. "
            + ("The engine does not say so." if self.silent else "The engine says so."),
            f"Settings: {settings}.",
            *([f"Why proofroll: {self.note}."] if self.note else []),
            f"Needs {needs} alone. Exit code 1: the failure shows.",
        ]


def imported(head: str) -> list[str]:
    """Packages that lines of imports name."""
    lines = [line.split() for line in head.splitlines() if line.startswith(("import ", "from "))]
    return list(dict.fromkeys(words[1].partition(".")[0] for words in lines))
