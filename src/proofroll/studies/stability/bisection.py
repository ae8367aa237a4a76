"""Finds the coarsest rung of a ladder from which on all rungs pass, with few and cheap runs."""

from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from operator import attrgetter

from proofroll.studies.failure import RunOutcome


@dataclass
class SearchResult:
    """Result of a search; rungs are numbered from the coarsest.

    Attributes:
        seen: rung -> outcome of its run.
        limit: first rung whose run is too long, or the number of rungs.
    """

    seen: dict[int, RunOutcome] = field(default_factory=dict)
    limit: int = 0

    def boundary(self, passes: Callable[[RunOutcome], bool]) -> tuple[int | None, int | None]:
        """Coarsest rung from which on all runs passed, and the failing rung next to it; None: there is no such rung.

        A rung that passes but is coarser than a failing one does not count: refining its step would make it fail.
        """
        failing = max((rung for rung, verdict in self.seen.items() if not passes(verdict)), default=None)
        holding = [rung for rung in self.seen if failing is None or rung > failing]
        return min(holding, default=None), failing


def search(size: int, stride: int) -> Generator[int, RunOutcome | None, SearchResult]:
    """Generator that yields rungs to run, receives their outcomes, and returns the result.

    It refines by ``stride`` rungs until a run is accurate, and a second one half a stride finer, too; the finest runs
    cost most. Then it bisects for both boundaries, and last runs the rung below each, since a pass right at a boundary
    may be luck. No rung is asked for twice. Sending None means that a rung is too long: it and all finer ones are left
    out.
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
        while (asked := _next(result, passes)) is not None:
            verdict = yield asked
            if verdict is None:
                result.limit = min(result.limit, asked)
            else:
                seen[asked] = verdict
    return result


def _next(search: SearchResult, passes: Callable[[RunOutcome], bool]) -> int | None:
    """Next rung to run for a boundary; None: the boundary is found."""
    holding, failing = search.boundary(passes)
    if holding is None:
        return None
    coarser = -1 if failing is None else failing
    middle = (coarser + holding) // 2
    rung = middle if middle > coarser else holding + 1
    return rung if rung < search.limit and rung not in search.seen else None
