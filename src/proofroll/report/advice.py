"""What to use: for several tolerances of several quantities the cheapest choice that a trade-off has, and why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from proofroll.core.comparison import Tolerance
from proofroll.report.tradeoff_tables import default_quantities
from proofroll.studies.recommend import recommend
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


def advice(study: Mapping[str, Any], claims: TradeoffClaims | None) -> list[dict[str, Any]]:
    """The answers of :func:`proofroll.studies.recommend.recommend`, each with the part of the scale it was asked for.

    What is the same in all of them, the range and the circumstances, is left to the study.
    """
    found = []
    for wish in wishes(study, claims):
        answer = recommend(study, wish)
        relative = wish.tolerance.value if wish.tolerance.relative else None
        same = {"checked", "measured", "scene", "parameters", "budget", "affordable", "best_within_budget"}
        found.append({"relative": relative} | {key: value for key, value in answer.items() if key not in same})
    return found
