"""Reads the comparison files that claim something of a trade-off: ``study = "tradeoff"``."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.core.bounds import bounded
from proofroll.core.comparison import Tolerance
from proofroll.core.errors import InputError, told_of
from proofroll.core.validation import strict, validated
from proofroll.files.scene_file import load_scene
from proofroll.files.toml import study_content, study_files
from proofroll.studies.claim_judgement import ClaimJudgement
from proofroll.studies.tradeoff.cost_claims import Cheapest, Converges, Holds
from proofroll.studies.tradeoff.curve import Question

if TYPE_CHECKING:
    from proofroll.studies.tradeoff.records import TradeoffStudy

STUDY = "tradeoff"


@dataclass(frozen=True)
class TradeoffClaims:
    """Question and claims of a trade-off's file.

    Attributes:
        name: of the file, without ending.
        title, question: for a person.
        scene, parameters, until, quantity: what is swept.
        over: parameter -> values; the range over which the best points are checked.
        holds, converges, cheapest: the claims; the first two are judged exactly.
    """

    name: str
    title: str
    question: str
    scene: str
    until: float
    quantity: str
    parameters: dict[str, float] = field(default_factory=dict)
    over: dict[str, list[float]] = field(default_factory=dict)
    cheapest: list[Cheapest] = field(default_factory=list)
    holds: list[Holds] = field(default_factory=list)
    converges: list[Converges] = field(default_factory=list)

    @cached_property
    def swept(self) -> Question:
        """Question that is swept."""
        return Question(self.scene, self.parameters, self.until, self.quantity)

    def judged(self, study: TradeoffStudy) -> list[ClaimJudgement]:
        """Judgement of each claim by a study."""
        claims: list[Holds | Converges | Cheapest] = [*self.holds, *self.converges, *self.cheapest]
        return [claim.judged(study, self.quantity) for claim in claims]

    def contradictions(self, study: TradeoffStudy) -> list[str]:
        """Contradicted claims, as sentences."""
        return self._said(study, False, "contradicted")

    def undecided(self, study: TradeoffStudy) -> list[str]:
        """Undecided claims, as sentences."""
        return self._said(study, None, "undecided")

    def _said(self, study: TradeoffStudy, verdict: bool | None, word: str) -> list[str]:
        judged = (item for item in self.judged(study) if item.holds is verdict)
        return [f"{self.name}, {word}: {item.claim}; {item.found}" for item in judged]


def claims_for(scene: str) -> TradeoffClaims | None:
    """The claims about a scene as its file has them, or None if there is no file."""
    files = (_claims(path, content) for path, content in study_files(STUDY) if content.get("scene") == scene)
    return next(files, None)


def load_claims(path: str | Path) -> TradeoffClaims:
    """Reads a file.

    Raises:
        InputError: it is broken, or is about something else.
    """
    return _claims(Path(path), study_content(Path(path), STUDY))


def _claims(path: Path, given: dict[str, Any]) -> TradeoffClaims:
    where = path.name
    for kind in ("cheapest", "holds"):
        raw = given.get(kind, [])
        for index, claim in enumerate(raw if isinstance(raw, list) else []):
            if isinstance(claim, dict):
                claim["tolerance"] = Tolerance.parse(f"{where}: {kind}.{index}.tolerance", claim.get("tolerance"))
                if kind == "cheapest" and isinstance(claim.get("engine"), str):
                    claim["engine"] = [claim["engine"]]
    claims = validated(TradeoffClaims, given, where, name=path.stem)
    with told_of(where):
        _check(where, claims)
    return claims


def _check(where: str, file: TradeoffClaims) -> None:
    bounded("until", file.until, above=0)
    unit = file.swept.loaded.observable(file.quantity, f"{where}: quantity").unit
    if not (file.cheapest or file.holds or file.converges):
        advice = "the file claims nothing; add [[cheapest]] with tolerance, engine and because"
        raise InputError(f"{where}: cheapest", "nothing", advice)
    for kind in ("cheapest", "holds", "converges"):
        for index, claim in enumerate(getattr(file, kind)):
            if not claim.because:
                raise InputError(f"{where}: {kind}.{index}.because", "nothing", "every claim needs its reason; add it")
            tolerance = getattr(claim, "tolerance", None)
            if tolerance is not None and not tolerance.relative and tolerance.unit != unit:
                raise InputError(f"{where}: {kind}.{index}.tolerance", tolerance.unit, f"its unit is {unit}")
    for name, values in file.over.items():
        for value in values:
            load_scene(file.scene, **{**file.parameters, name: value})


strict(TradeoffClaims, Cheapest, Holds, Converges)
