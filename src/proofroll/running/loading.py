"""Loads the engine and the scene of a case in the process that runs it, and checks their versions."""

import gc
from functools import lru_cache
from typing import Any

from proofroll.core.entry_points import announced
from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.formulations import FORMULATIONS
from proofroll.core.plugins import GROUP, load_engine, place_of, plain_name, resolve_settings
from proofroll.core.scene import Scene
from proofroll.core.source_code import OWN
from proofroll.running.case import Case
from proofroll.running.integrity import watch
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
