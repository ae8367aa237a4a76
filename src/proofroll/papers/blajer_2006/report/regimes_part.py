"""Regime maps as a part of a report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from typing_extensions import override

from proofroll.papers.blajer_2006.slip.regimes import STUDY, RegimesStudy, load_regimes, regime_maps
from proofroll.report.parts import Part, PartEntry

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.report.parts import Tell
    from proofroll.running.runner import Runner


@dataclass
class RegimesPart(Part):
    """See :class:`proofroll.report.parts.Part`."""

    kind: ClassVar[str] = STUDY
    key: ClassVar[str] = "regimes"
    order: ClassVar[float] = 20
    words: ClassVar[str] = "regime maps"
    command: ClassVar[str] = "paper regimes"
    template: ClassVar[str] = "regimes.html"
    asked: RegimesStudy
    maps: list[xr.Dataset] = field(default_factory=list)

    @classmethod
    @override
    def load(cls, path: Path, engines: Sequence[str]) -> RegimesPart:
        return cls(load_regimes(str(path)))

    @staticmethod
    def line(entry: PartEntry) -> str:
        """Counts of runs by regime."""
        maps = entry.study["maps"]
        total = {word: sum(item["counts"][word] for item in maps) for word in maps[0]["counts"]}
        return ", ".join(f"{count} {word}" for word, count in total.items())

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:  # noqa: ARG002 -- the protocol's
        """Makes the maps of a smaller study, see :meth:`RegimesStudy.briefly`."""
        self.maps = regime_maps(self.asked.briefly(), runner.jobs, lambda _: tell("runs of the truth", 0))

    def entry(self) -> PartEntry:
        """Entry with counts, analytic boundaries, and the number of runs left out."""
        from proofroll.papers.blajer_2006.report.regime_map import counts

        maps = counts(self.maps)
        left_out = self.asked.runs - sum(item["runs"] for item in maps)
        return PartEntry(**self.head, study={"maps": maps, "left_out": left_out})

    def pictures(self, prefix: str) -> dict[str, str]:
        """SVG element of all maps side by side."""
        from proofroll.papers.blajer_2006.report.regime_map import inline

        return {"maps": inline(self.maps, f"{prefix}maps-")}
