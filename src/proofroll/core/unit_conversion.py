"""Units of other programs, and the factors that convert their numbers to SI."""

import math
import re
from collections.abc import Mapping

_HEADER = re.compile(r"(?P<name>.*?)\s*(?:\[(?P<unit>[^\[\]]*)\]|\s\((?P<other>[^()]*)\))?")

# Other spellings of units, as in files of other programs.
_SPELT: Mapping[str, str] = {
    "sec": "s", "second": "s", "seconds": "s", "radian": "rad", "radians": "rad", "m s-1": "m/s", "rad s-1": "rad/s",
    "meter": "m", "meters": "m", "metre": "m", "metres": "m", "degree": "deg", "degrees": "deg", "°": "deg",
    "deg s-1": "deg/s", "°/s": "deg/s", "Nm": "N m", "N*m": "N m", "Nmm": "N mm", "\u03bcs": "µs", "us": "µs",
}  # fmt: skip
# Unit -> SI unit and the factor to it.
_CONVERTED: Mapping[str, tuple[str, float]] = {
    "deg": ("rad", math.pi / 180), "deg/s": ("rad/s", math.pi / 180), "deg/s^2": ("rad/s^2", math.pi / 180),
    "rpm": ("rad/s", math.pi / 30), "g": ("kg", 1e-3), "km": ("m", 1e3), "cm": ("m", 1e-2), "mm": ("m", 1e-3),
    "cm/s": ("m/s", 1e-2), "mm/s": ("m/s", 1e-3), "km/h": ("m/s", 1 / 3.6), "h": ("s", 3600.0), "min": ("s", 60.0),
    "ms": ("s", 1e-3), "µs": ("s", 1e-6), "kN": ("N", 1e3), "mN": ("N", 1e-3), "kN m": ("N m", 1e3),
    "N cm": ("N m", 1e-2), "N mm": ("N m", 1e-3), "kJ": ("J", 1e3), "mJ": ("J", 1e-3),
}  # fmt: skip

_SI = {"1", "rad", "m", "kg", "s", "N", "J", "W", "Hz"}


def in_si(unit: str) -> tuple[str, float]:
    """SI unit of a unit as another program writes it, and the factor on its numbers; an unknown unit is unchanged."""
    plain = _SPELT.get(unit.strip(), unit.strip())
    return _CONVERTED.get(plain, (plain, 1.0))


def is_known(unit: str) -> bool:
    """True if a text is a unit that is converted, or a product or quotient of powers of SI units, as ``N/s``."""
    plain = _SPELT.get(unit.strip(), unit.strip())
    return plain in _CONVERTED or all(re.sub(r"\^-?\d+$", "", part) in _SI for part in re.split(r"[ /]", plain))


def in_proportion(number: float, factor: float) -> float:
    """Product of a number and a factor, correctly rounded where the factor is one over a whole number."""
    divisor = round(1 / factor)
    return number / divisor if divisor and float(1 / divisor) == factor else number * factor


def name_and_unit(text: str) -> tuple[str, str | None]:
    """Name and unit of a column as a table's header has them: ``q.pivot [rad]``, ``q.pivot[deg]`` or ``theta (deg)``.

    The unit is None if there is none, and ``1`` for an empty one.
    """
    match = _HEADER.fullmatch(text.strip())
    if match is None:
        return text, None
    unit = match["unit"] if match["unit"] is not None else match["other"]
    return match["name"], None if unit is None else unit.strip() or "1"
