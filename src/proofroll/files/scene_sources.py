"""Files of other formats that hold a scene; entry points ``proofroll.scene_sources`` announce their readers."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any, ClassVar, Protocol, runtime_checkable

from proofroll.core.engine_abilities import OwnOptions
from proofroll.core.entry_points import loaded
from proofroll.core.errors import InputError
from proofroll.core.number_format import exact

GROUP = "proofroll.scene_sources"
# Entry points of functions of a path, such as ``own_options``, by the ending of their files without its dot.
OPTIONS = "proofroll.option_readers"


# Variable that names the folder of robot files and of all that they name, for a process and its workers.
ROOT = "PROOFROLL_ROOT"
# Between the file of a robot and that of its controller, in the name of a scene.
BESIDE = "+"


@runtime_checkable
class TakesControllers(Protocol):
    """Ability of a reader whose scenes may have a controller, described in a file of its own."""

    @staticmethod
    def under(control: Path) -> Any:
        """Reader of the same files, whose scenes have the controller of a file."""


class SceneSource(Protocol):
    """Reader of scenes in files of other formats.

    Attributes:
        endings: of the files that it reads, with the dot, in small letters.
    """

    endings: ClassVar[tuple[str, ...]]

    @staticmethod
    def content(path: Path) -> Mapping[str, Any]:
        """Content of the scene as in a ``scene.toml``: title, source, parameters, reason, duration.

        Raises:
            InputError: the file is broken; the first mistake in it.
        """

    @staticmethod
    def tables(path: Path, values: Mapping[str, float]) -> Mapping[str, Any]:
        """Tables as in a ``scene.toml``, gravity among them, with numbers instead of parameters.

        A list ``omitted`` may name what the file describes and the scene leaves out, with the option that brings it in;
        a text ``about`` is added to the title.

        Args:
            path: of the file.
            values: of its parameters.

        Raises:
            InputError: the file with these parameters is no scene.
        """


@runtime_checkable
class SeesTouches(Protocol):
    """Ability of a reader whose scenes lack pairs of shapes that it did not see come near each other."""

    @staticmethod
    def until_met(path: Path, scene: Any, motion: Any) -> Any:
        """A motion up to its first sample in which shapes press each other that the scene has no pair of."""


def command_line(*words: str, **options: object) -> str:
    """Command of proofroll to be pasted: words, options with a value, a list or None, and the root of robot files.

    The option ``--out`` is left out for the folder that is the usual one.
    """
    given: list[str] = []
    for name, value in options.items():
        values = value if isinstance(value, list) else [] if value in (None, "", Path("out")) else [value]
        texts = (exact(item) if isinstance(item, float) else str(item) for item in values)
        given += (word for text in texts for word in (f"--{name.replace('_', '-')}", text))
    return shlex.join(["proofroll", *words, *given, *root_words()])


def root_words() -> list[str]:
    """Option of a command that reads robot files as this process does; empty: they are read in their own folders."""
    return ["--root", os.environ[ROOT]] if os.environ.get(ROOT) else []


def with_control(name: str, control: Path) -> str:
    """Name of the scene of a robot file under the controller of another file.

    Raises:
        InputError: there is no such controller's file, or the scene is no robot file.
    """
    if not control.is_file():
        raise InputError("--control", control, "there is no such file")
    source = source_of(name)
    if source is None or not isinstance(source[0], TakesControllers):
        raise InputError("--control", control, f"it is for a robot file (URDF, MJCF), and {name} is none")
    return f"{name}{BESIDE}{control}"


def parts_of(name: str) -> tuple[str, str]:
    """Name of a file and of its controller's file; the latter is empty if there is none."""
    name = str(name)  # callers without type checks give paths
    places = [place for place, letter in enumerate(name) if letter == BESIDE]
    pairs = ((name[:place], name[place + 1 :]) for place in places)
    return next((pair for pair in pairs if _is_file(pair[0]) and _is_file(pair[1])), (name, ""))


def stem_of(name: str) -> str:
    """Name without folders and endings, of a scene in files of other formats."""
    return BESIDE.join(Path(part).stem for part in parts_of(name) if part)


def resolved(name: str) -> str:
    """Name of a scene with whole paths."""
    return BESIDE.join(str(Path(part).resolve()) for part in parts_of(name) if part)


class JudgedRecord(Protocol):
    """Judgement of a record, a dataclass.

    Attributes:
        agrees: True if nothing in the record differs.
        looked_at: True if something could be judged.
        decided: True if nothing differs without the record telling whether that counts.
    """

    agrees: bool
    looked_at: bool
    decided: bool

    def lines(self) -> Iterable[str]:
        """Lines of text about it."""


@runtime_checkable
class JudgesRecords(Protocol):
    """Ability of a reader that judges records of its scenes under a controller, without a simulation."""

    @staticmethod
    def judge_record(
        record: Path, robot: Path, control: Path | None, names: Mapping[str, str] | None = None, layout: str = ""
    ) -> JudgedRecord:
        """Judgement of the record in a CSV file, or in a file of arrays.

        Args:
            record: path of the record.
            robot: path of the file of the scene.
            control: path of the controller's file; None: there is none.
            names: column of the record -> its name here, perhaps with its unit, ``q.hip[deg]``.
            layout: program whose arrays the file has; empty: it has columns.

        Raises:
            InputError: a file is wrong, or they do not fit.
        """


def options_of(path: Path) -> OwnOptions | None:
    """Options of an engine in a person's own file; None: no reader knows its ending, or its format has none.

    Raises:
        InputError: the file has no options that can be compared.
    """
    readers = loaded(OPTIONS, of=FunctionType, name=path.suffix.removeprefix(".").lower()) if path.suffix else []
    return next((reader(path) for _, reader in readers), None)


@dataclass(frozen=True)
class ProbeStart:
    """Start of a robot that moves in the air under known efforts.

    Attributes:
        kind: ``urdf`` or ``mjcf``.
        base: place [m] and quaternion, scalar first, of a base that floats, velocity of its origin [m/s] and angular
            velocity [rad/s] in the world's axes, (13,); None: it is fixed.
        joints: joint -> coordinate, rate, constant and swinging part of its effort, damping in the file.
    """

    kind: str
    base: tuple[float, ...] | None
    joints: Mapping[str, tuple[float, ...]]


@runtime_checkable
class StartsProbes(Protocol):
    """Ability of a reader of robots that can move in the air in a simulator of the user."""

    @staticmethod
    def probe_start(path: Path, *, free: bool) -> ProbeStart:
        """Start of a robot; ``free``: nothing holds the root of a URDF.

        Raises:
            InputError: the file is wrong, or the robot is none that a probe moves.
        """


def source_of(name: str) -> tuple[Any, Path] | None:
    """Reader of a file of another format, and its path; None: the file is none."""
    file, control = (name, "") if _is_file(name) else parts_of(name)
    if not _is_file(file):
        return None  # most names are those of folders, so the readers need not be loaded
    source = _sources().get(Path(file).suffix.lower())
    if source is None or (control and not isinstance(source, TakesControllers)):
        return None
    return source.under(Path(control)) if control else source, Path(file)


def _is_file(name: str) -> bool:
    try:
        return bool(Path(name).suffix) and Path(name).is_file()
    except (OSError, ValueError):  # the name is too long for the file system, or has a zero byte
        return False


@cache
def _sources() -> dict[str, type[SceneSource]]:
    sources = (source for _, source in loaded(GROUP, like=SceneSource))
    return {ending: source for source in sources for ending in source.endings}
