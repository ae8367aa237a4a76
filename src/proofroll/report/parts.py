"""The parts of a report besides the comparisons: each is a file of a study, what is known of it, and how to make it.

Kinds of parts are plug-ins, our own too: entry points of the group ``proofroll.report_parts``.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

from proofroll.core.announced import loaded
from proofroll.core.errors import ProofrollError, require_known
from proofroll.files.scene_sources import source_of
from proofroll.files.toml import named_file, read_toml, study_files
from proofroll.report.long_table import TableLine
from proofroll.running.runner import Runner

GROUP = "proofroll.report_parts"
Tell = Callable[[str, int], None]


@dataclass(frozen=True, kw_only=True)
class PartEntry:
    """Entry of a part in a report.

    Attributes:
        name, title, question, scene, command: as its ``head`` has them.
        missing: reason for which there is nothing, and the command that makes it; empty: there is something.
        study: its stored results, or None.
        contradictions: sentences about what was claimed and is not so.
        lost: sentences about engines without which it is not whole.
    """

    name: str
    title: str
    question: str
    scene: str
    command: str
    missing: str = ""
    study: Any = None
    contradictions: Sequence[str] = ()
    lost: Sequence[str] = ()


class Part(Protocol):
    """One further study of a report; its class is the plug-in.

    Attributes:
        kind: of the study, as its files have it: ``study = "…"``.
        key: under which the content lists it.
        order: place among the parts of a report, the smallest first.
        words: name of the part, for a person.
        command: of ``proofroll`` that makes it, with fields of ``asked`` as in ``stability {.scene}``.
        template: in the folder ``templates`` beside the class's module, with the macros
            ``section(entry, index, pictures, content)`` and ``link(entry, index, count)``; the latter for the contents.
        names: further names that the template uses; no other part has them.
        asked: content of its file.
        engines: to which it is restricted; none: all.
    """

    kind: ClassVar[str]
    key: ClassVar[str]
    order: ClassVar[float]
    words: ClassVar[str]
    command: ClassVar[str] = ""
    template: ClassVar[str]
    names: ClassVar[Mapping[str, Any]] = {}
    asked: Any
    engines: Sequence[str] = ()

    @classmethod
    def load(cls, path: Path, engines: Sequence[str]) -> Part:
        """The part that a file asks for, restricted to some engines. Raises InputError if the file is broken."""

    @staticmethod
    def line(entry: Any) -> str:
        """Result in one line, without its name and a full stop, for the terminal."""

    @property
    def on_request(self) -> bool:
        """True if a report without names leaves it out unless it is kept; as its file says."""
        return getattr(self.asked, "on_request", False)

    @property
    def head(self) -> dict[str, str]:
        """``name`` of the file, ``title``, ``question``, ``scene`` and the ``command`` that makes it."""
        words = "".join(f" --engine {shlex.quote(name)}" for name in self.engines)
        command = f"proofroll {self.command.format(self.asked)}{words}"
        return {key: getattr(self.asked, key) for key in ("name", "title", "question", "scene")} | {"command": command}

    def keeps(self, out: Path) -> bool:  # noqa: ARG002 -- for those that keep something
        """Takes what is kept under ``out`` and still holds; False: there is nothing."""
        return False

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """Runs the study with the least effort that gives a result."""

    def entry(self) -> PartEntry:
        """Entry of the part, with the further names of its template; only after it was made or taken."""

    def lines(self) -> Sequence[TableLine]:
        """Its runs in the long table; only after it was made or taken."""
        return ()

    def pictures(self, prefix: str) -> dict[str, str]:  # noqa: ARG002 -- for those that have any
        """Its pictures as markup, by name; every id in them begins with ``prefix``."""
        return {}


@cache
def part_kinds() -> tuple[type[Part], ...]:
    """All kinds of parts that installed packages announce, in the order of a report."""
    return tuple(sorted((kind for _, kind in loaded(GROUP, like=Part)), key=lambda kind: kind.order))


def parts_of(names: Sequence[str], engines: Sequence[str]) -> tuple[list[str], list[Part]]:
    """The names of comparisons, and the parts that other names stand for.

    Args:
        names: of comparisons, scenes and files for other studies, or paths, of robot files too.
        engines: to which studies are restricted.

    Raises:
        InputError: a file is broken, or asks for something that is no part of a report.
    """
    kinds = {kind.kind: kind for kind in part_kinds()}
    comparisons: list[str] = []
    parts: list[Part] = []
    for name in names:
        path = named_file(name) if source_of(name) is None else None
        study = None if path is None else read_toml(path).get("study")
        if path is None or study is None:
            comparisons.append(name)
        else:
            require_known(f"{name}: study", str(study), kinds, "a report has comparisons and")
            parts.append(kinds[study].load(path, engines))
    return comparisons, sorted(parts, key=lambda part: part.order)


def all_parts(engines: Sequence[str], out: Path) -> list[Part]:
    """Parts of all studies' files in the order of a report; parts on request only where ``out`` has their results."""
    parts = [kind.load(path, engines) for kind in part_kinds() for path, _ in study_files(kind.kind)]
    return [part for part in parts if not part.on_request or part.keeps(out)]


def attempt(part: Part, action: Callable[[], bool | None]) -> PartEntry | None:
    """The entry of a part on which something was done; None where that was False: there is nothing.

    Whatever happens in it, a report goes on: the entry then says what.
    """
    try:
        return None if action() is False else part.entry()
    except ProofrollError as error:
        return absent(part, str(error))
    except Exception as error:
        said = f"{type(error).__name__}: {error}".strip(": ")
        return absent(part, f"an error of proofroll's own, {said}")


def absent(part: Part, reason: str) -> PartEntry:
    """Entry of a missing part; one sentence gives the reason, and the command that makes it."""
    missing = f"{' '.join(reason.split()).rstrip('.')}; {part.head['command']} makes it."
    return PartEntry(**part.head, missing=missing)


def held(claims: Sequence[Any]) -> str:
    """Count of the decided claims that hold, and of the undecided ones; empty without claims."""
    if not claims:
        return ""
    verdicts = [claim.holds for claim in claims]
    undecided = f", {verdicts.count(None)} undecided" if None in verdicts else ""
    return f"; {verdicts.count(True)} of {len(verdicts) - verdicts.count(None)} claims hold{undecided}"
