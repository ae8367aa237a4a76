"""The surface of the centre of a ball on a surface of revolution, from the profile curve alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import InputError
from proofroll.elements.ball_on_surface.surfaces.formula import sqrt
from proofroll.elements.ball_on_surface.surfaces.jet import Jet, variables
from proofroll.elements.ball_on_surface.surfaces.revolved import Revolved


@dataclass(frozen=True)
class Parallel(Revolved):
    """All places at one distance from a surface of revolution; coordinates are those of the nearest point of it.

    Attributes:
        of: the surface.
        apart: the distance [m], on the side where balls are.
    """

    of: Revolved
    apart: float

    def __post_init__(self) -> None:
        """Takes over what the surface says of itself.

        Raises:
            InputError: somewhere the surface is curved more than a ball of this radius.
        """
        for said in ("name", "kind", "coordinates", "units", "periods"):
            object.__setattr__(self, said, getattr(self.of, said))
        bends = float(np.linalg.eigvalsh(self.of.normal_gradient(self.of.position(self.of.places()))).max())
        if not bends * self.apart < 1:
            raise InputError(
                "radius", self.apart, f"the ball must be smaller than {self.name}'s curve, {1 / bends:g} m"
            )

    @property
    def extent(self) -> tuple[float, float]:
        """See :class:`Revolved`."""
        return self.of.extent

    @property
    def knows_distance(self) -> bool:
        """See :class:`Declared`."""
        return self.of.knows_distance

    def offset(self, ball_radius: float) -> Parallel:
        """See :class:`Surface`."""
        return Parallel(self.of, self.apart + ball_radius)

    def profile(self, s: Any) -> tuple[Any, Any]:
        """See :class:`Revolved`: along the normal of the curve, by its derivatives."""
        r, z = self.of.profile(variables(s)[0])
        r_slope, z_slope = (_slope(part) for part in (r, z))
        by = self.apart / sqrt(r_slope * r_slope + z_slope * z_slope)
        return _value(r) - z_slope * by, _value(z) + r_slope * by

    def away(self, r: Any, z: Any) -> Any:
        """See :class:`Revolved`."""
        return self.of.away(r, z) - self.apart

    def along(self, r: FloatArray, z: FloatArray) -> FloatArray:
        """See :class:`Revolved`."""
        return self.of.along(r, z)


def _value(part: Any) -> Any:
    return part.value if isinstance(part, Jet) else part


def _slope(part: Any) -> Any:
    return part.first[0] if isinstance(part, Jet) else 0.0
