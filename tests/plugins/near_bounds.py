"""List of bounds by ``approx``, ``assert_allclose`` and ``<`` within a factor of ten of the observed difference.

``python -m pytest -p near_bounds tests/unit/truth`` prints them at the end, the nearest first: on another processor a
bound near round-off may be crossed (see tests/drill/README.md). Bounds by ``<`` need
``-o enable_assertion_pass_hook=true`` and tests that are compiled anew.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

_NEAR = 0.1
# Relative bounds above this concern errors of a method, not round-off.
_ROUND_OFF = 1e-6
_NUMBER = r"(?<![\w.])(?:np\.float64\()?([-+]?\d+\.?\d*(?:e[-+]?\d+)?)\)?"
_ORDERED = re.compile(rf"{_NUMBER} (?:<=?|(>=?)) {_NUMBER}")
_Approx: Any = type(pytest.approx(1.0))  # what it makes of each number
seen: dict[str, tuple[float, float]] = {}  # by place: difference over bound, and bound over value


def note(found: Any, expected: Any, bound: Any) -> None:
    """Records a comparison under the line of the test that makes it."""
    found, expected, bound = (np.asarray(item, dtype=float) for item in (found, expected, bound))
    with np.errstate(all="ignore"):
        ratio = np.nan_to_num(np.abs(found - expected) / bound, nan=0.0, posinf=0.0)
        size = float(np.max(np.maximum(np.abs(expected), bound), initial=0.0))
    inside = np.where(ratio <= 1.0, ratio, 0.0)  # values beyond the bound differ on purpose
    part = float(np.max(bound, initial=0.0)) / size if size else 1.0
    frame: Any = sys._getframe(1)
    while frame and ("/tests/" not in frame.f_code.co_filename or frame.f_code.co_filename == __file__):
        frame = frame.f_back
    if frame and part < _ROUND_OFF:
        place = f"tests/{frame.f_code.co_filename.partition('/tests/')[2]}:{frame.f_lineno}"
        seen[place] = max(seen.get(place, (0.0, 0.0)), (float(np.max(inside, initial=0.0)), part))


def near() -> list[tuple[str, float, float]]:
    """Near bounds, the nearest first: place, difference over bound, bound over value."""
    found = [(place, *numbers) for place, numbers in seen.items() if numbers[0] > _NEAR]
    return sorted(found, key=lambda item: -item[1])


def _noted_equal(self: Any, actual: Any) -> bool:
    if isinstance(actual, int | float | np.number) and isinstance(self.expected, int | float | np.number):
        note(actual, self.expected, self.tolerance)
    return bool(_equal(self, actual))


def _noted_allclose(actual: Any, desired: Any, rtol: float = 1e-7, atol: float = 0.0, **more: Any) -> None:
    note(actual, desired, atol + rtol * np.abs(np.asarray(desired, dtype=float)))
    _allclose(actual, desired, rtol, atol, **more)


_equal, _allclose = _Approx.__eq__, np.testing.assert_allclose


def pytest_assertion_pass(item: pytest.Item, lineno: int, expl: str) -> None:
    """Records an assertion ``value < bound`` between two numbers; the bound counts as relative to 1."""
    found = _ORDERED.search(expl.partition("\n")[0])
    if found:
        one, other = abs(float(found[1])), abs(float(found[3]))
        small, bound = (other, one) if found[2] else (one, other)
        if 0 < bound < _ROUND_OFF:
            place = f"{item.location[0]}:{lineno}"
            seen[place] = max(seen.get(place, (0.0, 0.0)), (small / bound, bound))


@pytest.hookimpl(wrapper=True)
def pytest_sessionstart() -> Iterator[None]:
    """Patches ``approx`` and ``assert_allclose`` so that they record their comparisons."""
    _Approx.__eq__ = _noted_equal
    np.testing.assert_allclose = _noted_allclose
    return (yield)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Prints the list of near bounds."""
    terminalreporter.section("bounds within a factor of ten of what is seen")
    for place, ratio, part in near():
        terminalreporter.line(f"{place}: {ratio:.2f} of its bound, which is {part:.1g} of the value")
