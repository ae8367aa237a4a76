"""Reads the files that define figures and what an article states about them: ``study = "figures"``."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, TypeAdapter, ValidationError

from proofroll.comparison_file import load_comparison
from proofroll.errors import InputError
from proofroll.figures.measures import Measure
from proofroll.figures.quantities import ANGLES, TIME, known
from proofroll.folders import data_folder
from proofroll.recording import time_grid
from proofroll.scene_file import first_problem, load_scene

STUDY = "figures"
CRITERIA = ("stated", "at_most", "below", "above", "order", "events")


@dataclass(frozen=True)
class Planned:
    """A run that figures and statements refer to.

    Attributes:
        label: for a legend; mathematics between dollar signs.
        parameters: of the scene.
    """

    label: str
    parameters: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Level:
    """A horizontal line.

    Attributes:
        value: where, in the panel's unit.
        label: beside it.
    """

    value: float
    label: str


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes:
        y: quantities that are drawn.
        runs: names of the runs that are drawn.
        x: quantity against which; time by default.
        title: for a person.
        label: of the ordinate instead of all symbols; mathematics between dollar signs.
        equal: one scale for both axes.
        zero: the ordinate begins at zero.
        share: panels with the same text share the range of y.
        levels: horizontal lines.
        events: mark what happened in the first run.
        truth: also draw the truth's samples.
    """

    y: list[str]
    runs: list[str]
    x: str = TIME
    title: str = ""
    label: str = ""
    equal: bool = False
    zero: bool = False
    share: str = ""
    levels: list[Level] = field(default_factory=list)
    events: bool = False
    truth: bool = True


@dataclass(frozen=True)
class Figure:
    """One figure: panels of runs, or the regime maps of a comparison.

    Attributes:
        name: of its file, without ending.
        caption: for a person.
        panels: in reading order.
        columns: of panels.
        height: of a row of panels [inch].
        until: what is drawn [s]; everything by default.
        regimes: name of the comparison whose regime maps it shows, instead of panels.
    """

    name: str
    caption: str
    panels: list[Panel] = field(default_factory=list)
    columns: int = 2
    height: float = 1.9
    until: float | None = None
    regimes: str = ""


@dataclass(frozen=True)
class Statement:
    """What an article, or this project, says about runs: one quantity, one measure of it, and one criterion.

    Attributes:
        says: for a person.
        source: where it is said.
        runs: each must fulfil it by itself; with ``order`` they are held against each other.
        of: quantity; not for ``events``.
        measure: of the quantity; ``every`` means all its samples.
        stated: a number with the digits that the source gives; what is found must round to it.
        at_most, below, above: bounds, in the unit of the measure.
        because: why this bound, where the source gives no number.
        order: of the measures from the first run to the last.
        events: kinds of the events of the run, in order.
        event: number of the event whose time [s] is ``stated``, from 0, instead of a measure.
        until: only what is before counts [s].
    """

    says: str
    source: str
    runs: list[str]
    of: str = ""
    measure: Measure | Literal["every", ""] = ""
    stated: str = ""
    at_most: float | None = None
    below: float | None = None
    above: float | None = None
    because: str = ""
    order: Literal["rising", "falling", ""] = ""
    events: list[str] = field(default_factory=list)
    event: int | None = None
    until: float | None = None

    @property
    def criteria(self) -> list[str]:
        """Names of the criteria that are given; exactly one, once the file has been checked."""
        return [name for name in CRITERIA if getattr(self, name) not in (None, "", [])]


@dataclass(frozen=True)
class Figures:
    """A file.

    Attributes:
        name: of the file, without ending.
        title, source: for a person; the article.
        scene: of every run.
        engine: that draws the figures unless the user names another, ``name[key=value,…]``.
        until, every: last time and sampling interval of every run [s].
        start_angles: Euler angles φ, θ, ψ of the body's axes at time 0 [rad].
        symbols: quantity -> symbol of the article, as TeX mathematics.
        runs: by name.
        figures: in the order of the article.
        statements: what is checked.
        time_limit: wall seconds a run may take [s].
    """

    name: str
    title: str
    source: str
    scene: str
    engine: str
    until: float
    every: float
    runs: dict[str, Planned]
    figures: list[Figure]
    statements: list[Statement] = field(default_factory=list)
    symbols: dict[str, str] = field(default_factory=dict)
    start_angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_limit: float = 120.0

    @property
    def wants_orientation(self) -> bool:
        """Whether anything asks for the Euler angles."""
        drawn = {name for figure in self.figures for panel in figure.panels for name in (panel.x, *panel.y)}
        return bool((drawn | {item.of for item in self.statements}) & set(ANGLES))


