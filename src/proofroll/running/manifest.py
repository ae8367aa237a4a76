"""Manifest of a trajectory: the engine, settings, versions and machine that made it."""

import contextlib
import json
import platform
import sys
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import metadata
from typing import Any

import proofroll
from proofroll.core.certificate import Line, Standing
from proofroll.core.scene import Scene


def versions(engine: str, version: str) -> dict[str, str]:
    """Versions of the engine, of proofroll, Python, numpy and scipy."""
    packages = {"proofroll": proofroll.__version__, "python": platform.python_version()}
    return {engine: version} | packages | {name: version_of(name) for name in ("numpy", "scipy")}


# Version of an installed package; cached, as reading it takes a millisecond and every run needs it.
version_of = cache(metadata.version)


def versions_of(names: Iterable[str], read: Callable[[str], str] = metadata.version) -> dict[str, str]:
    """Versions of those of the named packages that are installed, each by ``read``."""
    found_versions = {}
    for name in names:
        with contextlib.suppress(metadata.PackageNotFoundError):
            found_versions[name] = read(name)
    return found_versions


def manifest(
    engine: str,
    settings: Mapping[str, Any],
    scene: Scene,
    made_with: Mapping[str, str],
    certificate: Iterable[Line] = (),
) -> dict[str, str]:
    """Attributes of a trajectory: engine, settings, parameters [SI], versions, interpreter and machine.

    Settings, parameters and versions are JSON. ``not_reported`` lists quantities of the certificate that the engine
    does not report, if there are any.
    """
    silent = ", ".join(line.quantity for line in certificate if line.standing is Standing.NOT_REPORTED)
    return ({"not_reported": silent} if silent else {}) | {
        "engine": engine,
        "settings": json.dumps(dict(settings), sort_keys=True),
        "parameters": json.dumps(dict(scene.parameters)),
        "versions": json.dumps(dict(made_with)),
        "interpreter": sys.executable,
        "machine": f"{platform.machine()} {platform.system()}",
    }
