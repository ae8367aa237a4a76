"""Content of a file of figures: runs, figures of them, and an article's statements about them."""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

from proofroll.core.validation import strict
from proofroll.papers.blajer_2006.figures.quantities import ANGLES, TIME

CRITERIA = ("stated", "at_most", "below", "above", "order", "events")


@dataclass(frozen=True)
class PlannedRun:
    """A run, to which figures and statements refer by name.

    Attributes:
        label: text in a legend; mathematics between dollar signs.
        parameters: parameters of the scene.
        engine: engine of this run, for what the file's engine does not follow; empty: the file's.
        every: sampling interval of this run [s]; None: the file's.
    """

    label: str
    parameters: dict[str, float] = field(default_factory=dict)
    engine: str = ""
    every: float | None = None


@dataclass(frozen=True)
class HorizontalLine:
    """A horizontal line.

    Attributes:
        value: height of the line, in the panel's unit.
        label: text beside it.
    """

    value: float
    label: str


@dataclass(frozen=True)
class Panel:
    """One pair of axes.

    Attributes:
        y: quantities of the ordinate.
        runs: names of the runs that are drawn.
        x: quantity of the abscissa; time by default.
        title: title of the panel.
        label: label of the ordinate, by default all its symbols; mathematics between dollar signs.
        equal: one scale for both axes.
        zero: the ordinate begins at zero.
        share: panels with the same text share the range of y.
        levels: horizontal lines.
        events: mark the events of the first run.
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
    levels: list[HorizontalLine] = field(default_factory=list)
    events: bool = False
    truth: bool = True


@dataclass(frozen=True)
class Figure:
    """One figure: panels of runs, or regime maps.

    Attributes:
        name: name of its file, without ending.
        caption: caption of the figure.
        panels: panels in reading order.
        columns: number of columns of panels.
        height: height of a row of panels [inch].
        until: end of the drawn time [s]; by default the end of the runs.
        regimes: name of the study of regimes whose maps it shows, instead of panels.
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
    """Statement of an article, or of this project, about runs: one quantity, one measure of it, and one criterion.

    Attributes:
        says: the statement as a sentence.
        source: place of the statement.
        ours: true for a statement of this project, not of the article.
        runs: runs that must fulfil it, each by itself; with ``order`` they are compared with each other.
        of: quantity; none for ``events``.
        measure: measure of the quantity (:data:`measures.MEASURES`); ``every`` means all its samples.
        stated: a number with the digits that the source gives; the measured value must round to it.
        at_most, below, above: bounds, in the unit of the measure.
        because: reason for this bound, where the source gives no number.
        order: order of the measured values from the first run to the last.
        events: kinds of the events of the run, in order.
        event: number of an event, from 0; its time [s] is ``stated`` instead of a measure.
        until: end of the time that counts [s].
    """

    says: str
    source: str
    runs: list[str]
    ours: bool = False
    of: str = ""
    measure: str = ""
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
        """Names of the given criteria; exactly one in a file that has been checked."""
        return [name for name in CRITERIA if getattr(self, name) not in (None, "", [])]


@dataclass(frozen=True)
class Figures:
    """A file of figures.

    Attributes:
        name: name of the file, without ending.
        title, source: title of the study, and its article.
        scene: scene of every run.
        engine: engine whose runs are drawn unless the user names another, ``name[key=value,…]``.
        until, every: last time and sampling interval of every run [s].
        start_angles: Euler angles φ, θ, ψ of the body's axes at time 0 [rad].
        symbols: quantity -> symbol of the article, as TeX mathematics.
        runs: runs by name.
        figures: figures in the order of the article.
        statements: statements that are checked.
        time_limit: limit for each run [s].
    """

    question: ClassVar[str] = ""  # part of a report's entry; here the title says enough
    name: str
    title: str
    source: str
    scene: str
    engine: str
    until: float
    every: float
    runs: dict[str, PlannedRun]
    figures: list[Figure]
    statements: list[Statement] = field(default_factory=list)
    symbols: dict[str, str] = field(default_factory=dict)
    start_angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time_limit: float = 120.0

    @property
    def wants_orientation(self) -> bool:
        """True if a figure or a statement needs the Euler angles."""
        drawn = {name for figure in self.figures for panel in figure.panels for name in (panel.x, *panel.y)}
        return bool((drawn | {item.of for item in self.statements}) & set(ANGLES))


strict(Figures, Figure, Panel, HorizontalLine, PlannedRun, Statement)
