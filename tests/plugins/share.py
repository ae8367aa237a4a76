"""A share of the cases of a test, spread over all; as a plug-in of pytest it leaves four of five cases to the night.

As a plug-in it serves tests of packages, which know no marks of this repository: ``pytest -p share``.
"""

from __future__ import annotations

from collections import Counter

import pytest

# Golden ratio, without its whole part.
_GOLDEN = (5**0.5 - 1) / 2
# Of how many cases of a package's test one runs before a change lands.
_COUNT = 5


def is_of_the_day(place: int, count: int) -> bool:
    """True for one case in ``count``, by its place among the cases of its test; for the first one always.

    Multiples of the golden ratio are spread evenly, and fall in step with no parameter that returns every few cases.
    """
    return place * _GOLDEN % 1 < 1 / count


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Keeps the share of each test, of the cases that marks have left."""
    places = Counter[str]()
    kept, left = list[pytest.Item](), list[pytest.Item]()
    for item in items:
        function = item.nodeid.partition("[")[0]
        (kept if is_of_the_day(places[function], _COUNT) else left).append(item)
        places[function] += 1
    items[:] = kept
    config.hook.pytest_deselected(items=left)
