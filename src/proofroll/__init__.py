"""Cross-validation of multibody engines: which engine, formulation and time step to trust for a scene.

Public names are loaded at their first use, so that importing proofroll is quick and the command handles Ctrl-C before
anything else is loaded.
"""

from __future__ import annotations

TYPE_CHECKING = False  # type checkers assume True; so the module typing need not be loaded
if TYPE_CHECKING:
    from typing import Any

    from proofroll.core.errors import Diverged, InputError, Missing, ProofrollError, Refused
    from proofroll.files.scene_file import load_scene
    from proofroll.running.simulation import simulate
    from proofroll.studies.comparison.by_name import compare
    from proofroll.studies.judging.judge import judge

__all__ = [
    "Diverged",
    "InputError",
    "Missing",
    "ProofrollError",
    "Refused",
    "compare",
    "judge",
    "load_scene",
    "simulate",
]
__version__ = "0.1.0"

_HOMES = {
    **dict.fromkeys(__all__[:5], "proofroll.core.errors"),
    "compare": "proofroll.studies.comparison.by_name",
    "judge": "proofroll.studies.judging.judge",
    "load_scene": "proofroll.files.scene_file",
    "simulate": "proofroll.running.simulation",
}


if not TYPE_CHECKING:  # for them every name would be one of proofroll's

    def __getattr__(name: str) -> Any:
        if name not in _HOMES:
            raise AttributeError(f"module 'proofroll' has no attribute {name!r}")
        from importlib import import_module

        return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})  # so that help() finds names that are not loaded yet
