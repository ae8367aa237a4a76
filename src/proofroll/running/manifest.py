"""What a trajectory says about how it was made."""

from __future__ import annotations

import json
import platform
import sys
from collections.abc import Mapping
from importlib import metadata
from typing import Any

import proofroll
from proofroll.core.scene import Scene


def versions(engine: str, version: str) -> dict[str, str]:
    """Of the engine, of proofroll, Python, numpy and scipy."""
    own = {"proofroll": proofroll.__version__, "python": platform.python_version()}
    return {engine: version} | own | {name: metadata.version(name) for name in ("numpy", "scipy")}


def manifest(engine: str, settings: Mapping[str, Any], scene: Scene, made_with: Mapping[str, str]) -> dict[str, str]:
    """Attributes of a trajectory: engine, settings, parameters [SI], versions, interpreter and machine.

    Settings, parameters and versions are JSON.
    """
    return {
        "engine": engine,
        "settings": json.dumps(dict(settings), sort_keys=True),
        "parameters": json.dumps(dict(scene.parameters)),
        "versions": json.dumps(dict(made_with)),
        "interpreter": sys.executable,
        "machine": f"{platform.machine()} {platform.system()}",
    }
