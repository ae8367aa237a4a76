"""Parts of a ball's model that the ladder of models can leave out or add."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from proofroll.core.element import OptionalTerm
from proofroll.elements.ball_on_surface.model import BallCapability

if TYPE_CHECKING:
    from proofroll.elements.ball_on_surface.element import BallOnSurface

# Rolling resistance f, in radii, added to a scene without any to see the cost of the term (Blajer 2006, figure 5).
_RESISTANCE = 0.02


def optional_terms(element: BallOnSurface, parameters: Mapping[str, float]) -> list[OptionalTerm]:
    """Rolling resistance and orientation; see :class:`proofroll.core.element.Element`."""
    terms: list[OptionalTerm] = []
    if "rolling_resistance" in parameters:
        f = element.contact.rolling_resistance or _RESISTANCE * element.ball.radius
        because = (
            "the scene has it" if element.contact.rolling_resistance else f"the scene has none; here with f = {f:g} m"
        )
        put, taken = {"rolling_resistance": f}, {"rolling_resistance": 0.0}
        terms.append(OptionalTerm("rolling resistance", because, put, taken))
    because, need = "nothing else depends on it", BallCapability.ORIENTATION
    return [*terms, OptionalTerm("orientation asked", because, asks=("orientation",), capability=need)]
