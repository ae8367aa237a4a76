"""The first screen: engines to take by scene and tolerance, and what was found of every engine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from proofroll.report.answer.sentences import (
    brought_words,
    error_words,
    installed_words,
    parameter_words,
    reason,
    setting_words,
    speed,
    tolerance_words,
)
from proofroll.report.kinds import group_words
from proofroll.report.labels import engine_title, scene_words
from proofroll.report.parts import Part, PartEntry, part_kinds
from proofroll.report.pen import Disc, Lettering, Picture, Polyline
from proofroll.studies.answer.records import EngineAnswer, SceneAnswer
from proofroll.studies.answer.setting_search import BRIEF, State

if TYPE_CHECKING:
    from proofroll.report.page.records import ReportContent

# Fastest speed of the bars.
FASTEST = 3000.0
# Looks of marks that a small picture leaves out: arrows of gravity and of forces.
_NOT_SMALL = ("force", "force-head", "axis")
_STATES = ("holds", "unsure", "finer", "elsewhere", "cannot", "open")
_LOOKS = {
    State.HOLDS: "holds",
    State.UNCONFIRMED: "unsure",
    State.FINER: "finer",
    State.ELSEWHERE: "elsewhere",
    State.REFUSED: "cannot",
    State.CANNOT: "cannot",
}


class Chip(NamedTuple):
    """Engine with the scenes that it wins; ``hollow``: through a part of proofroll; no engine: where none is shown."""

    engine: str
    title: str
    words: str
    hollow: bool = False


class Counts(NamedTuple):
    """Number of pairs of an engine and a scene by what was found, and of scenes by what is advised.

    ``alone``: an engine without a part of proofroll; ``aided``: one with such a part; ``doubtful``: of both, how many
    have an unconfirmed one that may be faster.
    """

    states: dict[str, int]
    scenes: int
    alone: int
    aided: int
    doubtful: int


@dataclass(frozen=True)
class FirstScreen:
    """Content of the first screen, from a report's answers."""

    content: ReportContent

    @cached_property
    def tolerances(self) -> list[str]:
        """Tolerances that a reader can choose, the first one first."""
        return list(dict.fromkeys(item.answer.tolerance for item in self.content.answers))

    def answers(self, tolerance: str) -> list[ReportedAnswer]:
        """Answers for a tolerance, in the order of the comparisons."""
        return [item for item in self.content.answers if item.answer.tolerance == tolerance]

    def groups(self, tolerance: str) -> dict[str, list[ReportedAnswer]]:
        """Kind of scenes, in words -> answers for a tolerance."""
        groups: dict[str, list[ReportedAnswer]] = {}
        for item in self.answers(tolerance):
            groups.setdefault(group_words(item.group)[0], []).append(item)
        return groups

    def words(self, tolerance: str) -> str:
        """A tolerance for a reader."""
        return tolerance_words(self.answers(tolerance)[0].answer)

    def chips(self, tolerance: str) -> list[Chip]:
        """Engines by the scenes that they win, those with the most first; then the scenes that none is shown to hold.

        An engine that wins through a part of proofroll has a chip of its own.
        """
        won: dict[tuple[str, bool], list[str]] = {}
        nobody = []
        for item in self.answers(tolerance):
            confirmed = item.answer.confirmed
            if confirmed is None:
                nobody.append(item.words)
            else:
                won.setdefault((confirmed.engine, bool(confirmed.brought)), []).append(item.words)
        chips = []
        for (engine, hollow), names in sorted(won.items(), key=lambda pair: (pair[0][1], -len(pair[1]))):
            through = " through a part of proofroll" if hollow else ""
            chips.append(Chip(engine, f"{engine_title(engine)}{through}", f"for {', '.join(names)}", hollow))
        return chips + ([Chip("", "None confirmed", f"for {', '.join(nobody)}")] if nobody else [])

    def counts(self, tolerance: str) -> Counts:
        """Counts over all engines and scenes."""
        answers = [item.answer for item in self.answers(tolerance)]
        looks = [_LOOKS.get(engine.state, "open") for made in answers for engine in made.engines]
        brought = [bool(made.confirmed.brought) for made in answers if made.confirmed is not None]
        states = {name: looks.count(name) for name in _STATES}
        doubtful = sum(made.perhaps_faster is not None for made in answers)
        alone, aided = brought.count(False), brought.count(True)
        return Counts(states=states, scenes=len(answers), alone=alone, aided=aided, doubtful=doubtful)

    @property
    def chapters(self) -> dict[str, list[tuple[type[Part], PartEntry, int]]]:
        """Further studies of each scene: their kind, their entry, and its number among those of the kind."""
        chapters: dict[str, list[tuple[type[Part], PartEntry, int]]] = {}
        for kind in part_kinds():
            for index, entry in enumerate(self.content.entries[kind.key]):
                chapters.setdefault(entry.scene, []).append((kind, entry, index))
        return chapters

    @property
    def kinds(self) -> dict[str, str]:
        """Title of each kind of scenes -> HTML id of the verdicts of its first comparison."""
        kinds: dict[str, str] = {}
        for item in self.content.comparisons:
            kinds.setdefault(group_words(item.group)[0], item.name)
        return kinds

    @cached_property
    def pictures(self) -> dict[str, Picture]:
        """Small picture of each scene that is drawn, by its name."""
        return {name: small(sheet.drawings[0]) for name, sheet in self.content.sheets.items() if sheet.drawings}


