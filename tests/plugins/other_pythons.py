"""Virtual environments for tests, made without a network; they can import the packages of this one."""

from __future__ import annotations

import sysconfig
import venv
from pathlib import Path

PLUGINS = Path(__file__).parent


def bare(folder: Path) -> Path:
    """Creates an environment without packages; returns its Python."""
    venv.create(folder, symlinks=True)
    return folder / "bin" / "python"


def site_of(python: Path) -> Path:
    """Folder ``site-packages`` of an environment."""
    (found,) = python.parents[1].glob("lib/python*/site-packages")
    return found


def seeing(folder: Path, aged: str = "") -> Path:
    """Creates an environment with our packages, and with the engine ``aged`` in a version; returns its Python."""
    python = bare(folder)
    site = site_of(python)
    (site / "ours.pth").write_text(f"{PLUGINS}\n{seen_line()}\n")
    if aged:
        announce(site, aged)
    return python


def seen_line() -> str:
    """Line of a .pth file with which an environment imports our packages."""
    return f"import site; site.addsitedir({sysconfig.get_path('purelib')!r})"


def announce(site: Path, version: str) -> None:
    """Installs the engine ``aged`` in this version."""
    info = site / "aged-1.dist-info"
    info.mkdir(exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: aged\nVersion: {version}\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\naged = aged:Aged\n")


def script(path: Path, text: str) -> Path:
    """Writes an executable shell script; returns its path."""
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path
