"""What a trajectory says about how it was made."""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from typing import Any

import proofroll
from proofroll.core.scene import Scene


def versions(engine: str, version: str) -> dict[str, str]:
    """Of the engine, of proofroll and of Python."""
    return {engine: version, "proofroll": proofroll.__version__, "python": platform.python_version()}


def manifest(engine: str, settings: Mapping[str, Any], scene: Scene, made_with: Mapping[str, str]) -> dict[str, str]:
    """Attributes of a trajectory: engine, settings, parameters [SI], versions and machine, the middle three as JSON."""
    return {
        "engine": engine,
        "settings": json.dumps(dict(settings), sort_keys=True),
        "parameters": json.dumps(dict(scene.parameters)),
        "versions": json.dumps(dict(made_with)),
        "machine": f"{platform.machine()} {platform.system()}",
    }
