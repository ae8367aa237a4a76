"""Loads engine and scene of a case in the process that runs it, and checks versions and the functions that judge."""

import gc
import importlib
import operator
import sys
from collections.abc import Iterator
from functools import lru_cache
from types import FunctionType, ModuleType
from typing import Any

from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.formulations import FORMULATIONS
from proofroll.core.plugins import GROUP, load_engine, place_of, plain_name, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.source_code import OWN
from proofroll.running.case import Case
from proofroll.running.program import engine, path_of

# Scenes that a process keeps, as most cases are of few.
_SCENES = 32
# Place that this process serves: the part after ``@`` of its engines; empty: engines of this interpreter.
_settled = ""
# True in a worker: engines of other packages are watched there.
_watches_foreign = False


def serve_place(place: str) -> None:
    """Makes this process serve engines ``NAME@place``."""
    global _settled  # noqa: PLW0603 -- a fact about the process, set once when it starts
    _settled = place


def watch_foreign() -> None:
    """Makes this process watch what judges engines before it loads one of another package, or what one adds to it."""
    global _watches_foreign  # noqa: PLW0603 -- a fact about the process, set once when it starts
    _watches_foreign = True


def _is_foreign(name: str) -> bool:
    points = [point for group in (GROUP, FORMULATIONS) for point in announced(group) if point.name == name]
    return any(point.module.partition(".")[0] != OWN.name for point in points)


def local_name(name: str) -> str:
    """``NAME`` for ``NAME@PLACE`` if this process serves that place; otherwise the name unchanged."""
    return plain_name(name) if place_of(name) == _settled else name


def load(name: str) -> Any:
    """Class of an engine ``NAME``, ``NAME@PLACE`` or ``NAME@program:PATH``.

    Raises:
        InputError, Missing: see :func:`proofroll.core.plugins.load_engine`; Missing, too, if this process serves
        another place.
    """
    if path_of(name) is not None:
        return engine(name)
    if _watches_foreign and _is_foreign(local_name(name)):
        watch()
    try:
        return load_engine(local_name(name))
    except (InputError, Missing) as error:
        if not place_of(name):
            raise
        raise Missing(f"{name}: {error}") from None


def engine_and_settings(case: Case) -> tuple[Any, Any]:
    """Class of the engine and complete settings of a case.

    Raises:
        ProofrollError: the engine has another version here than when the case was made.
    """
    kind = load(case.engine.name)
    gc.enable()  # a worker's process imports with it disabled
    version = kind.version()
    if version != case.engine.version:
        change = f"{case.engine.name} is version {version} here, and was {case.engine.version} when it was asked"
        raise ProofrollError(f"{change}; begin again")
    return kind, resolve_settings(kind, case.engine.settings)


def scene_of(case: Case) -> Scene:
    """Scene of a case.

    Raises:
        InputError: there is no such scene or parameter.
        ProofrollError: the scene has another digest here than when the case was made.
    """
    scene = _scene(case.scene, case.scene_digest, case.asks, tuple(case.parameters.items()))
    if scene.digest != case.scene_digest:
        raise ProofrollError(f"{case.scene} is another scene where {case.engine.name} runs than where it was asked for")
    return scene


@lru_cache(maxsize=_SCENES)
def _scene(name: str, _digest: str, asks: tuple[str, ...], parameters: tuple[tuple[str, float], ...]) -> Scene:
    """One of the last scenes of this process; engines get copies of them."""
    from proofroll.files.scene_file import load_scene  # which a reader of robot files does not need

    return load_scene(name, asks=asks, **dict(parameters))


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
