"""Meaning of a robot file: of a URDF our own reading, of an MJCF the compiled model of the engine that defines it."""

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from xml.etree.ElementTree import Element, fromstring

from proofroll.core.errors import InputError
from proofroll.core.limits import TIME_LIMIT
from proofroll.robots.files import reading
from proofroll.robots.files.mjcf.compiler import AnswersQuestions, Compiler, Definer, compiled_robot, expand
from proofroll.robots.files.opening import open_robot
from proofroll.robots.files.robot_file import RobotFile
from proofroll.robots.files.urdf import read_urdf
from proofroll.robots.model import Robot
from proofroll.running.engine_questions import lent_workers
from proofroll.running.idle_workers import Workers
from proofroll.running.process import WorkerDied

_Answer = TypeVar("_Answer")


@dataclass(frozen=True)
class CheckSettings:
    """Settings of a check of robot files.

    Attributes:
        base: support of the root of a URDF, ``fixed`` or ``free``.
        root: folder that holds a file and all files named in it; None: the file's own.
        states: number of random states to compare.
        seed: seed of the states.
        time_limit: limit for each answer of an engine [s].
    """

    base: str = "fixed"
    root: Path | None = None
    states: int = 20
    seed: int = 0
    time_limit: float = TIME_LIMIT


USUAL = CheckSettings()


def moving_robot(
    path: Path, settings: CheckSettings, workers: Workers, folder: Path
) -> tuple[RobotFile, Path, Robot, Compiler | None]:
    """A file, its copy for engines in a folder, and what :func:`meaning` says of it.

    Raises:
        InputError: the file is broken, or nothing in it moves.
    """
    file = opened(path, settings.base, settings.root, settings.time_limit, workers)
    written = reading.write(file, folder)
    robot, compiler = meaning(file, written, settings.time_limit, workers)
    if not robot.moving:
        hint = "; try --base free" if file.kind == "urdf" and file.base == "fixed" else ""
        raise InputError("file", path, f"nothing in it moves{hint}")
    return file, written, robot, compiler


def source_of(compiler: Compiler | None) -> str:
    """Clause on whose reading is the meaning of a file."""
    return f"the model that {' '.join(compiler)} compiles" if compiler else "our own reading of the file"


def meaning(
    file: RobotFile, written: Path, time_limit: float, workers: Workers | None = None
) -> tuple[Robot, Compiler | None]:
    """The robot that a file describes, and the engine whose compiler says so; None: our own reading (URDF).

    Args:
        file: the file.
        written: path of its copy for engines, which is compiled.
        time_limit: limit for the compiler's answer [s].
        workers: processes in which engines run; by default a new one.

    Raises:
        InputError: the file describes no robot.
    """
    if file.kind == "urdf":
        return read_urdf(file), None
    robot, by = by_definer(
        file.kind, file.path, workers, lambda worker: compiled_robot(worker, file, written, time_limit)
    )
    return robot.change(name=file.root.get("model", "robot")), by


def opened(
    path: Path,
    base: str,
    root: Path | None = None,
    time_limit: float = TIME_LIMIT,
    workers: Workers | None = None,
    *,
    contacts: bool = False,
) -> RobotFile:
    """A file as :func:`proofroll.robots.files.opening.open_robot` reads it, with macros written out.

    The engine that defines the format writes them out within ``time_limit`` [s]. ``contacts``: see there.
    """

    def expanded(parts: Mapping[str, Element]) -> Element:
        return by_definer("mjcf", path, workers, lambda w: expand(w, path, parts, time_limit))[0]

    return open_robot(path, base, root, expanded, contacts=contacts)


def by_definer(
    kind: str, path: Path, workers: Workers | None, ask: Callable[[AnswersQuestions], tuple[_Answer, Compiler]]
) -> tuple[_Answer, Compiler]:
    """Answer of the engine that defines a format, and its name. Raises InputError if its process dies."""
    with lent_workers(workers) as lent:
        try:
            return ask(Definer(kind, path, lent))
        except WorkerDied as error:
            raise InputError("file", path, f"it could not be compiled: {error}") from None


def robot_of_text(path: Path, kind: str, base: str, content: bytes) -> Robot:
    """Robot of a file with this content.

    Raises:
        InputError: the file describes no robot.
    """
    file = RobotFile(path, kind, fromstring(content), base)
    with tempfile.TemporaryDirectory() as folder:
        return meaning(file, reading.write(file, Path(folder)), TIME_LIMIT)[0]
