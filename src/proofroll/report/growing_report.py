"""A report while it grows: written after the comparisons, and again after each further study."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.core.errors import ProofrollError
from proofroll.files.json_data import plain
from proofroll.files.scene_file import load_scene
from proofroll.report.html import page
from proofroll.report.kinds import kind_of
from proofroll.report.plots import point_curves
from proofroll.report.replay import joined, replay_content
from proofroll.report.report_content import report_content
from proofroll.report.study_parts import Part, absent, attempt, entry
from proofroll.report.summary import three_sentences
from proofroll.running.store import Store, write_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from proofroll.studies.outcome import Outcome


@dataclass
class Report:
    """What the files are written from.

    Attributes:
        content: plain data, as :func:`proofroll.report.report_content.report_content` has it.
        curves: of each comparison, for the figures.
        pictures: markup by name.
        replay: of the comparisons, as their kind of element gives it.
        parts: the further studies, in the order of the content's lists.
    """

    content: dict[str, Any]
    curves: list[list[dict[str, Any]]]
    pictures: dict[str, str]
    replay: dict[str, Any]
    parts: list[Part] = field(default_factory=list)

    def expect(self, parts: Sequence[Part], out: Path, *, fresh: bool = False) -> list[Part]:
        """Lists further studies with what is kept of them.

        Args:
            parts: the studies.
            out: folder of all results.
            fresh: nothing that is kept counts.

        Returns:
            those that have to be made.
        """
        self.parts = sorted(parts, key=lambda part: part.order)
        missing = []
        for part in self.parts:
            said = attempt(part, partial(_kept, part, out)) if not fresh else None
            if said is None:
                missing.append(part)
                said = absent(part, "It has not been made yet")
            self._put(part, said)
        return missing

    def make(self, part: Part, how: Callable[[], None]) -> dict[str, Any]:
        """Makes a further study; whatever happens to it, its entry says."""

        def made() -> dict[str, Any]:
            how()
            return entry(part)

        said = attempt(part, made)
        assert said is not None  # it was made, or the entry says why not
        self._put(part, said)
        return said

    def write(self, out: Path) -> None:
        """Writes ``report.html`` and ``report.json``.

        Raises:
            ProofrollError: the folder cannot be written.
        """
        write_text(out / "report.json", json.dumps(self.content, indent=1, allow_nan=False) + "\n")
        write_text(out / "report.html", page(self.content, self.curves, self.pictures, self.replay))

    def _put(self, part: Part, said: dict[str, Any]) -> None:
        """Gives a part its place in the content, and its pictures theirs."""
        alike = [other for other in self.parts if other.key == part.key]
        entries, index = self.content[part.key], next(i for i, other in enumerate(alike) if other is part)
        entries[index : index + 1] = [plain(said)]
        self.content["findings"] = {"sentences": three_sentences(self.content)}
        self.content["environment"]["versions"] |= _versions(said["study"])
        if said["study"] is not None:
            prefix = f"{part.key}{index}-"
            self.pictures |= _drawn(prefix, lambda: part.pictures(prefix))


def begun(outcomes: list[Outcome], store: Store, command: str) -> Report:
    """A report of comparisons, to which further studies can be added.

    Args:
        outcomes: what was compared.
        store: where the trajectories are: a folder in that of the report.
        command: that makes the report again.
    """
    replay = _replay(outcomes, store)
    content = report_content(outcomes, store, command) | {"replay": _described(replay)}
    return Report(content, [point_curves(outcome, store) for outcome in outcomes], {}, replay)


def write_report(outcomes: list[Outcome], store: Store, out: Path, command: str) -> dict[str, Any]:
    """Writes ``report.html`` and ``report.json`` of comparisons alone.

    Args:
        outcomes: what was compared.
        store: where the trajectories are: a folder in that of the report.
        out: folder of the report.
        command: that makes the report again.

    Returns:
        the content of both files as plain data, as :func:`report_content` has it.

    Raises:
        ProofrollError: the folder cannot be written.
    """
    report = begun(outcomes, store, command)
    report.write(out)
    return report.content


def _replay(outcomes: list[Outcome], store: Store) -> dict[str, Any]:
    """The replay of the comparisons, one kind of scenes after the other."""
    kinds = {id(item): kind_of(load_scene(item.comparison.scene)) for item in outcomes}
    found = dict.fromkeys(kind for kind in kinds.values() if kind is not None)
    return joined(
        [replay_content([item for item in outcomes if kinds[id(item)] is kind], store, kind.replay()) for kind in found]
    )


def _described(replay: dict[str, Any]) -> list[dict[str, Any]]:
    """The cases without their numbers, for ``report.json``; these follow from the trajectories that it names."""
    return [{key: value for key, value in case.items() if key != "arrays"} for case in replay["cases"]]


def _kept(part: Part, out: Path) -> dict[str, Any] | None:
    return entry(part) if part.keeps(out) else None


def _drawn(prefix: str, draw: Callable[[], dict[str, str]]) -> dict[str, str]:
    """Pictures by prefix and name; where they cannot be drawn, under ``problem`` a sentence that says why."""
    try:
        return {f"{prefix}{name}": markup for name, markup in draw().items()}
    except ProofrollError as error:
        return {f"{prefix}problem": str(error)}


def _versions(study: Any) -> dict[str, str]:
    """The versions that a study knows of; of a kept one they are those of now."""
    if not study:
        return {}
    return dict(study.get("versions", {}))
