"""Parts of a report besides the comparisons: file of a study, its stored results, and the run that makes them.

Kinds of parts are plug-ins, our own too: entry points of the group ``proofroll.report_parts``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, Protocol

from proofroll.core.entry_points import loaded
from proofroll.core.errors import ProofrollError, require_known
from proofroll.files.scene_sources import command_line, source_of
from proofroll.files.toml import named_file, read_toml, study_files
from proofroll.report.pages import section_id
from proofroll.running.runner import Runner

GROUP = "proofroll.report_parts"
Tell = Callable[[str, int], None]


@dataclass(frozen=True, kw_only=True)
class PartEntry:
    """Entry of a part in a report.

    Attributes:
        name, title, question, scene, command: as in its ``head``.
        missing: reason why there are no results, and the command that makes them; empty: there are.
        study: its stored results, or None.
        contradictions: sentences on claims that do not hold.
        lost: sentences on missing engines, without which the study is incomplete.
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

    @property
    def section(self) -> str:
        """HTML id of its section of a page."""
        return section_id("study", self.name)


class Part(Protocol):
    """One further study of a report; its class is the plug-in.

    Attributes:
        kind: of the study, as its files have it: ``study = "…"``.
        key: name of its list in the content of a report.
        order: position among the parts of a report, the smallest first.
        words: name of the part, for a person.
        command: words behind ``proofroll`` that make it, as ``paper regimes``.
        named: name or path of the study, as a person gave it.
        out: folder of its results.
        template: in the folder ``templates`` beside the class's module, with the macro
            ``section(entry, index, pictures, content)``.
        names: additional names for the template; they must differ from those of other parts.
        asked: content of its file.
        engines: engines that the study is restricted to; empty: all.
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
    named: str = ""
    out: Path = Path("out")

    @classmethod
    def load(cls, path: Path, engines: Sequence[str]) -> Part:
        """Part from a study's file, restricted to some engines. Raises InputError if the file is broken."""

    @staticmethod
    def line(entry: Any) -> str:
        """Result of an entry in one line for the terminal, without name and full stop."""

    @property
    def on_request(self) -> bool:
        """True if a report of all studies has the part only if its results are stored; set in the study's file."""
        return getattr(self.asked, "on_request", False)

    @property
    def head(self) -> dict[str, str]:
        """``name`` of the file, ``title``, ``question``, ``scene`` and the ``command`` that makes it."""
        command = command_line(*self.command.split(), self.named, engine=[*self.engines], out=self.out)
        return {key: getattr(self.asked, key) for key in ("name", "title", "question", "scene")} | {"command": command}

    def keeps(self, out: Path) -> bool:  # noqa: ARG002 -- for those that keep something
        """True if results under ``out`` are stored and still valid; the part then holds them."""
        return False

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """Runs the study with the least effort that gives a result."""

    def entry(self) -> PartEntry:
        """Entry of the part, with the additional names of its template; only after :meth:`make` or :meth:`keeps`."""

    def pictures(self, prefix: str) -> dict[str, str]:  # noqa: ARG002 -- for those that have any
        """Pictures as markup, by name; every id in them begins with ``prefix``."""
        return {}


@cache
def part_kinds() -> tuple[type[Part], ...]:
    """Kinds of parts that installed packages announce, in the order of a report."""
    return tuple(sorted((kind for _, kind in loaded(GROUP, like=Part)), key=lambda kind: kind.order))


def _loaded(kind: type[Part], path: Path, name: str, engines: Sequence[str], out: Path) -> Part:
    """Part from a study's file, with the name or path of the study and the folder of its results."""
    part = kind.load(path, engines)
    part.named, part.out = name, out
    return part


def parts_of(names: Sequence[str], engines: Sequence[str], out: Path) -> tuple[list[str], list[Part]]:
    """Names of comparisons, and parts for the other names.

    Args:
        names: of comparisons, scenes and files for other studies, or paths, of robot files too.
        engines: engines that studies are restricted to.
        out: folder of results.

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
            parts.append(_loaded(kinds[study], path, name, engines, out))
    return comparisons, sorted(parts, key=lambda part: part.order)


def all_parts(engines: Sequence[str], out: Path) -> list[Part]:
    """Parts of all studies' files in the order of a report; those on request only if ``out`` has their results."""
    files = ((kind, path) for kind in part_kinds() for path, _ in study_files(kind.kind))
    parts = [_loaded(kind, path, path.stem, engines, out) for kind, path in files]
    return [part for part in parts if not part.on_request or part.keeps(out)]


def attempt(part: Part, action: Callable[[], bool | None]) -> PartEntry | None:
    """Entry of a part after an action on it; None if the action returned False, for lack of results.

    A failure of any kind becomes an entry with its reason, so that the report goes on.
    """
    try:
        return None if action() is False else part.entry()
    except ProofrollError as error:
        return absent(part, str(error))
    except Exception as error:
        reason = f"{type(error).__name__}: {error}".strip(": ")
        return absent(part, f"an error of proofroll's own, {reason}")


def absent(part: Part, reason: str) -> PartEntry:
    """Entry of a missing part; one sentence gives the reason and the command that makes it."""
    missing = f"{' '.join(reason.split()).rstrip('.')}; {part.head['command']} makes it."
    return PartEntry(**part.head, missing=missing)


def claims_sentence(claims: Sequence[Any]) -> str:
    """Count of the decided claims that hold, and of the undecided ones; empty without claims."""
    if not claims:
        return ""
    verdicts = [claim.holds for claim in claims]
    undecided = f", {verdicts.count(None)} undecided" if None in verdicts else ""
    return f"; {verdicts.count(True)} of {len(verdicts) - verdicts.count(None)} claims hold{undecided}"
