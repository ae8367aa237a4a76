"""What installed packages announce by entry points."""

from __future__ import annotations

import sys
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any


def announced(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of a group, by name; nothing is loaded."""
    return tuple(sorted(_everything(tuple(sys.path)).select(group=group), key=lambda point: point.name))


@cache
def _everything(_path: tuple[str, ...]) -> Any:  # until Python 3.11 SelectableGroups, since then EntryPoints
    """Looked up once for each ``sys.path``: a file of every installed package is read for it."""
    return entry_points()
