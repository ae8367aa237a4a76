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
