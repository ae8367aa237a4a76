"""Judgements of the claims in a study's file."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ClaimJudgement:
    """Judgement of a claim by a study.

    Attributes:
        claim: in one sentence.
        because: reason that the file gives for it.
        holds: True or False; None: the measurements do not decide.
        found: result of the study, in one sentence.
    """

    claim: str
    because: str
    holds: bool | None
    found: str


@dataclass(frozen=True)
class JudgedFile:
    """Judgement of all claims of a file, as sentences.

    Attributes:
        file: its path; None: no file was judged.
        contradictions: about claims that do not hold.
        undecided: about claims that the measurements do not decide.
    """

    file: str | None = None
    contradictions: list[str] = field(default_factory=list)
    undecided: list[str] = field(default_factory=list)
