"""Sparse elimination of linear systems in any scalars, as expressions of heyoka."""

from collections.abc import Sequence, Set

from proofroll.truth.numerics.scalars import Scalar, add, is_zero, mul, sub

Row = dict[int, Scalar]  # column -> value


def eliminated(
    rows: Sequence[Row],
    rights: Sequence[Sequence[Scalar]],
    after: Sequence[Set[int]] | None = None,
    *,
    symmetric: bool = False,
) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Solutions x of A x = b for each right side b, and the pivot of each unknown, on the diagonal.

    Args:
        rows: of A.
        rights: right sides.
        after: unknowns that must be eliminated before each. First are those that wait for none, then those with the
            fewest neighbours. None: the order is as given.
        symmetric: A is; half of the operations suffice.
    """
    pivots: list[Scalar] = [0.0] * len(rows)
    left, sides = {k: dict(row) for k, row in enumerate(rows)}, [list(side) for side in rights]
    steps = list[tuple[int, Row]]()
    while left:
        ready = left if after is None else [k for k in left if left.keys().isdisjoint(after[k])]
        p = next(iter(left)) if after is None else min(ready, key=lambda k: (bool(after[k]), len(left[k]), k))
        row = left.pop(p)
        pivots[p] = row.pop(p)
        lost, others = -pivots[p], [i for i, entries in left.items() if p in entries]
        for i in others:
            if is_zero(value := left[i].pop(p)):
                continue
            factor = value / lost
            for j, entry in row.items():
                if not symmetric or j <= i:
                    left[i][j] = add(left[i].get(j, 0.0), mul(factor, entry))
                    if symmetric:
                        left[j][i] = left[i][j]
            for side in sides:
                side[i] = add(side[i], mul(factor, side[p]))
        steps.append((p, row))
    for side in sides:
        for p, row in reversed(steps):
            for j, entry in row.items():
                side[p] = sub(side[p], mul(entry, side[j]))
            side[p] = 0.0 if is_zero(side[p]) else side[p] / pivots[p]
    return sides, pivots
