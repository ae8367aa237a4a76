"""Matrix of engines and kinds of scenes: the cheapest run that holds a tolerance, or the reason why none does."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from itertools import groupby, product
from types import MappingProxyType
from typing import NamedTuple

from proofroll.core.verdict import Verdict
from proofroll.report.kinds import group_words
from proofroll.report.long_table import TableLine
from proofroll.report.page.candidates import Candidate, candidates
from proofroll.report.page.choice_cell import (
    CANNOT,
    NO_RUN,
    ORDER,
    PARTLY,
    TIE,
    ChoiceCell,
    cell_of,
    joined,
    of_cases,
    speeds,
)

# Tolerances that a reader can choose: negative powers of ten, relative to the path or the largest force.
DECADES = range(2, 9)
# The tolerance that a reader sees first, and for which sentences name a setting.
FIRST = 4
FIRST_TOLERANCE = 10.0**-FIRST
# All questions that a reader can ask: with forces or not, and the tolerance.
ASKED = [(forces, 10.0**-decade) for forces, decade in product((False, True), DECADES)]


# Group, name of a scene, and case in words.
CaseKey = tuple[str, str, str]


class ChoiceStudy(NamedTuple):
    """A study in the matrix.

    Attributes:
        title: of the study.
        href: HTML id of its evidence.
        runs: HTML ids of the evidence of its runs, by row and place.
        requires: capabilities that its scene requires of a formulation; None: not known.
        short: verdicts that a row expects, and why it does not hold in at most twelve words, by number of the row.
    """

    title: str
    href: str
    runs: Mapping[tuple[int, str], str] = MappingProxyType({})
    requires: frozenset[str] | None = None
    short: Mapping[int, tuple[Collection[str], str]] = MappingProxyType({})


@dataclass(frozen=True)
class ChoiceScene:
    """A scene with the studies about it; it counts once however many they are.

    Attributes:
        name: of the scene.
        studies: names of the studies.
        cases: their cases in words.
        own: the first with the scene's own parameters; None: no study has one.
    """

    name: str
    studies: tuple[str, ...]
    cases: tuple[str, ...]
    own: str | None

    @property
    def words(self) -> str:
        """Name for a reader."""
        return self.name.rpartition("/")[2].replace("_", " ")


@dataclass(frozen=True)
class ChoiceColumn:
    """Column of a kind of scenes (``whole``), or of one scene of it; ``title`` and ``meaning`` are for readers."""

    group: str
    title: str
    meaning: str
    href: str
    scenes: tuple[ChoiceScene, ...]
    whole: bool = True

    @property
    def studies(self) -> tuple[str, ...]:
        """Names of the studies about its scenes."""
        return tuple(name for scene in self.scenes for name in scene.studies)

    @property
    def name(self) -> str:
        """Name of the group or of the scene."""
        return self.group if self.whole else self.scenes[0].name

    @property
    def key(self) -> tuple[str, str, bool]:
        """Key that no other column has: one scene may be of two kinds, by its parameters."""
        return self.group, self.name, self.whole


@dataclass(frozen=True, eq=False)
class ChoiceRow:
    """Formulation with one setting, or with all (``setting`` is empty).

    ``found``, ``cases``: its candidates by study, over all points of it, and by case, of all studies.
    """

    engine: str
    formulation: str
    setting: str
    own_equations: bool
    found: dict[str, list[Candidate]] = field(default_factory=dict)
    cases: dict[CaseKey, list[Candidate]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Engine and formulation."""
        return f"{self.engine} {self.formulation}".strip()

    @property
    def is_model(self) -> bool:
        """True for an engine's own model with all its settings, False for equations derived for a scene."""
        return not self.setting and not self.own_equations


