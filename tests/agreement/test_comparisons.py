"""Every row of every comparison, at one point of its parameters, on the real engines."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

from proofroll.comparison_file import Comparison, Row, comparison_names, load_comparison
from proofroll.runner import Runner
from proofroll.store import Store
from proofroll.studies.compare import compare

ROWS = [
    pytest.param(comparison, row, id=f"{comparison.name}-{row.engine}")
    for comparison in map(load_comparison, comparison_names())
    for row in comparison.rows
]


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    """One store for all processes of the test run: equal cases of different comparisons run once."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if base.name.startswith("popen-") else base
    return Store(Path(shared) / "agreement")


@pytest.mark.slow
@pytest.mark.parametrize(("comparison", "row"), ROWS)
def test_row_is_as_the_comparison_expects(comparison: Comparison, row: Row, store: Store) -> None:
    """At the combination of parameters in the middle of the list, the verdicts are those that the file states."""
    points = comparison.variations(row)
    middle = points[len(points) // 2]
    single = dataclasses.replace(comparison, rows=[row], vary={}, points=[dict(middle)])

    outcome = compare(single, Runner(store, jobs=1))

    assert outcome.contradictions == []
    assert outcome.lost == []
