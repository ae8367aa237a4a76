"""Row of a drill: the outcome of one fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Drilled:
    """One fault, and what it cost.

    Attributes:
        fault: fault on purpose.
        contained: True if it cost nothing but its own case.
        said: the sentence that the row, or the command, gave about it.
        others: number of other cases.
        others_arrived: number of them that gave their result in spite of it.
        stored: number of sound results after it, with those from before.
        kept: number of these that the next run left untouched.
        missing: number of results that the next run had to make.
        recomputed: number of results that it made.
        problem: why it is not contained; empty if it is.
        hung: True if the drill itself hangs because of it, so that a thread of it may never end.
    """

    fault: str
    contained: bool
    said: str
    others: int
    others_arrived: int
    stored: int
    kept: int
    missing: int
    recomputed: int
    problem: str
    hung: bool = False


def drilled(
    fault: str,
    said: str,
    *,
    expected: str,
    others: Sequence[bool],
    before: Mapping[str, str],
    after: Mapping[str, str],
    again: Mapping[str, str],
    missing: int,
    problems: Mapping[str, bool],
) -> Drilled:
    """The verdict.

    Args:
        fault: fault on purpose.
        said: message about it.
        expected: words that must be in it.
        others: for every other case whether its result arrived.
        before: hashes of the sound results by key, before the fault.
        after: likewise, after it.
        again: likewise, after the next run.
        missing: number of results that the next run had to make.
        problems: further sentences, each with whether it applies.
    """
    kept = sum(again.get(key) == content for key, content in after.items())
    recomputed = sum(after.get(key) != content for key, content in again.items())
    found = {
        f"what was said is not one sentence with {expected!r}": expected not in said or len(said.splitlines()) != 1,
        "another case's result did not arrive": not all(others),
        "a stored result was lost or changed": any(after.get(key) != content for key, content in before.items()),
        "the next run lost or changed a result": kept != len(after),
        f"the next run made {recomputed} results instead of {missing}": recomputed != missing,
        **problems,
    }
    problem = "; ".join(sentence for sentence, applies in found.items() if applies)
    arrived = sum(others)
    return Drilled(
        fault, not problem, said, len(others), arrived, len(after), kept, missing, recomputed, problem=problem
    )
