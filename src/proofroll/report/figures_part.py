"""Figures of an article as a part of a report."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.figures.definition import Figures
    from proofroll.figures.study import Study
    from proofroll.report.study_parts import Tell
    from proofroll.running.runner import Runner


@dataclass
class FiguresPart:
    """Figures of an article from our own runs, and what it states."""

    key: ClassVar[str] = "figures"
    words: ClassVar[str] = "figures"
    on_request: ClassVar[bool] = False
    asked: Figures
    maps: dict[str, list[xr.Dataset]] = field(default_factory=dict)
    """Regime maps by comparison; those that are missing are made."""
    study: Study | None = None

    @property
    def head(self) -> dict[str, str]:
        """What it is."""
        asked = self.asked
        command = f"proofroll figures {asked.name}"
        return {"name": asked.name, "title": asked.title, "question": "", "scene": asked.scene, "command": command}

    def keeps(self, out: Path) -> bool:  # noqa: ARG002 -- the protocol's
        """Its runs are cases, which the runner reuses."""
        return False

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:  # noqa: ARG002 -- the protocol's
        """Makes the runs, and the maps that no comparison has made."""
        from proofroll.elements.ball_on_surface.regimes_study import regime_maps
        from proofroll.figures.study import run_figures
        from proofroll.files.comparison_file import load_comparison

        self.study = run_figures(self.asked, runner, None, lambda case, _: tell(case.engine.name, 1))
        for name in dict.fromkeys(figure.regimes for figure in self.asked.figures if figure.regimes):
            if name not in self.maps:
                workers = runner.jobs
                self.maps[name] = regime_maps(load_comparison(name), workers, lambda _: tell("runs of the truth", 0))

    def content(self) -> dict[str, Any]:
        """Captions, runs and statements."""
        from proofroll.report.figures import figures_content

        assert self.study is not None  # it was made
        content = figures_content(self.study, self.maps)
        wrong = [item for item in content["statements"] if item["holds"] is False]
        said = [f"{item['says']} ({', '.join(item['runs'])}): {item['found']}, not {item['stated']}" for item in wrong]
        return {"study": content, "contradictions": said, "lost": content["lost"]}

    def pictures(self, prefix: str) -> dict[str, str]:
        """One for each figure with panels; the maps are the comparison's."""
        from proofroll.elements.ball_on_surface.report.regime_map import inline as inline_map
        from proofroll.figures.drawing import inline

        assert self.study is not None  # it was made
        return {
            figure.name: inline_map(self.maps[figure.regimes], f"{prefix}{figure.name}-")
            if figure.regimes
            else inline(figure, self.study, f"{prefix}{figure.name}-")
            for figure in self.asked.figures
        }