@dataclass(frozen=True)
class ReportedAnswer:
    """An answer with its place in the report.

    Attributes:
        answer: of all engines.
        study: name of the comparison that has the scene.
        group: kind of the scene.
        sentence: its first sentence.
    """

    answer: SceneAnswer
    study: str
    group: str
    sentence: str

    @property
    def words(self) -> str:
        """Scene, with the comparison of it if that has another name, for a reader."""
        scene, study = scene_words(self.answer.scene).lower(), self.study.replace("_", " ")
        return scene if self.study == self.answer.scene else f"{scene} ({study})"


def place_words(made: SceneAnswer) -> str:
    """Length of the runs, and the parameters that differ from the scene's own, for a reader."""
    return ", ".join([f"over {made.until:g} s", *parameter_words(made)])


def how(item: EngineAnswer) -> str:
    """Setting and step of an engine that holds, with the part that is not its own; or why none is shown to hold."""
    name = setting_words(item).removeprefix(f"{engine_title(item.engine)} ")
    if not item.holds:
        told = reason(item).partition("; ")[2]
        return f"{name}: {told}" if item.spec and told else told
    error = error_words(item.bound, item.error) if item.bound is not None and item.error is not None else ""
    unsure = f"not confirmed: {item.why}" if item.state is State.UNCONFIRMED else ""
    return "; ".join(filter(None, (name, error, brought_words(item), unsure, installed_words(item))))


def caps_words() -> str:
    """Sentences on what a report's searches are asked, and how to ask for more."""
    limits = f"at most {BRIEF.run:g} s of processor time a run and {BRIEF.engine:g} s an engine"
    return f"Searched once for each scene of a kind, {limits}; proofroll recommend SCENE searches longer."


def figure_of(item: EngineAnswer) -> str:
    """Speed of an engine that holds, with ○ if that is not confirmed; or its state in a word."""
    if not item.holds:
        return f"· {item.state}" if item.state is not State.FINER else "· finer not run"
    return f"{'○ ' if item.state is State.UNCONFIRMED else ''}{speed(item.seconds_per_second)}"


def bar(item: EngineAnswer) -> int:
    """Length of the bar of a speed [%], logarithmic from 1× to 3000× real time; 0 where the tolerance is not held."""
    if not item.holds or not item.seconds_per_second:
        return 0
    part = math.log(max(1.0, 1 / item.seconds_per_second)) / math.log(FASTEST)
    return round(100 * min(1.0, max(0.02, part)))


def answers_sentence(answers: Sequence[ReportedAnswer]) -> str:
    """The answers to the first tolerance as one sentence."""
    if not answers:
        return "Nothing was run that could be advised."
    of_first = [item for item in answers if item.answer.tolerance == answers[0].answer.tolerance]
    won: dict[str, list[str]] = {}
    for item in of_first:
        confirmed = item.answer.confirmed
        won.setdefault(engine_title(confirmed.engine) if confirmed else "none", []).append(item.words)
    clauses = "; ".join(f"{title} for {', '.join(names)}" for title, names in won.items())
    return f"The fastest confirmed to hold {tolerance_words(of_first[0].answer)}: {clauses}."


def small(picture: Picture) -> Picture:
    """Picture without letters and forces, its box cut to what is left."""
    marks: list[Polyline | Disc] = [
        mark for mark in picture.marks if not isinstance(mark, Lettering) and mark.look not in _NOT_SMALL
    ]
    places = [point for mark in marks for point in _corners(mark)]
    if not places:
        return picture
    xs, ys = zip(*places, strict=True)
    box = [min(xs) - 2, min(ys) - 2, max(xs) - min(xs) + 4, max(ys) - min(ys) + 4]
    return Picture([round(value, 1) for value in box], [*marks], picture.label)


def _corners(mark: Polyline | Disc) -> list[list[float]]:
    if isinstance(mark, Polyline):
        return mark.points
    (x, y), r = mark.centre, mark.radius
    return [[x - r, y - r], [x + r, y + r]]
