"""A run of drills ends with a table of its searches: what each has drawn and found, with the example or the seed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PLUGINS = Path(__file__).resolve().parents[1] / "plugins"
SEARCHES = """
import pytest
from hypothesis import given, settings
from hypothesis.strategies import integers

@given(integers(0, 100))
@settings(max_examples=30, database=None, derandomize=True)
def test_small(number):
    assert number < 90

@given(integers(0, 100))
@settings(max_examples=20, database=None, derandomize=True)
def test_holds(number):
    assert number <= 100

@pytest.mark.parametrize("seed", range(5))
def test_seeds(seed):
    assert seed != 3, "the third is wrong"

def test_no_search():
    assert True
"""


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What a run of these tests prints, by the marks that it is asked for."""
    folder = tmp_path_factory.mktemp("searches")
    (folder / "test_searches.py").write_text("import pytest\npytestmark = pytest.mark.drill\n" + SEARCHES)
    (folder / "pytest.ini").write_text("[pytest]\nmarkers = drill: it takes long\n")
    environment = os.environ | {"PYTHONPATH": str(PLUGINS), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    words = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "found",
        "-p",
        "_hypothesis_pytestplugin",
        "-p",
        "no:cacheprovider",
    ]
    return {
        marks: subprocess.run(
            [*words, "-m", marks], cwd=folder, env=environment, capture_output=True, text=True, check=False
        ).stdout
        for marks in ("drill", "not slow")
    }


@pytest.mark.nightly
def test_each_search_has_a_line_and_each_finding_one(printed: dict[str, str]) -> None:
    """The table counts what was drawn and found; below a search stand its findings, with example or seed."""
    table = printed["drill"].partition(" searches ")[2].partition("short test summary")[0].splitlines()
    rows = [line.split() for line in table if "::" in line]
    assert ["20", "0", "test_searches.py::test_holds"] in rows
    (small,) = [row for row in rows if row[2].endswith("test_small")]
    assert int(small[0]) > 1
    assert small[1] == "1"
    assert ["5", "1", "test_searches.py::test_seeds"] in rows
    assert any("test_small: test_small( number=90, )" in line for line in table)
    assert any("test_seeds[3]: seed 3: AssertionError: the third is wrong" in line for line in table)
    assert not any("test_no_search" in line for line in table)


def test_a_quick_run_has_no_table(printed: dict[str, str]) -> None:
    """Where no drills were asked for nothing is printed."""
    assert " searches " not in printed["not slow"]
