"""Judgement of a claim in a study's file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ClaimJudgement:
    """Judgement of a claim by a study.

    Attributes:
        claim: in one sentence.
        because: its reason.
        holds: None: undecided, for what is measured does not tell.
        found: what the study shows, in one sentence.
    """

    claim: str
    because: str
    holds: bool | None
    found: str
