"""Parts of a ball's model that the ladder of models can leave out or add."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from proofroll.core.element import OptionalTerm
from proofroll.elements.ball_on_surface.model import BallCapability

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.ball_on_surface.element import BallOnSurface

# Rolling resistance f, in radii, added to a scene without any to see the cost of the term (Blajer 2006, figure 5).
_RESISTANCE = 0.02
# Factor on the friction that rolling needs, for a bound that is never reached.
_FAR = 10.0


def optional_terms(element: BallOnSurface, parameters: Mapping[str, float], truth: xr.Dataset) -> list[OptionalTerm]:
    """Rolling resistance, bounded friction and orientation; see :class:`proofroll.core.element.Element`."""
    terms: list[OptionalTerm] = []
    if "rolling_resistance" in parameters:
        f = element.contact.rolling_resistance or _RESISTANCE * element.ball.radius
        because = (
            "the scene has it" if element.contact.rolling_resistance else f"the scene has none; here with f = {f:g} m"
        )
        put, taken = {"rolling_resistance": f}, {"rolling_resistance": 0.0}
        terms.append(OptionalTerm("rolling resistance", because, put, taken))
    if "mu_static" in parameters:
        unbounded = dict.fromkeys((n for n in ("mu_static", "mu_kinetic") if n in parameters), math.inf)
        if math.isfinite(element.contact.mu_static):
            terms.append(OptionalTerm("bounded friction", "the scene bounds it", {}, unbounded))
        else:
            far = _FAR * (float(np.nanmax(truth["needed_friction"].to_numpy())) or 1.0)
            because = f"the scene has no bound; here one of {far:.3g}, {_FAR:g} times what rolling needs"
            terms.append(OptionalTerm("bounded friction", because, dict.fromkeys(unbounded, far)))
    because, need = "nothing else depends on it", BallCapability.ORIENTATION
    return [*terms, OptionalTerm("orientation asked", because, asks=("orientation",), capability=need)]
