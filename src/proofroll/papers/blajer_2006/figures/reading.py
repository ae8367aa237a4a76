"""Reading of files that define figures (``study = "figures"``)."""

import re
from decimal import Decimal, InvalidOperation

from proofroll.core.errors import InputError, require_known
from proofroll.core.time_grid import time_grid
from proofroll.core.validation import validated
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import study_file
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.figures.definition import CRITERIA, Figure, Figures, Statement
from proofroll.papers.blajer_2006.figures.measures import MEASURES
from proofroll.papers.blajer_2006.figures.quantities import known
from proofroll.papers.blajer_2006.slip.regimes import load_regimes

STUDY = "figures"


def load_figures(name: str) -> Figures:
    """Reads a file by its path, its name, or the scene that it is about.

    Raises:
        InputError: there is no such file, it is invalid, or it is of another study.
    """
    path, content = study_file(name, STUDY)
    figures = validated(Figures, {**content, "name": path.stem}, path.name)
    _check(path.name, figures)
    return figures


def _check(location: str, figures: Figures) -> None:
    """Raises InputError if times, names or parameters in a file are invalid."""
    time_grid(figures.until, figures.every)
    for name, planned in figures.runs.items():
        time_grid(figures.until, planned.every or figures.every)
        try:
            scene = load_scene(figures.scene, **planned.parameters)
        except InputError as error:
            raise InputError(f"{location}: runs.{name}.{error.field}", error.value, error.advice) from None
    if not figures.runs:
        raise InputError(f"{location}: runs", None, "give at least one run")
    quantities = set(known(rolling_ball(scene)))
    for name in figures.symbols:
        _choose(f"{location}: symbols", name, quantities)
    names = [figure.name for figure in figures.figures]
    for index, figure in enumerate(figures.figures):
        place = f"{location}: figures.{index}"
        if not re.fullmatch(r"[\w-]+", figure.name) or names.count(figure.name) > 1:
            raise InputError(f"{place}.name", figure.name, "give each figure a name of its own, letters and digits")
        _check_figure(place, figure, figures, quantities)
    for index, statement in enumerate(figures.statements):
        _check_statement(f"{location}: statements.{index}", statement, figures, quantities)


def _check_figure(location: str, figure: Figure, figures: Figures, quantities: set[str]) -> None:
    if bool(figure.panels) == bool(figure.regimes):
        raise InputError(f"{location}.panels", figure.name, "give either panels or the study of its regime maps")
    if figure.columns < 1 or not 0 < figure.height < 20:
        raise InputError(f"{location}.columns", figure.columns, "give at least 1 column, and rows of less than 20 inch")
    if figure.until is not None and not 0 < figure.until <= figures.until:
        raise InputError(f"{location}.until", figure.until, f"give a time up to that of the runs, {figures.until:g} s")
    if figure.regimes:
        load_regimes(figure.regimes)
    for number, panel in enumerate(figure.panels):
        place = f"{location}.panels.{number}"
        if not panel.y or not panel.runs:
            raise InputError(f"{place}.y", panel.y, "draw at least one quantity of one run")
        for name in (panel.x, *panel.y):
            _choose(place, name, quantities)
        for name in panel.runs:
            _choose(f"{place}.runs", name, set(figures.runs))


def _check_statement(location: str, item: Statement, figures: Figures, quantities: set[str]) -> None:
    if not item.source:
        raise InputError(f"{location}.source", None, "every statement needs its source; add it")
    if len(item.criteria) != 1:
        raise InputError(location, ", ".join(item.criteria) or None, f"give exactly one of {', '.join(CRITERIA)}")
    if item.at_most is not None and not item.because:
        raise InputError(f"{location}.because", None, "a bound that the source does not give needs its reason")
    if item.stated:
        try:
            finite = Decimal(item.stated).is_finite()
        except InvalidOperation:
            finite = False
        if not finite:
            raise InputError(f"{location}.stated", item.stated, 'give a number as text with its digits, e.g. "0.21"')
    if not item.runs:
        raise InputError(f"{location}.runs", item.runs, "name at least one run")
    for name in item.runs:
        _choose(f"{location}.runs", name, set(figures.runs))
    if item.events or item.event is not None:
        if item.of or item.measure or item.order:
            raise InputError(f"{location}.of", item.of, "a statement about events has no quantity, measure or order")
        return
    _choose(f"{location}.of", item.of, quantities)
    _choose(f"{location}.measure", item.measure, {*MEASURES, "every"})
    if item.measure == "every" and not item.stated:
        raise InputError(f"{location}.measure", item.measure, "every is for a stated number")


def _choose(location: str, name: str, among: set[str]) -> None:
    require_known(location, name or "nothing", sorted(among), "there is no such name; choose from")
