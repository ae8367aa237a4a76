"""A reader of scene files of the drill's own: numbers of a mechanism from the text, apart from proofroll's reader.

It takes nothing of the package but the evaluator of formulas of the checks, which the reader does not take.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from proofroll.truth.check.laws.signals import formula, value_of

MODELS = Path(__file__).parents[3] / "models"
SECTIONS = (
    "bodies",
    "joints",
    "loops",
    "springs",
    "bushings",
    "forces",
    "points",
    "geometries",
    "pairs",
    "actuators",
    "couplings",
)
# Keys that the loops of a mechanism decide, or that are no numbers of the part of that name.
_FOUND = {"name", "kind", "index", "from", "count", "dependent", "at_most", "lead", "rest_length"}
_UNITS: Mapping[str, float] = {
    "deg": math.pi / 180, "deg/s": math.pi / 180, "rpm": 2 * math.pi / 60, "mm": 0.001, "cm": 0.01, "km": 1000.0,
    "g": 0.001, "ms": 0.001, "min": 60.0, "h": 3600.0, "kN": 1000.0, "mN": 0.001, "km/h": 1000.0 / 3600.0,
    "mm/s": 0.001, "cm/s": 0.01, "N mm": 0.001, "N cm": 0.01, "kN m": 1000.0, "kJ": 1000.0, "mJ": 0.001,
}  # fmt: skip
_MEASURED = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\D.*)?")
TIMES = np.array([[0.0, 0.07, 0.31, 0.9]])
_MOST = 1e300  # stands for a number without bound
_DIGITS = 1e-13  # part of a number by which two readings of it may differ


def numbers_of(content: Mapping[str, Any]) -> dict[str, float]:
    """Parameters of a scene file in SI units."""
    found: dict[str, float] = {}
    for name, entry in content.get("parameters", {}).items():
        value = entry["value"] if isinstance(entry, Mapping) else entry
        # the value of a parameter may be a formula of those before it, without a sign
        number = float(formula(value, found)) if isinstance(value, str) and not _MEASURED.fullmatch(value) else value
        number = value_in(number, found)
        factor = _UNITS.get(str(entry.get("unit", "1")), 1.0) if isinstance(entry, Mapping) else 1.0
        found[name] = number * factor
    return found


def value_in(value: Any, numbers: Mapping[str, float]) -> Any:
    """Number that a value of a file means: itself, a parameter, a formula of these, or a number with a unit."""
    if isinstance(value, list):
        return [value_in(item, numbers) for item in value]
    if not isinstance(value, str):
        return value
    if value.startswith("$"):
        return numbers[value[1:]]
    if value.startswith("="):
        return float(formula(value[1:], numbers))
    measured = _MEASURED.fullmatch(value)
    if measured is None:
        raise KeyError(value)
    return float(measured[1]) * _UNITS.get((measured[2] or "").strip(), 1.0)


def _tables(
    content: Mapping[str, Any], numbers: Mapping[str, float]
) -> Iterator[tuple[str, Mapping[str, Any], dict[str, float]]]:
    """Section, table and the numbers that it may name, of each table and of each repetition of one."""
    for section in SECTIONS:
        for table in content.get(section, []):
            yield section, table, dict(numbers)
    for repeat in content.get("repeat", []):
        begin = int(value_in(repeat.get("from", 0), numbers))
        for turn in range(begin, begin + int(value_in(repeat["count"], numbers))):
            names = dict(numbers) | {repeat.get("index", "i"): float(turn)}
            for section in SECTIONS:
                for table in repeat.get(section, []):
                    yield section, _named(table, repeat.get("index", "i"), turn), names


def _named(value: Any, index: str, turn: int) -> Any:
    """Table with the number of a repetition in its texts."""
    if isinstance(value, Mapping):
        return {key: _named(item, index, turn) for key, item in value.items()}
    if isinstance(value, list):
        return [_named(item, index, turn) for item in value]
    if not isinstance(value, str):
        return value
    return re.sub(r"\{" + index + r"([-+]\d+)?\}", lambda found: str(turn + int(found[1] or 0)), value)


def misread(scene: str, mechanism: Any) -> tuple[list[str], int]:
    """Fields of a mechanism that are not what its file says, and the number of fields that were compared.

    Signals are compared at four times. A joint whose place the loops find, and a part that stands for several, is not
    compared. Gravity is, by its size and direction.
    """
    content = tomllib.loads((MODELS / scene / "scene.toml").read_text(encoding="utf-8"))
    numbers, wrong, count = numbers_of(content), list[str](), 1
    pull = content.get("gravity", {})
    down = np.array(value_in(pull.get("direction", [0, 0, -1]), numbers), float)
    size = float(value_in(pull.get("magnitude", 9.80665), numbers))
    if not _same(size * down / np.linalg.norm(down), mechanism.gravity):
        wrong.append("gravity")
    for section, table, names in _tables(content, numbers):
        part = next((item for item in getattr(mechanism, section) if item.name == table.get("name")), None)
        if part is None or str(table.get("kind", part.__dict__.get("kind"))) != str(part.__dict__.get("kind")):
            continue
        for key, said in table.items():
            started = key in {"q0", "v0"} and (table.get("dependent") or mechanism.loops)
            if key in _FOUND or started or not hasattr(part, key):
                continue
            compared = _is_read(key, said, getattr(part, key), names)
            count += compared is not None
            if compared is False:
                wrong.append(f"{section}.{part.name}.{key}")
    return wrong, count


def _is_read(key: str, said: Any, read: Any, numbers: Mapping[str, float]) -> bool | None:
    """True if a field is what a file says; None: it is no number."""
    parts = read if isinstance(said, list) and isinstance(read, tuple) else (read,)
    if any(hasattr(part, "text") or hasattr(part, "times") for part in parts):
        pairs = zip(said, parts, strict=True) if len(parts) > 1 else [(said, read)]
        return all(_signal_is_read(*pair, numbers) for pair in pairs)
    try:
        wanted = np.array(value_in(said, numbers), float)
    except (KeyError, ValueError, TypeError):
        return None
    value = np.array(read, float)
    if key == "inertia" and wanted.shape == (3,):
        wanted = np.diag(wanted)
    if "axis" in key or key == "normal":
        wanted, value = wanted / np.linalg.norm(wanted), value / np.linalg.norm(value)
    if key == "q0" and wanted.shape in {(4,), (7,)}:
        wanted[-4:] /= np.linalg.norm(wanted[-4:])
    return _same(wanted, value)


def _signal_is_read(said: Any, read: Any, numbers: Mapping[str, float]) -> bool:
    """True if a number, a formula of the time or a table is what a file says; laws of springs are left out."""
    if hasattr(read, "times"):
        times, values = (value_in(said[key], numbers) for key in ("times", "values"))
        return _same(times, read.times) and _same(values, read.values)
    if not hasattr(read, "text"):
        return _same(value_in(said, numbers), read)
    if not hasattr(read, "at"):
        return True
    wanted = formula(str(said).removeprefix("="), {**numbers, "t": TIMES}) + 0 * TIMES
    return _same(wanted, read.at(TIMES[0]) + 0 * TIMES[0]) and _same(wanted, value_of(read, TIMES))


def _same(wanted: Any, read: Any) -> bool:
    """True if numbers are equal but for their last digits; infinite ones count as numbers."""
    wanted, read = (np.nan_to_num(np.ravel(np.array(values, float)), posinf=_MOST) for values in (wanted, read))
    size = np.abs(wanted).max(initial=0.0)
    return wanted.shape == read.shape and bool((np.abs(wanted - read) <= _DIGITS * size).all())
