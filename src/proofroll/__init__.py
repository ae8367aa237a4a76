"""Cross-validation of multibody engines: which engine, formulation and time step to trust for a scene.

The public names, loaded when they are first used, so that importing proofroll stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import Diverged, InputError, Missing, ProofrollError, Refused

if TYPE_CHECKING:
    from proofroll.files.scene_file import load_scene
    from proofroll.running.simulation import simulate
    from proofroll.studies.judging.judge import judge

__all__ = ["Diverged", "InputError", "Missing", "ProofrollError", "Refused", "judge", "load_scene", "simulate"]
__version__ = "0.1.0"

_HOMES = {
    "judge": "proofroll.studies.judging.judge",
    "load_scene": "proofroll.files.scene_file",
    "simulate": "proofroll.running.simulation",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'proofroll' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # so that help() finds what is loaded only when it is used
