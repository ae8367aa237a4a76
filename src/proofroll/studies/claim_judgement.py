"""Judgements of the claims in a study's file."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ClaimJudgement:
    """Judgement of a claim by a study.

    Attributes:
        claim: in one sentence.
        because: its reason.
        holds: None: undecided, for what is measured does not tell.
        found: result of the study, in one sentence.
    """

    claim: str
    because: str
    holds: bool | None
    found: str


@dataclass(frozen=True)
class JudgedFile:
    """Judgement of the claims of one file by a study, as sentences; ``file`` is None where none was held against it."""

    file: str | None = None
    contradictions: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)