@dataclass(frozen=True)
class ChoiceMatrix:
    """Matrix of engines and scenes.

    Attributes:
        columns, rows: in the order of the studies.
        studies: by name.
        names: code name of an engine -> its name for readers.
        provides: engine -> formulation -> capabilities.
    """

    columns: list[ChoiceColumn]
    rows: list[ChoiceRow]
    studies: Mapping[str, ChoiceStudy]
    names: Mapping[str, str]
    provides: Mapping[str, Mapping[str, Collection[str]]]

    @property
    def titles(self) -> dict[str, str]:
        """Titles of studies, by name."""
        return {name: item.title for name, item in self.studies.items()}

    @property
    def kinds(self) -> list[ChoiceColumn]:
        """Columns of kinds of scenes."""
        return [column for column in self.columns if column.whole]

    @property
    def engines(self) -> list[str]:
        """Names of the engines: those that may be taken, then witnesses; each group sorted."""
        names = dict.fromkeys(row.engine for row in self.rows)
        return sorted(names, key=lambda name: (name in self.witnesses, self.title(name).lower()))

    @cached_property
    def witnesses(self) -> set[str]:
        """Engines that solve equations derived for a scene alone: they are never recommended."""
        return {row.engine for row in self.rows} - {row.engine for row in self.rows if row.is_model}

    def title(self, engine: str) -> str:
        """Name of an engine for a reader."""
        return self.names.get(engine.partition("@")[0], engine)

    @cached_property
    def cell(self) -> Callable[[ChoiceRow, ChoiceColumn, float, bool], ChoiceCell]:
        """Function (row, column, tolerance relative to the quantities' size, whether forces count) -> cell."""
        return cache(self._cell)

    def _cell(self, row: ChoiceRow, column: ChoiceColumn, tolerance: float, forces: bool) -> ChoiceCell:
        names = [name for name in column.studies if name in row.found]
        judged = [name for name in names if name not in self.unjudged[forces]]
        if names and not judged:
            what = "no forces" if forces else "no motion"
            return ChoiceCell(Verdict.NOT_JUDGED, what, f"{what} judged here", why=f"{what} judged")
        scenes = {
            scene.name: cell
            for scene in column.scenes
            if not self.unjudged[forces].issuperset(scene.studies)
            and (cell := self._of_scene(row, column.group, scene, tolerance, forces)) is not None
        }
        if not scenes:
            return self._without_run(row, column)
        # A scene without any judgement, say for lack of time, does not count against the scenes that ran.
        ran = {name: cell for name, cell in scenes.items() if cell.state != Verdict.NOT_JUDGED}
        lacking = [
            scene
            for scene in column.scenes
            if self.judged[forces].intersection(scene.studies) and scene.name not in ran
        ]
        words = {scene.name: scene.words for scene in column.scenes}
        return joined(ran or scenes, words)._replace(scenes=len(ran or scenes), lacking=len(lacking))

    def _of_scene(
        self, row: ChoiceRow, group: str, scene: ChoiceScene, tolerance: float, forces: bool
    ) -> ChoiceCell | None:
        """Cell of a scene: per case the cheapest run of all studies that holds; None without a run."""
        cases = [case for case in scene.cases if (group, scene.name, case) in self.judged_cases[forces]]
        keys = [(group, scene.name, case) for case in cases or scene.cases]
        candidates_of = {key[-1]: row.cases[key] for key in keys if key in row.cases}
        ran = {
            case: items for case, items in candidates_of.items() if any(x.blame != Verdict.NOT_JUDGED for x in items)
        }
        cells = {case: cell_of(items, tolerance, forces) for case, items in (ran or candidates_of).items()}
        # A case that was left out for lack of time counts against nobody.
        count = len(cases) - len(candidates_of.keys() - ran.keys()) if ran and cases else len(cells)
        return of_cases(cells, scene.own, count) if cells else None

    def _without_run(self, row: ChoiceRow, column: ChoiceColumn) -> ChoiceCell:
        """Cell without a run: the formulation cannot represent the scenes, or was not tried."""
        provided = self.provides.get(row.engine, {}).get(row.formulation)
        needs = [need for name in column.studies if (need := self.studies[name].requires) is not None]
        if provided is None or not needs:
            return ChoiceCell(NO_RUN, "", "was not run in this report")
        lacking = [sorted(need - set(provided)) for need in needs]
        if not all(lacking):
            return ChoiceCell(NO_RUN, "", "could represent this, but was not run in this report")
        named = " and ".join(f"“{word}”" for word in min(lacking, key=len))
        return ChoiceCell(CANNOT, "", f"cannot represent this: it lacks {named}")

    @cached_property
    def held(self) -> Callable[[str, str, str, float, bool], bool]:
        """Function (engine, formulation, study, tolerance, whether forces count) -> True if a setting of it holds."""
        return cache(self._held)

    def _held(self, engine: str, formulation: str, study: str, tolerance: float, forces: bool) -> bool:
        settings = [row for row in self.rows if row.setting and (row.engine, row.formulation) == (engine, formulation)]
        return any(cell_of(row.found[study], tolerance, forces).holds for row in settings if study in row.found)

    @cached_property
    def judged(self) -> tuple[set[str], set[str]]:
        """Studies in which motion is judged, and those in which forces are judged, too."""
        items = [(name, item) for row in self.rows for name, of_study in row.found.items() for item in of_study]
        motion = {name for name, item in items if item.motion is not None}
        return motion, motion & {name for name, item in items if item.forces is not None}

    @cached_property
    def unjudged(self) -> tuple[set[str], set[str]]:
        """Studies that ran without judged motion, and those that lack judged motion or forces."""
        pairs = [(name, of_study) for row in self.rows for name, of_study in row.found.items()]
        ran = {name for name, of_study in pairs if any(item.blame is None for item in of_study)}
        return ran - self.judged[False], ran - self.judged[True]

    @cached_property
    def judged_cases(self) -> tuple[set[CaseKey], set[CaseKey]]:
        """Cases in which motion is judged, and those in which forces are judged, too."""
        items = [(case, item) for row in self.rows for case, of_case in row.cases.items() for item in of_case]
        motion = {case for case, item in items if item.motion is not None}
        return motion, motion & {case for case, item in items if item.forces is not None}

    @property
    def models(self) -> list[ChoiceRow]:
        """Rows for which :attr:`ChoiceRow.is_model` is true."""
        return [row for row in self.rows if row.is_model]

    def formulations(self, engine: str) -> list[ChoiceRow]:
        """Rows of an engine with all settings of a formulation; equations derived for a scene only of a witness."""
        witness = engine in self.witnesses
        return [row for row in self.rows if row.engine == engine and not row.setting and (witness or row.is_model)]

    @cached_property
    def standing(self) -> Callable[[str, ChoiceColumn, float, bool], ChoiceCell]:
        """Function (engine, column, tolerance, whether forces count) -> cell of the engine in the column.

        Each scene has the engine's best formulation there; a kind has the range of their speeds.
        """
        return cache(self._standing)

    def _standing(self, engine: str, column: ChoiceColumn, tolerance: float, forces: bool) -> ChoiceCell:
        single = [item for item in self.columns if not item.whole and item.group == column.group]
        if not column.whole or len(column.scenes) == 1 or len(single) < len(column.scenes):
            of_rows = [
                self.cell(row, column, tolerance, forces)._replace(engine=engine, formulation=row.formulation)
                for row in self.formulations(engine)
            ]
            return min(of_rows, key=lambda item: item.rank)
        by_scene = [self.standing(engine, item, tolerance, forces) for item in single]
        ran = [item for item in by_scene if item.state not in {NO_RUN, CANNOT, Verdict.NOT_JUDGED}]
        if not ran:
            return by_scene[0]._replace(by_scene=tuple(by_scene))
        judged = [bool(self.judged[forces].intersection(item.studies)) for item in single]
        lacks = [known and cell.state in {NO_RUN, CANNOT} for cell, known in zip(by_scene, judged, strict=True)]
        count, held = len(ran) + sum(lacks), [item for item in ran if item.holds]
        titles = [f"{item.title}: {cell.title}" for item, cell in zip(single, by_scene, strict=True)]
        slowest = max(held, key=lambda item: item.cost, default=by_scene[0])
        joint = slowest._replace(
            title="; ".join(titles),
            name=slowest.name if len({item.name for item in ran}) == 1 else "",
            formulation=", ".join(dict.fromkeys(item.formulation for item in held or ran)),
            open=any(item.open for item in held),
            scenes=count,
            lacking=sum(judged) - count,
            by_scene=tuple(by_scene),
        )
        if len(held) == count:
            return joint._replace(text=speeds(held))
        state = PARTLY if held else max((item.state for item in ran), key=ORDER.index)
        text = f"{len(held)} of {count}"
        return joint._replace(state=state, text=text, why=f"holds {text} scenes")

    def standings(
        self, column: ChoiceColumn, tolerance: float, forces: bool, engines: Collection[str] | None = None
    ) -> list[ChoiceCell]:
        """Cells of the engines that may be taken, the best first; ``engines``: of these alone.

        Of several scenes the best engine is near the cheapest, within the factor :data:`TIE`, in most; then it holds
        most.
        """
        names = [name for name in self.engines if name not in self.witnesses and (engines is None or name in engines)]
        cells = [self.standing(name, column, tolerance, forces) for name in names]
        scenes = zip(*(cell.each for cell in cells), strict=True)
        least = [min((cell.cost for cell in scene if cell.holds), default=0.0) for scene in scenes]

        def near(cell: ChoiceCell) -> int:
            pairs = zip(cell.each, least, strict=True)
            return sum(item.holds and item.cost <= TIE * cost for item, cost in pairs)

        return sorted(cells, key=lambda item: (-near(item), -item.held, item.rank))


