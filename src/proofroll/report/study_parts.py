"""The parts of a report besides the comparisons: each is a file of a study, what is known of it, and how to make it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from proofroll.core.errors import InputError, ProofrollError
from proofroll.files.data_folders import data_folder
from proofroll.files.toml import read_toml, study_files

if TYPE_CHECKING:
    from proofroll.running.runner import Runner

Tell = Callable[[str, int], None]


class Part(Protocol):
    """One further study of a report."""

    key: ClassVar[str]
    """Under which the content lists it."""
    words: ClassVar[str]
    """What is made, for a person."""

    @property
    def on_request(self) -> bool:
        """Whether a report of everything leaves it out unless it is kept."""

    @property
    def head(self) -> dict[str, str]:
        """``name`` of the file, ``title``, ``question``, ``scene`` and the ``command`` that makes it."""

    def keeps(self, out: Path) -> bool:
        """Takes what is kept under ``out`` and still holds; False: there is nothing."""

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """Makes it, with the least effort that says something."""

    def content(self) -> dict[str, Any]:
        """What is known, as plain data; only after it was made or taken."""

    def pictures(self, prefix: str) -> dict[str, str]:
        """Its pictures as markup, by name; every id in them begins with ``prefix``."""


def parts_of(names: Sequence[str], engines: Sequence[str]) -> tuple[list[str], list[Part]]:
    """The names of comparisons, and the parts that other names stand for.

    Args:
        names: of comparisons and of files for other studies, or paths.
        engines: to which studies are restricted.

    Raises:
        InputError: a file is broken, or asks for something that is no part of a report.
    """
    comparisons: list[str] = []
    found: list[Part] = []
    for name in names:
        places = (Path(name), data_folder("comparisons") / f"{name}.toml", data_folder("comparisons") / name)
        path = next((place for place in places if place.is_file()), None)
        study = None if path is None else read_toml(path).get("study")
        if path is None or study is None:
            comparisons.append(name)
        elif study in _LOADERS:
            found.append(_LOADERS[study](path, engines))
        else:
            raise InputError(name, f"study = {study!r}", f"a report has {', '.join(_LOADERS)}, and comparisons")
    return comparisons, sorted(found, key=lambda part: KEYS.index(part.key))


def all_parts(engines: Sequence[str], out: Path) -> list[Part]:
    """The parts that the files under ``comparisons/`` ask for, in the order of a report.

    Args:
        engines: to which studies are restricted.
        out: folder of all results; what is made on request is a part where it is kept there.
    """
    found = [load(path, engines) for study, load in _LOADERS.items() for path, _ in study_files(study)]
    return [part for part in found if not part.on_request or part.keeps(out)]


def _figures(path: Path, engines: Sequence[str]) -> Part:  # noqa: ARG001 -- the figures name their own engine
    from proofroll.figures.reading import load_figures
    from proofroll.report.figures_part import FiguresPart

    return FiguresPart(load_figures(str(path)))


def _tradeoff(path: Path, engines: Sequence[str]) -> Part:
    from proofroll.report.tradeoff_part import TradeoffPart
    from proofroll.studies.claims import load_claims

    return TradeoffPart(load_claims(path), tuple(engines))


def _stability(path: Path, engines: Sequence[str]) -> Part:
    from proofroll.report.stability_part import StabilityPart
    from proofroll.studies.stability_claims import file_for

    return StabilityPart(file_for(str(path)), tuple(engines))


_LOADERS: dict[str, Callable[[Path, Sequence[str]], Part]] = {
    "figures": _figures,
    "tradeoff": _tradeoff,
    "stability": _stability,
}
# How the content lists the parts, in the order in which they are made and shown.
KEYS = ("figures", "tradeoffs", "stability")


def attempt(part: Part, action: Callable[[], dict[str, Any] | None]) -> dict[str, Any] | None:
    """What an action on a part gives; whatever happens in it, a report goes on: the entry then says what.

    Args:
        part: the action is on.
        action: gives the part's entry, or None.
    """
    try:
        return action()
    except ProofrollError as error:
        return absent(part, str(error))
    except Exception as error:
        said = f"{type(error).__name__}: {error}".strip(": ")
        return absent(part, f"an error of proofroll's own, {said}")


def entry(part: Part) -> dict[str, Any]:
    """What the content lists of a part that was made."""
    return {**part.head, "missing": "", "study": None, **part.content()}


def absent(part: Part, reason: str) -> dict[str, Any]:
    """What the content lists of a part that there is not; one sentence says why, and how to get it."""
    missing = f"{' '.join(reason.split()).rstrip('.')}; {part.head['command']} makes it."
    return {**part.head, "missing": missing, "study": None, "contradictions": [], "lost": []}
