"""Bare loops are plug-ins, as engines are: entry points of their own group, under the engine's name."""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from proofroll.core.errors import Refused
from proofroll_benchmarks.bare import GROUP


def load_bare_loop(engine: str) -> Any:
    """The function that prepares bare loops of an engine; see :mod:`proofroll_benchmarks.bare`.

    Raises:
        Refused: no installed package announces one.
    """
    return announced(engine).load()


def announced(engine: str) -> EntryPoint:
    """The entry point of an engine's bare loop, which is not loaded yet.

    Raises:
        Refused: no installed package announces one.
    """
    for point in entry_points(group=GROUP):
        if point.name == engine:
            return point
    raise Refused(f"no bare loop is announced for {engine} (entry-point group {GROUP})")
