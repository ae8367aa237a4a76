"""Announcements of installed packages, by entry points."""

from __future__ import annotations

import sys
import warnings
from importlib.metadata import EntryPoint, EntryPoints, distributions
from typing import Any

# Entry points that could not be loaded -> a sentence that names the package; the command line tells them.
broken: dict[EntryPoint, str] = {}


def announced(group: str) -> tuple[EntryPoint, ...]:
    """The entry points of a group, by name; nothing is loaded."""
    return tuple(sorted(_everything().select(group=group), key=lambda point: point.name))


def loaded(group: str, of: type = type) -> list[tuple[EntryPoint, Any]]:
    """The entry points of a group with what they name.

    One that cannot be loaded, or names no instance of ``of`` (by default a class), is left out, with a warning.
    """
    loaded_points = []
    for point in announced(group):
        try:
            named = point.load()
        except (Exception, SystemExit) as error:  # whatever a package does when it is imported
            leave_out(point, f"cannot be loaded ({type(error).__name__}: {error})")
        else:
            if isinstance(named, of):
                loaded_points.append((point, named))
            else:
                leave_out(point, f"is no {'class' if of is type else of.__name__}")
    return loaded_points


def leave_out(point: EntryPoint, why: str) -> None:
    """Notes that an entry point is not used, and why; once."""
    if point not in broken:
        package = point.dist.name if point.dist else "a package"
        said = f"{package} announces {point.value} as {point.name} ({point.group}), which {why}"
        broken[point] = f"{said}; it is left out: update or uninstall {package}"
        warnings.warn(broken[point], RuntimeWarning, stacklevel=2)


# Entry points by the ``sys.path`` that they were looked up for: a file of every installed package is read for them.
_known: dict[tuple[str, ...], EntryPoints] = {}


def _everything() -> EntryPoints:
    path = tuple(sys.path)  # a copy: another thread may change it meanwhile, and change it back
    if path not in _known:
        by_name: dict[str, list[EntryPoint]] = {}
        for package in distributions(path=list(path)):
            ours = [point for point in package.entry_points if point.group.startswith("proofroll.")]
            if ours:
                by_name.setdefault(package.name, ours)  # the first of two of one name is that which is imported
        _known[path] = EntryPoints(point for points in by_name.values() for point in points)
    return _known[path]
