"""Exudyn: redundant coordinates with constraints, joint trees, and contacts of spheres and of discs."""

from typing import Any

__all__ = ["Exudyn"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from proofroll.engines.exudyn.adapter import Exudyn  # which a reader of robots does not need

    return Exudyn
