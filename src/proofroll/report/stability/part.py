"""Stability map of one scene as a part of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from typing_extensions import override

from proofroll.core.number_format import number
from proofroll.report.parts import Part, PartEntry, Tell, claims_sentence
from proofroll.report.stability import map as stability_map
from proofroll.report.stability.tables import silent_lines
from proofroll.running.runner import Runner
from proofroll.studies.stability.axes import QUICK, Axis, Effort
from proofroll.studies.stability.claims import STUDY, Claim, StabilityFile, file_for
from proofroll.studies.stability.map import stability_path
from proofroll.studies.stability.records import ClaimJudgement, StabilityStudy
from proofroll.studies.stability.study import make_stability
from proofroll.studies.study_store import valid_study


@dataclass(frozen=True, kw_only=True)
class StabilityEntry(PartEntry):
    """Entry of a map: the largest errors that no engine reports, judged claims, and axes that were left out."""

    silent: list[str]
    claims: list[ClaimJudgement]
    left_out: list[str]


@dataclass
class StabilityPart(Part):
    """Stability map of one scene."""

    kind: ClassVar[str] = STUDY
    key: ClassVar[str] = "stability"
    order: ClassVar[float] = 40
    words: ClassVar[str] = "where engines stop being right"
    command: ClassVar[str] = "stability"
    template: ClassVar[str] = "stability.html"
    names: ClassVar[Mapping[str, Any]] = {"stability_map": stability_map}
    asked: StabilityFile
    engines: Sequence[str] = ()
    study: StabilityStudy | None = None
    folder: str = ""

    @classmethod
    def load(cls, path: Path, engines: Sequence[str]) -> StabilityPart:
        """See :meth:`proofroll.report.parts.Part.load`."""
        return cls(file_for(str(path)), tuple(engines))

    @staticmethod
    def line(entry: StabilityEntry) -> str:
        """Count of silent boundaries, and of the claims that hold."""
        study = entry.study
        return f"{study.silent} of {study.boundaries} boundaries are silent{claims_sentence(entry.claims)}"

    def keeps(self, out: Path) -> bool:
        """True if a map is stored; the full one is preferred to quick ones, of all axes or of some."""
        for effort, axes in ((Effort(), self.asked.axes), (QUICK, self.asked.axes), (QUICK, self._quick_axes)):
            path = stability_path(out, self.asked.scene, axes, self.engines, effort)
            self.study, _ = valid_study(path, StabilityStudy)
            if self.study is not None:
                self.folder = _programs(path)
                return True
        return False

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """Makes a quick map of the axes on which a failure is expected."""
        self.study, path = make_stability(
            self.asked, self._quick_axes, runner, out, engines=self.engines, effort=QUICK, progress=tell
        )
        self.folder = _programs(path)

    @property
    def _quick_axes(self) -> list[Axis]:
        """Axes of a quick map: those that change the numbers of a step."""
        return [axis for axis in self.asked.axes if not axis.scale_free]

    @override
    def entry(self) -> StabilityEntry:
        study = self.study
        assert study is not None  # it was made
        mapped = {axis.name for axis in study.axes}
        claims, contradictions = [], []
        for claim in () if self.engines else self.asked.claims:
            against = claim.contradictions(study.points)
            contradictions += against
            untested = "" if against else claim.untested(study.points)
            holds, text = None if untested else not against, untested or "; ".join(against)
            claims.append(ClaimJudgement(_claim_text(claim, study.step_symbols), claim.because, holds, text))
        points = [
            replace(point, reproducer=f"{self.folder}/{Path(point.reproducer).name}") if point.reproducer else point
            for point in study.points
        ]
        return StabilityEntry(
            **self.head,
            study=replace(study, points=points),
            silent=list(silent_lines(study)),
            claims=claims,
            left_out=[axis.name for axis in self.asked.axes if axis.name not in mapped],
            contradictions=contradictions,
            lost=[] if study.points else [f"{name}: {reason}" for name, reason in study.absent.items()],
        )


def _programs(path: Path) -> str:
    """Folder of a map's programs, relative to the folder of all results."""
    return f"{path.parent.name}/{path.stem}"


def _claim_text(claim: Claim, symbols: Mapping[str, str]) -> str:
    """A claim in one sentence."""
    text = f"{claim.engine} is {claim.boundary}"
    if claim.never:
        text += " at no step or tolerance"
    elif claim.same:
        text += " up to the same part of the natural time everywhere"
    elif claim.number is not None:
        low, high = claim.between
        text += f" up to {symbols.get(claim.number, claim.number)} = {number(low)} … {number(high)}"
    else:
        text += " up to a boundary"
    if claim.axes:
        text += f" along {', '.join(claim.axes)}"
    if claim.values:
        low, high = claim.values
        text += f" at {low:g}" if low == high else f" from {low:g} to {high:g}"
    if claim.failure:
        text += f"; beyond: {' or '.join(claim.failure)}"
    if claim.silent is not None:
        text += "; the engine does not say so" if claim.silent else "; the engine says so"
    return text
