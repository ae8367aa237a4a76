"""What to use: for several tolerances of several quantities the cheapest choice that a trade-off has, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from proofroll.core.comparison import Tolerance
from proofroll.files.json_data import MERGED
from proofroll.report.tradeoff_tables import default_quantities
from proofroll.studies.recommend import Answer, recommend
from proofroll.studies.wish import Wish

if TYPE_CHECKING:
    from proofroll.studies.claims import TradeoffClaims

# Parts of its scale to which a quantity is wanted where nobody says otherwise: what an eye sees, an engineer needs, a
# reference is made from, and what tells the orders of methods apart.
PARTS = (1e-2, 1e-3, 1e-4, 1e-6)


def wishes(study: Mapping[str, Any], claims: TradeoffClaims | None) -> list[Wish]:
    """What a report asks of a trade-off.

    Args:
        study: as :func:`proofroll.studies.tradeoff_content.content` has it.
        claims: their tolerances are those of the study's own quantity.
    """
    own = list({claim.tolerance.value: claim.tolerance for claim in claims.cheapest}.values()) if claims else []
    found = []
    for name in default_quantities(dict(study)):
        if study["quantities"][name]["scale"] is None:
            continue  # a part of nothing
        parts = [Tolerance(part, True) for part in PARTS]
        found += [Wish(name, tolerance) for tolerance in (own if own and name == study["quantity"] else parts)]
    return found


@dataclass(frozen=True)
class Advice:
    """An answer with the part of the scale that was asked for; None: it was asked for in the quantity's unit.

    What is the same in all of them, the range and the circumstances, is left to the study.
    """

    relative: float | None
    answer: Answer = field(metadata=MERGED)


def advice(study: Mapping[str, Any], claims: TradeoffClaims | None) -> list[Advice]:
    """The answers of :func:`proofroll.studies.recommend.recommend` to all wishes."""
    return [
        Advice(wish.tolerance.value if wish.tolerance.relative else None, recommend(study, wish).answer)
        for wish in wishes(study, claims)
    ]
