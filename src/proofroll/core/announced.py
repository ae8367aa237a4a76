"""What installed packages announce by entry points."""

from __future__ import annotations

import sys
from importlib.metadata import EntryPoint, entry_points
from typing import Any


def announced(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of a group, by name; nothing is loaded."""
    return tuple(sorted(_everything().select(group=group), key=lambda point: point.name))


# Entry points by the ``sys.path`` that they were looked up for: a file of every installed package is read for them.
_known: dict[tuple[str, ...], Any] = {}


def _everything() -> Any:  # until Python 3.11 SelectableGroups, since then EntryPoints
    path = tuple(sys.path)
    if path not in _known:
        found = entry_points()
        if tuple(sys.path) != path:  # another thread changed it meanwhile: what was found is of neither
            return found
        _known[path] = found
    return _known[path]
