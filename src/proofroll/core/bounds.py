"""Bounds on the numbers of a model, checked when it is made."""

import math
from collections.abc import Sequence

from proofroll.core.errors import InputError

# Larger numbers have cubes (volumes) beyond the range of doubles, 1.8e308.
LARGEST = 1e100

# Density of osmium, the densest material, and of an aerogel, lighter than air between its solids [kg/m³].
DENSEST, LIGHTEST = 22600.0, 0.1


def require_usable(field: str, value: object) -> None:
    """Raises InputError for a finite number whose cube would overflow; other values pass."""
    if isinstance(value, (int, float)) and LARGEST < abs(value) < math.inf:
        raise InputError(field, value, f"its size is beyond {LARGEST:g}, so its cube overflows; give a smaller one")


class OutOfBounds(InputError, ValueError):  # noqa: N818 -- says what is wrong, as the other errors do
    """A number outside the bounds of a model; a ValueError too, so that pydantic adds its location in the file."""


def require_bounds(
    name: str, value: float, *, above: float = -math.inf, at_least: float = -math.inf, unbounded: bool = False
) -> None:
    """Raises OutOfBounds for a number that is nan, infinite (unless ``unbounded``) or too small."""
    if math.isnan(value) or (math.isinf(value) and not (unbounded and value > 0)):
        raise OutOfBounds(name, value, "the value must be a number" + ("" if unbounded else ", and finite"))
    if not unbounded and value <= above:
        raise OutOfBounds(name, value, f"the value must be above {above:g}")
    if value < at_least:
        raise OutOfBounds(name, value, f"the value must be at least {at_least:g}")


def require_pair(field: str, pair: Sequence[float]) -> None:
    """Raises InputError unless the pair is [low, high] with low <= high."""
    if len(pair) != 2 or not pair[0] <= pair[1]:
        raise InputError(field, list(pair), "write [low, high]")
