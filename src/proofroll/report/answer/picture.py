"""Picture of an answer: error against cost of every run of the search, as an SVG element."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from html import escape
from typing import NamedTuple

from proofroll.core.number_format import number
from proofroll.core.plugins import parse_engine
from proofroll.report.answer.sentences import tolerance_words
from proofroll.report.labels import engine_words, preset_name
from proofroll.report.styles import DASHES, engine_colours
from proofroll.running.case import Status
from proofroll.studies.answer.records import SceneAnswer, SettingTried

# Size of the picture, its margins, and height of a line of the legend [px].
_WIDTH, _HEIGHT = 620.0, 300.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 58.0, 18.0, 22.0, 42.0
_LINE = 15.0
# Decades above and below what is allowed that are shown.
_ABOVE, _BELOW = 4.0, 8.0
# Lengths of dashes and gaps by their name [px].
_STROKES = ("", "6 3", "2 2", "6 2 2 2", "11 3", "11 2 2 2")
# Colours of a file of its own, by number, and of its letters; a page has its own.
_PALETTE = ("#0067b1", "#c8500a", "#00825d", "#b0478a", "#8a6d00", "#3a8fc4", "#5b4bb5", "#6b6b6b")
_STYLE = "text{font:11px system-ui,sans-serif;fill:#1b1f24}"


class DrawnRun(NamedTuple):
    """Cost [s per simulated s] and error over what is allowed of a run."""

    cost: float
    size: float


class DrawnSetting(NamedTuple):
    """Runs of one setting, coarse first, with its name for a reader, and the number of its dashes."""

    engine: str
    words: str
    dash: int
    points: list[DrawnRun]


def lines_of(made: SceneAnswer) -> list[DrawnSetting]:
    """Settings of an answer with a run that reached the end, engine by engine."""
    lines = []
    for engine in made.engines:
        formulations: dict[str, int] = {}
        for tried in engine.settings:
            options = parse_engine(tried.spec).options
            formulation = str(options.get("formulation", ""))
            preset = preset_name(options.get("preset"))
            points = [*_points(tried)]
            if points:
                dash = formulations.setdefault(formulation, len(formulations)) % len(DASHES)
                words = ", ".join(filter(None, (engine_words(engine.engine, formulation), preset)))
                lines.append(DrawnSetting(engine.engine, words, dash, points))
    return lines


def _points(tried: SettingTried) -> Iterator[DrawnRun]:
    for step in tried.steps:
        if step.status == Status.DONE and step.of_allowed and step.seconds_per_second:
            yield DrawnRun(step.seconds_per_second, step.of_allowed)


@dataclass(frozen=True)
class _Axes:
    """Decades that both axes show: of the cost, and of the error over what is allowed."""

    left: int
    right: int
    low: int
    high: int

    @classmethod
    def of(cls, lines: Sequence[DrawnSetting]) -> _Axes:
        """Axes that hold all runs, and what is allowed; errors far off are cut."""
        costs = [math.log10(point.cost) for line in lines for point in line.points]
        sizes = [min(_ABOVE, max(-_BELOW, math.log10(point.size))) for line in lines for point in line.points]
        left = math.floor(min(costs))
        right = max(math.ceil(max(costs)), left + 1)
        return cls(left, right, min(-1, math.floor(min(sizes))), max(1, math.ceil(max(sizes))))

    def place(self, point: DrawnRun) -> tuple[float, float]:
        """Place of a run in the picture [px]; what is beyond the shown decades stands at the edge."""
        x = (math.log10(point.cost) - self.left) / (self.right - self.left)
        y = (self.high - math.log10(point.size)) / (self.high - self.low)
        width, height = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM
        return round(_LEFT + width * x, 1), round(_TOP + height * min(1.0, max(0.0, y)), 1)


def svg(made: SceneAnswer, *, alone: bool = False) -> str:
    """Picture of an answer; empty if no run reached its end.

    Args:
        made: the answer.
        alone: True for a file of its own, with all colours; else those of the page are used.
    """
    lines = lines_of(made)
    if not lines:
        return ""
    axes = _Axes.of(lines)
    height = _HEIGHT + _LINE * math.ceil(len(lines) / 2)
    title = f"Error over what is allowed against cost: {made.scene}, {tolerance_words(made)}"
    marks = [*_frame(axes), *_curves(lines, axes), *_legend(lines)]
    colours = engine_colours(line.engine for line in lines)
    of_engines = "".join(f'[data-dot="{name}"]{{--c:{_PALETTE[colour]}}}' for name, colour in colours.items())
    head = f'xmlns="http://www.w3.org/2000/svg" width="{_WIDTH:g}" height="{height:g}" ' if alone else ""
    style = f"<style>{_STYLE}{of_engines}</style>" if alone else ""
    box = f'viewBox="0 0 {_WIDTH:g} {height:g}" role="img" aria-label="{escape(title)}"'
    return f'<svg class="cost" {head}{box}>{style}{"".join(marks)}</svg>'


def _frame(axes: _Axes) -> Iterator[str]:
    """Axes with a line for each decade, and the line of what is allowed."""
    bottom, end = _HEIGHT - _BOTTOM, _WIDTH - _RIGHT
    for decade in range(axes.left, axes.right + 1):
        x, _ = axes.place(DrawnRun(10.0**decade, 1.0))
        yield _rule(x, _TOP, x, bottom)
        yield _text(x, bottom + 16, f"{10.0**-decade:g}×", "middle")
    for decade in range(axes.low, axes.high + 1, max(1, round((axes.high - axes.low) / 6))):
        _, y = axes.place(DrawnRun(10.0**axes.left, 10.0**decade))
        yield _rule(_LEFT, y, end, y)
        yield _text(_LEFT - 5, y + 4, number(10.0**decade), "end")
    _, y = axes.place(DrawnRun(10.0**axes.left, 1.0))
    yield f'<path d="M{_LEFT:g} {y:g}H{end:g}" stroke="currentColor" stroke-width="1.5" fill="none"/>'
    yield _text(end - 2, y - 4, "allowed", "end")
    yield _text(_LEFT, 12, "largest error over what is allowed", "start")
    yield _text(end, bottom + 32, "speed, times real time; the fastest at the left", "end")


def _rule(x: float, y: float, to_x: float, to_y: float) -> str:
    return f'<path d="M{x:g} {y:g}L{to_x:g} {to_y:g}" stroke="currentColor" opacity=".14" fill="none"/>'


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:g}" y="{y:g}" text-anchor="{anchor}">{escape(words)}</text>'


def _stroke(line: DrawnSetting) -> str:
    return f'style="stroke:var(--c)" stroke-width="1.6" stroke-dasharray="{_STROKES[line.dash]}" fill="none"'


def _curves(lines: Sequence[DrawnSetting], axes: _Axes) -> Iterator[str]:
    """Curve of each setting; a point under the pointer tells its run."""
    for line in lines:
        places = [axes.place(point) for point in line.points]
        path = "L".join(f"{x:g} {y:g}" for x, y in places)
        yield f'<g data-dot="{escape(line.engine)}"><path d="M{path}" {_stroke(line)}/>'
        for (x, y), point in zip(places, line.points, strict=True):
            told = f"{line.words}: {number(point.size)} of what is allowed, {number(1 / point.cost)}× real time"
            yield f'<circle cx="{x:g}" cy="{y:g}" r="3" style="fill:var(--c)"><title>{escape(told)}</title></circle>'
        yield "</g>"


def _legend(lines: Sequence[DrawnSetting]) -> Iterator[str]:
    """Names of the settings in two columns below the picture."""
    for index, line in enumerate(lines):
        x, y = _LEFT + (index % 2) * (_WIDTH - _LEFT) / 2, _HEIGHT + 8 + _LINE * (index // 2)
        yield f'<g data-dot="{escape(line.engine)}"><path d="M{x:g} {y - 4:g}h24" {_stroke(line)}/></g>'
        yield _text(x + 30, y, line.words, "start")
