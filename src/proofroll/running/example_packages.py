"""Packages of engines in the folder ``examples/engines`` of proofroll's source, and their installation."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from proofroll.core.errors import InputError
from proofroll.core.plugins import GROUP
from proofroll.core.source_code import OWN
from proofroll.running.engine_questions import describe
from proofroll.running.make_environment import output_of

_PACKAGES = "examples/engines"


def example_packages(source: Path = OWN.parents[1]) -> dict[str, Path]:
    """Name of an engine -> folder of its package below a checkout of the source; empty where there is no checkout."""
    folders: dict[str, Path] = {}
    for file in sorted(source.glob(f"{_PACKAGES}/*/pyproject.toml")):
        points = tomllib.loads(file.read_text(encoding="utf-8"))["project"].get("entry-points", {})
        folders |= dict.fromkeys(points.get(GROUP, {}), file.parent)
    return folders


def install(name: str, packages: dict[str, Path]) -> tuple[str, Path]:
    """Installs the package of an engine into this Python: version of the engine, and folder of the package.

    Raises:
        InputError: there is no such package here.
        ProofrollError: pip refused it, or the engine does not start.
    """
    if name not in packages:
        choices = (
            f"choose one of {', '.join(packages)}" if packages else "a checkout of the source has packages of more"
        )
        advice = f"{choices} ({_PACKAGES}), or say by --requirement what to install"
        raise InputError("engine", name, advice)
    output_of([sys.executable, "-m", "pip", "install", "--quiet", str(packages[name])])
    return describe(f"{name}@{sys.executable}").version, packages[name]
