"""Engines and scenes as a case names them, in the process that runs it: it is the right ones, or an error."""

import gc
from typing import Any

from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.core.plugins import load_engine, place_of, plain_name, resolve_settings
from proofroll.core.scene import Scene
from proofroll.files.scene_file import load_scene
from proofroll.running.case import Case
from proofroll.running.program import engine, path_of

# What this process was told that it is: the part after ``@`` of the engines that it runs; empty: none.
_settled = ""


def settle(place: str) -> None:
    """Makes this process the one for engines ``NAME@place``."""
    global _settled  # noqa: PLW0603 -- a fact about the process, said once when it starts
    _settled = place


def here(name: str) -> str:
    """``NAME`` of ``NAME@PLACE`` if this process is the one at that place; else the name as it is."""
    return plain_name(name) if place_of(name) == _settled else name


def load(name: str) -> Any:
    """The class of an engine ``NAME``, ``NAME@PLACE`` or ``NAME@program:PATH``.

    Raises:
        InputError, Missing: see :func:`proofroll.core.plugins.load_engine`; or this process is at another place.
    """
    if path_of(name) is not None:
        return engine(name)
    try:
        return load_engine(here(name))
    except (InputError, Missing) as error:
        if not place_of(name):
            raise
        raise Missing(f"{name}: {error}") from None


def loaded(case: Case) -> tuple[Any, Any]:
    """Class of the engine, and complete settings, of a case.

    Raises:
        ProofrollError: the engine here is of another version than the one that was asked when the case was made.
    """
    kind = load(case.engine.name)
    gc.enable()  # the process of a worker imports without
    version = kind.version()
    if version != case.engine.version:
        said = f"{case.engine.name} is version {version} here, and was {case.engine.version} when it was asked"
        raise ProofrollError(f"{said}; begin again")
    return kind, resolve_settings(kind, case.engine.settings)


def scene_of(case: Case) -> Scene:
    """The scene of a case.

    Raises:
        InputError: there is no such scene or parameter.
        ProofrollError: the scene read here is not the one for which the case was made.
    """
    scene = load_scene(case.scene, asks=case.asks, **case.parameters)
    if scene.digest != case.scene_digest:
        raise ProofrollError(f"{case.scene} is another scene where {case.engine.name} runs than where it was asked for")
    return scene
