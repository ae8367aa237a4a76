"""Runs that are kept by name, under ``out/runs``."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path

from proofroll.core.errors import InputError

_FOLDER = Path("out", "runs")
_NAME = re.compile(r"\w[\w.-]*")


def kept_path(name: str) -> Path:
    """File of a run with a name. Raises InputError unless it has letters, digits, ``_``, ``-`` and ``.`` alone."""
    if not _NAME.fullmatch(name):
        raise InputError("--keep", name, "give a name of letters, digits, _, and behind the first - and .")
    return _FOLDER / f"{name}.nc"


def run_file(named: str) -> Path:
    """File of a run by its path, or by the name under which it is kept; a path wins."""
    path = Path(named)
    return kept_path(named) if not path.exists() and _NAME.fullmatch(named) and kept_path(named).exists() else path


def kept_lines() -> Iterator[str]:
    """A line for each kept run, the newest first: name, date, scene, engine, and how it ended."""
    from proofroll.files.trajectory_file import read

    files = sorted(filter(Path.is_file, _FOLDER.glob("*.nc")), key=lambda file: file.stat().st_mtime, reverse=True)
    if not files:
        yield f"No run is kept in {_FOLDER}; proofroll run … --keep NAME keeps one."
        return
    widest = max(len(file.stem) for file in files)
    for file in files:
        date = time.strftime("%Y-%m-%d %H:%M", time.localtime(file.stat().st_mtime))
        try:
            attributes = read(file).attrs
        except (OSError, ValueError, TypeError, KeyError):
            yield f"{file.stem:{widest}}  {date}  cannot be read"
            continue
        scene, engine, status = (str(attributes.get(key, "")) for key in ("scene", "engine", "status"))
        yield f"{file.stem:{widest}}  {date}  {scene} in {engine}: {status}"
