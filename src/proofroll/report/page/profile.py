"""Performance profile: in how many scenes each engine is at most so many times as costly as the cheapest."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

from proofroll.report.page.answer import FirstAnswer
from proofroll.report.page.choice_matrix import ChoiceMatrix

# Picture: width, height, margins left, right, top and below [px], largest ratio of costs, distance of two labels [px].
WIDTH, HEIGHT, LEFT, RIGHT, TOP, BELOW, LARGEST, APART = 640, 330, 30, 150, 14, 44, 100.0, 16
# Ratios that the axis shows, and the one that sentences name.
RATIOS = (1, 2, 5, 10, 20, 50, 100)
NEAR = 3.0
# Ratio up to which a cost counts as equal.
_SAME = 1.0001


@dataclass(frozen=True)
class ProfileLine:
    """Line of an engine.

    Attributes:
        engine, title: its names.
        witness: True if it is never recommended.
        ratios: costs relative to the cheapest engine of each scene that it holds, sorted.
        path: of the line, as SVG has it.
        y: of its end, and of its label [px].
    """

    engine: str
    title: str
    witness: bool
    ratios: list[float]
    path: str
    y: float
    label: float

    def within(self, ratio: float) -> int:
        """Number of scenes that it holds at no more than this ratio of costs."""
        return sum(item <= ratio * _SAME for item in self.ratios)


@dataclass(frozen=True)
class Profile:
    """Lines of engines over a number of scenes; ``ticks``: y of the grid's lines by number of scenes [px]."""

    lines: list[ProfileLine]
    scenes: int
    ticks: dict[int, float]

    @property
    def rivals(self) -> list[ProfileLine]:
        """Lines of the engines that may be taken, those that hold the most scenes first."""
        return sorted((item for item in self.lines if not item.witness), key=lambda item: -len(item.ratios))


def x_of(ratio: float) -> float:
    """Place of a ratio of costs in the picture [px]."""
    return LEFT + (WIDTH - LEFT - RIGHT) * math.log(ratio) / math.log(LARGEST)


def profile(matrix: ChoiceMatrix, answered: FirstAnswer, engines: Collection[str] | None = None) -> Profile:
    """Profile of the engines over the scenes of an answer that are judged; ``engines``: of these alone."""
    asked, scenes = answered.question, [item for item in answered.scenes if item.judged]
    count = len(scenes)

    def y_of(held: int) -> float:
        return round(HEIGHT - BELOW - (HEIGHT - BELOW - TOP) * held / (count or 1), 1)

    least = [item.taken.cost if item.taken else math.inf for item in scenes]
    lines = []
    for name in matrix.engines:
        if engines is not None and name not in engines and name not in matrix.witnesses:
            continue
        costs = [matrix.standing(name, item.column, asked.tolerance, asked.forces).cost for item in scenes]
        pairs = [(cost, low) for cost, low in zip(costs, least, strict=True) if math.isfinite(cost) and low > 0]
        ratios = sorted(max(1.0, cost / low) if math.isfinite(low) else math.inf for cost, low in pairs)
        ratios = [item for item in ratios if math.isfinite(item)]
        held = sum(item <= _SAME for item in ratios)
        path = f"M{x_of(1):.1f} {y_of(held)}"
        for item in (x for x in ratios if _SAME < x <= LARGEST):
            held += 1
            path += f"H{x_of(item):.1f}V{y_of(held)}"
        path += f"H{x_of(LARGEST):.1f}"
        end = y_of(held)
        lines.append(
            ProfileLine(
                engine=name,
                title=matrix.title(name),
                witness=name in matrix.witnesses,
                ratios=ratios,
                path=path,
                y=end,
                label=end,
            )
        )
    apart: list[ProfileLine] = []
    for line in sorted(lines, key=lambda line: line.y):
        apart.append(replace(line, label=max(line.y, apart[-1].label + APART) if apart else line.y))
    every = max(1, math.ceil(count / 4))
    return Profile(apart, count, {number: y_of(number) for number in range(0, count + 1, every)})
