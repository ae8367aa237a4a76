"""Speed against accuracy in one scene as a part of a report."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from proofroll.report.advice import Advice, advice
from proofroll.report.study_parts import PartEntry, held
from proofroll.studies.claimed import ClaimJudgement
from proofroll.studies.claims import STUDY, TradeoffClaims, load_claims

if TYPE_CHECKING:
    from proofroll.report.study_parts import Tell
    from proofroll.running.runner import Runner


@dataclass(frozen=True, kw_only=True)
class TradeoffEntry(PartEntry):
    """A study with the quantities that are shown, what to use, and what was claimed."""

    shown: list[str]
    advice: list[Advice]
    claims: list[ClaimJudgement]


@dataclass
class TradeoffPart:
    """Speed against accuracy in one scene."""

    kind: ClassVar[str] = STUDY
    key: ClassVar[str] = "tradeoffs"
    order: ClassVar[float] = 30
    words: ClassVar[str] = "speed against accuracy"
    template: ClassVar[str] = "tradeoff.html"
    names: ClassVar[Mapping[str, Any]] = {}
    on_request: ClassVar[bool] = False
    asked: TradeoffClaims
    engines: Sequence[str] = ()
    study: Mapping[str, Any] | None = None

    @classmethod
    def load(cls, path: Path, engines: Sequence[str]) -> TradeoffPart:
        """See the protocol."""
        return cls(load_claims(path), tuple(engines))

    @staticmethod
    def line(entry: TradeoffEntry) -> str:
        """How much was measured, and what holds of what was claimed."""
        return f"{len(entry.study['points'])} points{held(entry.claims)}"

    @property
    def head(self) -> dict[str, str]:
        """What it is."""
        asked = self.asked
        command = f"proofroll tradeoff {asked.scene}" + "".join(
            f" --engine {shlex.quote(name)}" for name in self.engines
        )
        return {
            "name": asked.name, "title": asked.title, "question": asked.question, "scene": asked.scene,
            "command": command,
        }  # fmt: skip

    def keeps(self, out: Path) -> bool:
        """The whole study, or else a brief one."""
        from proofroll.studies.study_store import kept
        from proofroll.studies.tradeoff import stored

        paths = (stored(out, self.asked.swept, self.engines, brief=brief) for brief in (False, True))
        self.study = next((study for path in paths if (study := kept(path)[0]) is not None), None)
        return self.study is not None

    def make(self, runner: Runner, out: Path, tell: Tell) -> None:
        """A brief study, without the runs over ranges of parameters."""
        from proofroll.studies.study_store import make_tradeoff

        self.study, _ = make_tradeoff(
            self.asked.swept, runner, out, engines=self.engines, claims=self.asked, brief=True,
            progress=lambda text: tell(text, 1),
        )  # fmt: skip

    def entry(self) -> TradeoffEntry:
        """See the protocol."""
        from proofroll.report.tradeoff_tables import default_quantities

        study = self.study
        assert study is not None  # it was made
        return TradeoffEntry(
            **self.head,
            study=study,
            shown=default_quantities(study),
            advice=advice(study, self.asked),
            claims=[] if self.engines else self.asked.judged(study),
            contradictions=[] if self.engines else self.asked.contradictions(study),
        )

    def pictures(self, prefix: str) -> dict[str, str]:
        """The work-precision diagram."""
        from proofroll.report.svg import element
        from proofroll.report.tradeoff_tables import default_quantities
        from proofroll.report.work_precision import svg

        assert self.study is not None  # it was made
        return {"diagram": element(svg(self.study, default_quantities(self.study)), prefix)}
