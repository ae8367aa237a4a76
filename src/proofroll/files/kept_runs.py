"""Runs that are kept by name, under ``out/runs``."""

import json
import re
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

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
    """A line for each kept run, the newest first: name, date, scene, engine, in what it differs, and how it ended.

    Parameters and settings stand where another kept run of the scene has others.
    """
    from proofroll.files.trajectory_file import read

    files = sorted(filter(Path.is_file, _FOLDER.glob("*.nc")), key=lambda file: file.stat().st_mtime, reverse=True)
    if not files:
        yield f"No run is kept in {_FOLDER}; proofroll run … --keep NAME keeps one."
        return
    widest, kept, given = max(len(file.stem) for file in files), dict[Path, Any](), dict[Path, dict[str, Any]]()
    for file in files:
        with suppress(OSError, ValueError, TypeError, KeyError):
            kept[file] = read(file).attrs
            given[file] = json.loads(kept[file]["parameters"]) | json.loads(kept[file]["settings"])
    for file in files:
        line = f"{file.stem:{widest}}  {time.strftime('%Y-%m-%d %H:%M', time.localtime(file.stat().st_mtime))}  "
        if file not in given:
            yield f"{line}cannot be read"
            continue
        scene, engine, status = (kept[file].get(key, "") for key in ("scene", "engine", "status"))
        runs = [given[run] for run in given if kept[run].get("scene") == scene]
        differences = [f"{k}={v}" for k, v in given[file].items() if any(run.get(k, v) != v for run in runs)]
        yield f"{line}{', '.join([f'{scene} in {engine}', *differences])}: {status}"
