"""Figures of an article as a part of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from proofroll.papers.blajer_2006.figures import writing
from proofroll.papers.blajer_2006.figures.reading import STUDY, load_figures
from proofroll.report.parts import Part, PartEntry

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.papers.blajer_2006.figures.definition import Figures
    from proofroll.papers.blajer_2006.figures.study import FigureRuns
    from proofroll.report.parts import Tell
    from proofroll.running.runner import Runner


@dataclass
class FiguresPart(Part):
    """Section of a report: figures of an article from our own runs, and its statements."""

    kind: ClassVar[str] = STUDY
    key: ClassVar[str] = "figures"
    order: ClassVar[float] = 10
    words: ClassVar[str] = "figures"
    command: ClassVar[str] = "paper figures"
    template: ClassVar[str] = "figures.html"
    names: ClassVar[Mapping[str, Any]] = {"statements": writing}
    asked: Figures
    maps: dict[str, list[xr.Dataset]] = field(default_factory=dict)
    """Regime maps by the name of their study."""
    study: FigureRuns | None = None

    @classmethod
    def load(cls, path: Path, engines: Sequence[str]) -> FiguresPart:  # noqa: ARG003 -- a file names its own engine
        """See :class:`proofroll.report.parts.Part`."""
        return cls(load_figures(str(path)))

    @staticmethod
    def line(entry: PartEntry) -> str:
        """Count of the statements that hold."""
        return writing.count(entry.study["statements"])

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:  # noqa: ARG002 -- the protocol's
        """Makes the runs and regime maps."""
        from proofroll.papers.blajer_2006.figures.study import run_figures
        from proofroll.papers.blajer_2006.slip.regimes import load_regimes, regime_maps

        self.study = run_figures(self.asked, runner, None, lambda case, _: tell(case.engine.name, 1))
        for name in dict.fromkeys(figure.regimes for figure in self.asked.figures if figure.regimes):
            self.maps[name] = regime_maps(
                load_regimes(name).briefly(), runner.jobs, lambda _: tell("runs of the truth", 0)
            )

    def entry(self) -> PartEntry:
        """Entry of the report with captions, runs and statements."""
        from proofroll.papers.blajer_2006.figures.writing import figures_content

        assert self.study is not None  # it was made
        content = figures_content(self.study, self.maps)
        wrong = [item for item in content["statements"] if item["holds"] is False]
        false = [f"{item['says']} ({', '.join(item['runs'])}): {item['found']}, not {item['stated']}" for item in wrong]
        return PartEntry(**self.head, study=content, contradictions=false, lost=content["lost"])

    def pictures(self, prefix: str) -> dict[str, str]:
        """SVG elements by name of their figure; ids begin with ``prefix``."""
        from proofroll.papers.blajer_2006.figures.drawing import inline
        from proofroll.papers.blajer_2006.report.regime_map import inline as inline_map

        assert self.study is not None  # it was made
        return {
            figure.name: inline_map(self.maps[figure.regimes], f"{prefix}{figure.name}-")
            if figure.regimes
            else inline(figure, self.study, f"{prefix}{figure.name}-")
            for figure in self.asked.figures
        }
