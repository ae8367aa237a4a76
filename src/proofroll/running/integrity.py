"""Checks that an engine of another package did not replace the functions that judge it, in a worker's process."""

import importlib
import operator
import sys
from collections.abc import Iterator
from types import FunctionType, ModuleType
from typing import Any

from proofroll.core.source_code import OWN

# Modules that read scenes, certify and record; none of them may change while a process lives.
_JUDGING = tuple(f"proofroll.{folder}." for folder in ("core", "elements", "files", "running"))
# Imported early: the first case would import them only after the engine's package.
_EARLY = ("core.first_steps", "core.dataset", "running.recording", "files.scene_file")

_watched: dict[str, tuple[Any, ...]] = {}


def watch() -> None:
    """Stores references to the functions that judge engines; called before an engine of another package is loaded."""
    if _watched:
        return
    for name in _EARLY:
        importlib.import_module(f"proofroll.{name}")
    _watched.update(_judging_members())


def changed(kind: Any) -> str | None:
    """Name of the first judging function, class or constant that was replaced, or that belongs to the engine's package.

    None if there is none, or :func:`watch` was never called. Modules loaded since then are recorded for later checks.
    """
    if not _watched:
        return None
    package = kind.__module__.partition(".")[0]
    foreign = package != OWN.name
    for name, members in _judging_members().items():
        if not all(map(operator.is_, _watched.setdefault(name, members), members)):
            return name
        if foreign and str(getattr(members[0], "__module__", "")).partition(".")[0] == package:
            return name
    return None


def _judging_members() -> dict[str, tuple[Any, ...]]:
    """Functions, classes with their members, and constants of all judging modules, by full name."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith(_JUDGING)]
    return {name: members for module in modules for name, members in _of_module(module)}


def _of_module(module: ModuleType) -> Iterator[tuple[str, tuple[Any, ...]]]:
    for name, value in list(vars(module).items()):
        if callable(value) or name.isupper():
            yield f"{module.__name__}.{name}", _identity(value)
        if isinstance(value, type) and value.__module__ == module.__name__:
            for inner, part in list(vars(value).items()):
                if callable(part) or isinstance(part, (property, classmethod, staticmethod)):
                    yield f"{module.__name__}.{name}.{inner}", _identity(part)


def _identity(value: Any) -> tuple[Any, ...]:
    """The object itself and, for a function, its code and defaults."""
    if isinstance(value, FunctionType):
        return value, value.__code__, value.__defaults__, value.__kwdefaults__
    return (value,)
