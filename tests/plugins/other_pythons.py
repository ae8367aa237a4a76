"""Other interpreters for tests, made without a network: environments that see the packages of this one."""

from __future__ import annotations

import sysconfig
import venv
from pathlib import Path

PLUGINS = Path(__file__).parent


def bare(folder: Path) -> Path:
    """The Python of an environment that has no packages."""
    venv.create(folder, symlinks=True)
    return folder / "bin" / "python"


def site_of(python: Path) -> Path:
    """Folder of the packages of an environment."""
    (found,) = python.parents[1].glob("lib/python*/site-packages")
    return found


def seeing(folder: Path, aged: str = "") -> Path:
    """The Python of an environment that sees our packages, and the engine ``aged`` in a version of its own."""
    python = bare(folder)
    site = site_of(python)
    (site / "ours.pth").write_text(f"{PLUGINS}\n{seen_line()}\n")
    if aged:
        announce(site, aged)
    return python


def seen_line() -> str:
    """A line of a .pth file by which another environment sees our packages."""
    return f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})"


def announce(site: Path, version: str) -> None:
    """Installs the engine ``aged`` in this version."""
    info = site / "aged-1.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: aged\nVersion: {version}\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\naged = aged:Aged\n")


def script(path: Path, text: str) -> Path:
    """A program of the shell."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path
