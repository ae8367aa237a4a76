"""Finds the coarsest rung of a ladder from which on everything passes, with few and cheap runs."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from operator import attrgetter

from proofroll.studies.failure import RunOutcome


@dataclass
class SearchResult:
    """Result of a search; rungs are numbered from the coarsest.

    Attributes:
        seen: rung -> what a run on it gave.
        limit: the first rung whose run is too long, or the number of rungs.
    """

    seen: dict[int, RunOutcome] = field(default_factory=dict)
    limit: int = 0

    def boundary(self, passes: Callable[[RunOutcome], bool]) -> tuple[int | None, int | None]:
        """The coarsest rung from which on all that ran passed, and the failing rung next to it; None: no such rung.

        A rung that passes above one that fails does not count: a user who refines the step would get worse.
        """
        failing = max((rung for rung, verdict in self.seen.items() if not passes(verdict)), default=None)
        holding = [rung for rung in self.seen if failing is None or rung > failing]
        return min(holding, default=None), failing


def search(size: int, stride: int) -> Generator[int, RunOutcome | None, SearchResult]:
    """Asks for rungs and is sent what a run on each gave; returns what it found.

    It goes down by ``stride`` until a run is accurate and one half a stride below it too: the finest run costs most.
    Then it bisects for either boundary, and last makes sure that the rung below each passes too, for right beside a
    boundary a pass may be luck. What is known is never asked again. A rung for which None is sent, and all finer ones,
    are left out as too long.
    """
    result: SearchResult = SearchResult(limit=size)
    seen = result.seen
    rung, in_a_row = 0, 0
    while rung < result.limit:
        verdict = yield rung
        if verdict is None:
            result.limit = rung
            rung = (max(seen, default=-1) + rung) // 2
            if rung < 0 or rung in seen:
                break
            continue
        seen[rung] = verdict
        in_a_row = in_a_row + 1 if verdict.accurate else 0
        if in_a_row == 2:
            break
        following = rung + ((stride + 1) // 2 if verdict.accurate else stride)
        if following >= result.limit:
            following = (rung + result.limit) // 2
            if following == rung:
                break
        rung = following
    for passes in (attrgetter("stable"), attrgetter("accurate")):
        while (wanted := _next(result, passes)) is not None:
            verdict = yield wanted
            if verdict is None:
                result.limit = min(result.limit, wanted)
            else:
                seen[wanted] = verdict
    return result


def _next(search: SearchResult, passes: Callable[[RunOutcome], bool]) -> int | None:
    """Next rung to run for a boundary; None: the boundary is found."""
    holding, failing = search.boundary(passes)
    if holding is None:
        return None
    coarser = -1 if failing is None else failing
    middle = (coarser + holding) // 2
    wanted = middle if middle > coarser else holding + 1
    return wanted if wanted < search.limit and wanted not in search.seen else None