def choice_matrix(
    lines: Iterable[TableLine],
    studies: Mapping[str, ChoiceStudy],
    names: Mapping[str, str] = MappingProxyType({}),
    provides: Mapping[str, Mapping[str, Collection[str]]] = MappingProxyType({}),
) -> ChoiceMatrix:
    """Matrix of the lines of some studies, in their order; rows by engine and formulation as the studies have them.

    ``names`` and ``provides``: see :class:`ChoiceMatrix`.
    """
    order = {name: number for number, name in enumerate(studies)}
    chosen = sorted((line for line in lines if line.study in order), key=lambda x: (order[x.study], x.row, x.engine))
    rows: dict[tuple[str, str, str], ChoiceRow] = {}
    groups: dict[str, dict[str, dict[str, None]]] = {}
    cases: dict[tuple[str, str], dict[str, bool]] = {}
    derived = {(line.engine, line.formulation) for line in chosen if line.own_equations}
    for (name, _, _), group_lines in groupby(chosen, key=lambda x: (x.study, x.row, x.engine)):
        of_row, study = list(group_lines), studies[name]
        row_line, steps = of_row[0], candidates(of_row, study.href, study.runs)
        groups.setdefault(row_line.group, {}).setdefault(row_line.scene, {})[name] = None
        by_case: dict[str, list[TableLine]] = {}
        for item in of_row:
            by_case.setdefault(item.timed_case, []).append(item)
            cases.setdefault((item.group, item.scene), {})[item.timed_case] = item.own_case
        steps_of_case = {case: candidates(items, study.href, study.runs) for case, items in by_case.items()}
        for setting in ("", row_line.setting or "as it is"):
            key = (row_line.engine, row_line.formulation, setting)
            row = rows.setdefault(key, ChoiceRow(*key, own_equations=key[:2] in derived))
            row.found.setdefault(name, []).extend(steps)
            for case, case_steps in steps_of_case.items():
                row.cases.setdefault((row_line.group, row_line.scene, case), []).extend(case_steps)
    columns = []
    for group, studies_of in groups.items():
        scenes = tuple(_scene(name, of_scene, [*cases[group, name].items()]) for name, of_scene in studies_of.items())
        title, meaning = group_words(group)
        whole = ChoiceColumn(group=group, title=title, meaning=meaning, href="", scenes=scenes)
        single = []
        for scene in scenes:
            about = studies[scene.studies[0]]
            single.append(
                ChoiceColumn(
                    group=group, title=scene.words, meaning=about.title, href=about.href, scenes=(scene,), whole=False
                )
            )
        columns += [replace(whole, href=single[0].href if len(single) == 1 else ""), *single]
    orders = [list(dict.fromkeys(key[:end] for key in rows)) for end in (1, 2, 3)]
    keys = sorted(rows, key=lambda key: [order_of.index(key[: end + 1]) for end, order_of in enumerate(orders)])
    return ChoiceMatrix(
        columns=columns, rows=[rows[key] for key in keys], studies=dict(studies), names=names, provides=provides
    )


def _scene(name: str, studies: Iterable[str], cases: Sequence[tuple[str, bool]]) -> ChoiceScene:
    """A scene with its studies; ``cases``: each with True if it has the scene's own parameters."""
    own_case = next((case for case, is_own in cases if is_own), None)
    return ChoiceScene(name, tuple(studies), tuple(case for case, _ in cases), own_case)