def load_figures(name: str) -> Figures:
    """Reads a file.

    Args:
        name: path of a file, the name of one under ``comparisons/``, or the name of a scene that has one.

    Raises:
        InputError: there is none, it is broken, or it is about something else.
    """
    folder = data_folder("comparisons")
    places = (Path(name), folder / f"{name}.toml", folder / name)
    path = next((place for place in places if place.is_file()), None)
    if path is None:
        ours = {item: found for item in sorted(folder.glob("*.toml")) if (found := _of_figures(item)) is not None}
        path = next((item for item, scene in ours.items() if scene == name), None)
        if path is None:
            advice = f"there are no such figures; choose one of {', '.join(item.stem for item in ours)} or a file"
            raise InputError("figures", name, advice)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(str(path), "TOML", f"the file is broken: {error}") from None
    except OSError as error:
        raise InputError(str(path), "TOML", f"the file cannot be read: {error.strerror}") from None
    if content.get("study") != STUDY:
        raise InputError(str(path), "study", f'only a file with study = "{STUDY}" defines figures')
    return _read(path, content)


def _of_figures(path: Path) -> str | None:
    """The scene of a file of figures; None: it is another file, or a broken one."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return str(content.get("scene")) if content.get("study") == STUDY else None


def _read(path: Path, content: dict[str, Any]) -> Figures:
    given = {key: value for key, value in content.items() if key != "study"}
    try:
        found = TypeAdapter(Figures).validate_python({**given, "name": path.stem})
    except ValidationError as error:
        raise first_problem(error, path.name) from None
    _check(path.name, found)
    return found


def _check(where: str, found: Figures) -> None:
    """What types cannot say."""
    time_grid(found.until, found.every)
    for name, planned in found.runs.items():
        try:
            scene = load_scene(found.scene, **planned.parameters)
        except InputError as error:
            raise InputError(f"{where}: runs.{name}.{error.field}", error.value, error.advice) from None
    if not found.runs:
        raise InputError(f"{where}: runs", "nothing", "give at least one run")
    quantities = set(known(scene.rolling))
    for name in found.symbols:
        _choose(f"{where}: symbols", name, quantities)
    names = [figure.name for figure in found.figures]
    for index, figure in enumerate(found.figures):
        place = f"{where}: figures.{index}"
        if not re.fullmatch(r"[\w-]+", figure.name) or names.count(figure.name) > 1:
            raise InputError(f"{place}.name", figure.name, "give each figure a name of its own, letters and digits")
        _check_figure(place, figure, found, quantities)
    for index, statement in enumerate(found.statements):
        _check_statement(f"{where}: statements.{index}", statement, found, quantities)


def _check_figure(where: str, figure: Figure, found: Figures, quantities: set[str]) -> None:
    if bool(figure.panels) == bool(figure.regimes):
        raise InputError(f"{where}.panels", figure.name, "give either panels or the comparison of its regime maps")
    if figure.columns < 1 or not 0 < figure.height < 20:
        raise InputError(f"{where}.columns", figure.columns, "give at least 1 column, and rows of less than 20 inch")
    if figure.until is not None and not 0 < figure.until <= found.until:
        raise InputError(f"{where}.until", figure.until, f"give a time up to that of the runs, {found.until:g} s")
    if figure.regimes and load_comparison(figure.regimes).regimes is None:
        raise InputError(f"{where}.regimes", figure.regimes, "this comparison has no [regimes] table")
    for number, panel in enumerate(figure.panels):
        place = f"{where}.panels.{number}"
        if not panel.y or not panel.runs:
            raise InputError(f"{place}.y", panel.y, "draw at least one quantity of one run")
        for name in (panel.x, *panel.y):
            _choose(place, name, quantities)
        for name in panel.runs:
            _choose(f"{place}.runs", name, set(found.runs))


def _check_statement(where: str, item: Statement, found: Figures, quantities: set[str]) -> None:
    if not item.source:
        raise InputError(f"{where}.source", "nothing", "every statement needs its source; add it")
    if len(item.criteria) != 1:
        raise InputError(where, ", ".join(item.criteria) or "nothing", f"give exactly one of {', '.join(CRITERIA)}")
    if item.at_most is not None and not item.because:
        raise InputError(f"{where}.because", "nothing", "a bound that the source does not give needs its reason")
    if item.stated:
        try:
            finite = Decimal(item.stated).is_finite()
        except InvalidOperation:
            finite = False
        if not finite:
            raise InputError(f"{where}.stated", item.stated, 'give a number as text with its digits, e.g. "0.21"')
    if not item.runs:
        raise InputError(f"{where}.runs", item.runs, "name at least one run")
    for name in item.runs:
        _choose(f"{where}.runs", name, set(found.runs))
    if item.events or item.event is not None:
        if item.of or item.measure or item.order:
            raise InputError(f"{where}.of", item.of, "a statement about events has no quantity, measure or order")
        return
    _choose(f"{where}.of", item.of, quantities)
    if not item.measure or (item.measure == "every" and not item.stated):
        raise InputError(f"{where}.measure", item.measure, "name a measure; every is for a stated number")


def _choose(where: str, name: str, among: set[str]) -> None:
    if name not in among:
        raise InputError(where, name, f"there is no such name; choose from {', '.join(sorted(among))}")


for _typed in (Figures, Figure, Panel, Level, Planned, Statement):
    setattr(_typed, "__pydantic_config__", ConfigDict(extra="forbid"))  # noqa: B010 -- the name is pydantic's, not the class's
