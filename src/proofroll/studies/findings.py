"""Findings about engines: files under ``findings/``, each with a program that uses only the engine."""

import json
import re
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from proofroll.core.errors import InputError, Missing, require_known
from proofroll.core.limits import PROGRAM_TIME_LIMIT
from proofroll.files.data_folders import data_folder
from proofroll.running.bound_program import printed_by
from proofroll.running.process import safe_environment

# Exit code of a program whose finding still shows; 0: it is gone; any other: the program could not tell.
SHOWS = 10
_FRONT = re.compile(r"\+\+\+\n(.*?)\n\+\+\+\n(.*)", re.DOTALL)
_PROGRAM = re.compile(r"```python\n(.*?)```", re.DOTALL)
# Program that prints the installed versions of the packages in its arguments.
_LOOK = """
import importlib.metadata, json, sys
known = {str(item.metadata["Name"]).lower(): item.version for item in importlib.metadata.distributions()}
print(json.dumps({name: known[name] for name in sys.argv[1:] if name in known}))
"""


@dataclass(frozen=True)
class EngineFinding:
    """One file of ``findings/``.

    Attributes:
        name: of the file.
        title: behaviour of the engine, in one line.
        engine: name of the engine.
        package: distribution that has to be installed.
        seen: versions in which it was seen, for a person.
        gone: versions in which it no longer showed; may be empty.
        issue: address of the public thread about it; may be empty.
        text: words of the documentation, observed behaviour, consequence, remedy.
        program: source; exit code 10 if it shows.
        kinds: patterns of the kinds of surprises that random scenes show of it, with ``*`` for any text.
    """

    name: str
    title: str
    engine: str
    package: str
    seen: str
    gone: str
    issue: str
    text: str
    program: str
    kinds: tuple[str, ...] = ()


class FindingState(StrEnum):
    """State of a finding with the installed versions."""

    SHOWS = "still shows"
    GONE = "gone"
    NOT_INSTALLED = "not installed"
    BROKEN = "could not tell"


@dataclass(frozen=True)
class Shown:
    """Result of a finding's program with the installed package.

    Attributes:
        finding: the finding.
        state: see :class:`FindingState`.
        version: of the installed package; empty if it is not installed.
        said: the last line that the program printed.
    """

    finding: EngineFinding
    state: FindingState
    version: str
    said: str


def load_findings(engines: Iterable[str] = ()) -> list[EngineFinding]:
    """All findings by name, or those about the named engines.

    Raises:
        InputError: a file is no finding, or there is none about a named engine.
    """
    every_finding = [read_finding(path) for path in sorted(data_folder("findings").glob("*.md"))]
    names = list(engines)
    owners = sorted({item.engine for item in every_finding})
    for name in names:
        require_known("engine", name, owners, "there is no finding about it; choose")
    return [item for item in every_finding if not names or item.engine in names]


def read_finding(path: Path) -> EngineFinding:
    """Finding from its file: TOML between lines of +++, then text with one Python program.

    Raises:
        InputError: a part is missing or invalid.
    """
    parts = _FRONT.match(path.read_text(encoding="utf-8"))
    if parts is None:
        raise InputError(str(path), path.name, "it has to begin with TOML between two lines of +++")
    try:
        front = tomllib.loads(parts[1])
    except tomllib.TOMLDecodeError as error:
        raise InputError(str(path), path.name, f"its TOML cannot be read: {error}") from None
    programs = _PROGRAM.findall(parts[2])
    if len(programs) != 1:
        raise InputError(str(path), len(programs), "it has to hold one program, between ```python and ```")
    names = ("title", "engine", "package", "seen", "gone", "issue")
    for name in names:
        if not isinstance(front.get(name), str):
            raise InputError(f"{path}: {name}", front.get(name), "give a text; it may be empty")
    texts, kinds = {name: front[name] for name in names}, front.get("kinds", [])
    if not (isinstance(kinds, list) and all(isinstance(kind, str) for kind in kinds)):
        raise InputError(f"{path}: kinds", kinds, "give a list of texts, with * for any text")
    text = _PROGRAM.sub("", parts[2]).strip()
    return EngineFinding(name=path.stem, **texts, text=text, program=programs[0], kinds=tuple(kinds))


def run_findings(
    findings: Sequence[EngineFinding], python: str = "", time_limit: float = PROGRAM_TIME_LIMIT
) -> Iterator[Shown]:
    """Runs the program of each finding in a process of its own.

    Args:
        findings: to be run.
        python: path of another interpreter; by default this one.
        time_limit: of each program [s].

    Raises:
        Missing: there is no such interpreter.
    """
    interpreter = python or sys.executable
    try:
        versions = json.loads(_run([interpreter, "-c", _LOOK, *{item.package for item in findings}], time_limit)[1])
    except (OSError, ValueError):
        raise Missing(f"{interpreter} is no Python interpreter; give the path of one") from None
    for item in findings:
        if item.package not in versions:
            yield Shown(item, FindingState.NOT_INSTALLED, "", f"{item.package} is not installed")
            continue
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / f"{item.name}.py"
            file.write_text(item.program, encoding="utf-8")
            code, output = _run([interpreter, str(file)], time_limit, folder)
        state = {SHOWS: FindingState.SHOWS, 0: FindingState.GONE}.get(code, FindingState.BROKEN)
        yield Shown(item, state, versions[item.package], (output.strip().splitlines() or [""])[-1])


def _run(command: list[str], time_limit: float, folder: str | None = None) -> tuple[int, str]:
    """Exit code and output of a command, or standard error if it printed nothing else; it runs in ``folder``."""
    try:
        code, printed, errors = printed_by(command, safe_environment(), time_limit, folder)
    except subprocess.TimeoutExpired:
        return -1, f"it did not end within {time_limit:g} s"
    return code, printed.strip() or errors
