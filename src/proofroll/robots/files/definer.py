"""Questions about a robot file to the engine that defines its format, each asked once by all processes of a command."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

from proofroll.files.atomic import replacing
from proofroll.running.idle_workers import Workers

# Environment variable with the folder of answers, which processes inherit from the one that began the command.
_FOLDER = "PROOFROLL_ANSWERS"
# Files below a robot's folder whose times are looked at; an answer about a larger folder is not kept.
_MOST = 5000
# Format -> engine that was last found to define it, whose idle process is asked first. Until it is known, the process
# is named by the format, and renamed after its first answer.
_defines: dict[str, str] = {}


class Asked(Protocol):
    """What answers questions about a file: a process of an engine, or what it answered before."""

    def request(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """See :meth:`proofroll.running.process.Worker.request`."""


class Definer:
    """Engine that defines a format; its process is begun at the first question that was not asked before.

    Args:
        kind: format.
        path: of the user's file, below whose folder the files that it names are looked at.
        workers: processes in which engines run.
    """

    def __init__(self, kind: str, path: Path, workers: Workers) -> None:
        self._kind, self._path, self._workers = kind, path, workers

    def request(self, request: Mapping[str, Any], time_limit: float) -> dict[str, Any]:
        """See the protocol."""
        place = self._place(request)
        if place is not None:
            with contextlib.suppress(OSError, ValueError):
                return dict(json.loads(place.read_text(encoding="utf-8")))
        asked = _defines.get(self._kind, self._kind)
        with self._workers.lend(asked) as worker:
            answer = worker.request(request, time_limit)
        if "by" in answer:
            _defines[self._kind] = engine = str(answer["by"][0])
            self._workers.rename(asked, engine)  # its process has loaded the engine, which is asked next
            if place is not None:
                with contextlib.suppress(OSError), replacing(place) as temporary:
                    temporary.write_text(json.dumps(answer), encoding="utf-8")
        return answer

    def _place(self, request: Mapping[str, Any]) -> Path | None:
        """File of the answer, by the content of what is asked about and the times of the files beside it."""
        files = list(_files_below(self._path.resolve().parent))
        if len(files) > _MOST:
            return None
        arguments = dict(request["arguments"])
        try:
            content = Path(arguments.pop("path")).read_bytes()
            stats = [(name, (stat := os.stat(name)).st_mtime_ns, stat.st_size) for name in sorted(files)]
        except OSError:
            return None
        text = json.dumps([request["function"], arguments, stats], sort_keys=True, default=str)
        return _folder() / f"{hashlib.sha256(content + text.encode()).hexdigest()}.json"


def _files_below(folder: Path) -> Iterator[str]:
    """Paths of files below a folder, one more than are looked at at most."""
    count = 0
    for root, _, names in os.walk(folder):
        for name in names:
            yield os.path.join(root, name)
            if (count := count + 1) > _MOST:
                return


def _folder() -> Path:
    """Folder of the answers of this command, made by the first process that keeps one, and removed at its end."""
    if not os.environ.get(_FOLDER):
        made = tempfile.mkdtemp(prefix="proofroll-")
        os.environ[_FOLDER] = made
        atexit.register(shutil.rmtree, made, ignore_errors=True)
    return Path(os.environ[_FOLDER])
