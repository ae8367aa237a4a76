"""MJCF files compiled by MuJoCo in a separate process, and questions to it, each asked once by all processes."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import itertools
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from proofroll.core.errors import InputError, Missing, Refused
from proofroll.core.plugins import engine_names
from proofroll.files.atomic import replacing
from proofroll.files.json_data import plain
from proofroll.robots.files.reading import call, load_reader, robot_from, words_of
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.model import Robot
from proofroll.robots.protocol import GROUP
from proofroll.running.idle_workers import Workers

# Environment variable with the folder of answers, which processes inherit from the one that began the command.
_FOLDER = "PROOFROLL_ANSWERS"
# Files below a robot's folder whose times are looked at; an answer about a larger folder is not kept.
_MOST = 5000
# Format -> engine that was last found to define it, whose idle process is asked first. Until it is known, the process
# is named by the format, and renamed after its first answer.
_defines: dict[str, str] = {}


class Compiler(NamedTuple):
    """Name and version of the engine that defines a format and compiled a file."""

    engine: str
    version: str


def compile_robot(path: str, original: str | None) -> dict[str, Any]:
    """Worker's side of :func:`compiled_robot`: the file's robot as plain data.

    ``original`` is the path of the file whose copy this is; None: not to be opened.
    """

    def answer(reader: Any) -> dict[str, Any]:
        try:
            return {"robot": plain(reader.compiled(Path(path)))}
        except Refused:
            raise
        except Exception as error:
            if original is None:
                raise
            reader.compiled(Path(original))  # its error says more of the file than that of the copy
            message = f"it is read, but not its copy without looks and contacts; please report this: {words_of(error)}"
            raise Refused(message) from None

    return _defined(Path(path), answer)


def ask_reader(path: str, method: str, **asked: Any) -> dict[str, Any]:
    """Worker's side of :func:`expand` and :func:`near_shapes`: what a method of the reader says of a file."""
    return _defined(Path(path), lambda reader: {"answer": getattr(reader, method)(Path(path), **asked)})


def _defined(path: Path, answer: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
    """Answer of the engine that defines MJCF, with its name as ``by``; or the reason of failure.

    The reason is ``uncovered`` (the check does not cover something in the file) or ``message``.
    """
    for name in engine_names(GROUP):
        try:
            reader = load_reader(name)
        except Missing:
            continue
        if getattr(reader, "defines", None) == "mjcf":
            by = Compiler(name, reader.version())
            try:
                with contextlib.chdir(path.parent):  # where an engine may leave its log
                    return answer(reader) | {"by": by}
            except Refused as error:
                return {"uncovered": str(error)}
            except Exception as error:
                return {"message": f"{' '.join(by)} refuses it: {words_of(error)}"}
    return {"message": "no engine that defines MJCF is installed: pip install 'proofroll[mujoco]'"}


def compiled_robot(
    worker: AnswersQuestions, file: RobotFile, written: Path, time_limit: float
) -> tuple[Robot, Compiler]:
    """Robot of an MJCF, and the engine that compiled it.

    Raises:
        InputError: the engine that defines the format cannot compile it, or is not installed.
        WorkerDied: the compiler crashed or took too long.
    """
    original = str(file.path.resolve()) if file.contained else None
    answer = worker.request(call(compile_robot, path=str(written), original=original), time_limit)
    if "uncovered" in answer:
        raise InputError("file", file.path, answer["uncovered"])
    if "robot" not in answer:
        raise InputError("file", file.path, f"it has no meaning: {answer['message']}")
    robot = robot_from(answer["robot"])
    joints = ((item.name, item) for item in robot.joints)
    for name, part in (*robot.bodies.items(), *joints, *((item.joint, item) for item in robot.mimics)):
        for key, value in vars(part).items():
            endless = not isinstance(value, str) and not np.isfinite(np.nan if value is None else value).all()
            if endless and key not in {"lower", "upper", "effort", "speed"}:  # most joints have no limits
                raise InputError(f"{file.path}: {key} of {name}", "nan", "numbers must be finite")
    return robot, Compiler(*answer["by"])


def near_shapes(
    worker: AnswersQuestions, path: Path, copy: Path, asked: Mapping[str, Any], time_limit: float
) -> tuple[dict[str, Any], Compiler]:
    """Shapes of a robot file that come near each other, and the engine that says so.

    Args:
        worker: answers for the engine.
        path: path of the user's file, for messages.
        copy: its copy, with contacts.
        asked: further arguments of :meth:`proofroll.robots.importers.mujoco.MujocoRobots.near_shapes`.
        time_limit: limit for the answer [s].

    Raises:
        InputError: the engine that defines MJCF cannot read the copy, or is not installed.
        WorkerDied: the engine crashed or took too long.
    """
    answer = worker.request(call(ask_reader, path=str(copy), method="near_shapes", **asked), time_limit)
    if "answer" not in answer:
        message = answer.get("message") or answer["uncovered"]
        raise InputError("ground", path, f"its shapes cannot be read: {message}; take --ground none")
    return answer["answer"], Compiler(*answer["by"])


def expand(
    worker: AnswersQuestions, path: Path, parts: Mapping[str, Element], time_limit: float
) -> tuple[Element, Compiler]:
    """Root of an MJCF with macros written out, and the engine that did so.

    Args:
        worker: answers for the engine.
        path: path of the user's file, for messages.
        parts: name -> content of the file (first) and of the files that it attaches.
        time_limit: limit for the answer [s].

    Raises:
        InputError: the engine that defines the format cannot expand the file, or is not installed.
        WorkerDied: the engine crashed or took too long.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for part, content in parts.items():
            (folder / part).write_bytes(ElementTree.tostring(content, encoding="utf-8"))
        copy = str(folder / next(iter(parts)))
        answer = worker.request(call(ask_reader, path=copy, method="expanded"), time_limit)
    if "answer" not in answer:
        raise InputError("file", path, f"its macros cannot be written out: {answer['message']}")
    return ElementTree.fromstring(answer["answer"]), Compiler(*answer["by"])


class AnswersQuestions(Protocol):
    """Protocol of a process of an engine, or of its earlier answers."""

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
        folders = os.walk(self._path.resolve().parent)
        below = (os.path.join(root, name) for root, _, names in folders for name in names)
        files = list(itertools.islice(below, _MOST + 1))
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


def _folder() -> Path:
    """Folder of the answers of this command, made by the first process that keeps one, and removed at its end."""
    if not os.environ.get(_FOLDER):
        made = tempfile.mkdtemp(prefix="proofroll-")
        os.environ[_FOLDER] = made
        atexit.register(shutil.rmtree, made, ignore_errors=True)
    return Path(os.environ[_FOLDER])
