"""Entry points by which installed packages announce engines, elements and other plug-ins."""

import contextlib
import sys
import warnings
from importlib.metadata import EntryPoint, EntryPoints, distributions
from typing import Any

_LONGEST = 200  # characters shown of the error with which a package fails to load
# Entry points that are not used -> a sentence that names the package and the reason; commands print it.
broken: dict[EntryPoint, str] = {}


def announced(group: str) -> tuple[EntryPoint, ...]:
    """Entry points of a group, sorted by name, without loading them."""
    return tuple(sorted(_everything().select(group=group), key=lambda point: point.name))


def loaded(group: str, of: type = type, like: Any = None, name: str = "") -> list[tuple[EntryPoint, Any]]:
    """Entry points of a group, or those with a name alone, each with the object that it names.

    An entry point is left out, with a warning, if it cannot be loaded, if its object is no instance of ``of`` (by
    default a class), or if the object lacks a member of the protocol ``like``.
    """
    loaded_points = []
    for point in announced(group):
        if name not in {"", point.name}:
            continue
        try:
            with contextlib.redirect_stdout(sys.stderr):  # standard output is for data
                named = point.load()
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # whatever a package does when it is imported
            leave_out(point, f"cannot be loaded ({type(error).__name__}: {str(error)[:_LONGEST]})")
        else:
            lacking = [name for name in _members(like) if not hasattr(named, name)]
            if not isinstance(named, of):
                leave_out(point, f"is no {'class' if of is type else of.__name__}")
            elif lacking:
                leave_out(point, f"is no {like.__name__}, for it lacks {', '.join(lacking)}")
            else:
                loaded_points.append((point, named))
    return loaded_points


def _members(protocol: Any) -> list[str]:
    """Names of the members that a class needs to follow a protocol."""
    if protocol is None:
        return []
    declared = [name for name, kind in protocol.__annotations__.items() if "ClassVar" in str(kind)]
    return [*declared, *(name for name in vars(protocol) if name not in declared and not name.startswith("_"))]


def leave_out(point: EntryPoint, why: str) -> None:
    """Records why an entry point is not used, and warns; only the first time."""
    if point not in broken:
        package = point.dist.name if point.dist else "a package"
        fault = f"{package} announces {point.value} as {point.name} ({point.group}), which {why}"
        broken[point] = f"{fault}; it is left out: update or uninstall {package}"
        warnings.warn(broken[point], RuntimeWarning, stacklevel=2)


# Cache: ``sys.path`` -> entry points; a look-up reads a file of every installed package.
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
