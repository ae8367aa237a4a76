"""A test is slow by what it takes itself, not by what it was the first of a process to need."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PLUGINS = Path(__file__).parents[1] / "plugins"
_BUSY = """
import functools, time
def busy(seconds):
    end = time.process_time() + seconds
    while time.process_time() < end: pass
"""
TESTS = {
    "test_slow.py": _BUSY + "def test_it(): busy(0.6)\n",
    "test_first.py": _BUSY + "shared = functools.cache(busy)\ndef test_it(): shared(0.6)\n",
    "test_far.py": _BUSY + "shared = functools.cache(busy)\ndef test_it(): shared(1.2)\n",
    "test_quick.py": "def test_it(): pass\n",
}
# Limits of the plug-in, smaller, and a processor that is as quick as the one they are for.
_CONFTEST = "import dear\ndear.LIMIT, dear.FIRST_USE, dear.LOOP = 0.3, 1.0, 1e9\n"


@pytest.mark.drill
def test_a_first_use_makes_no_test_slow(tmp_path: Path) -> None:
    """What a second run does not take again is no time of a test, unless it is more than a first use may take."""
    for name, text in {**TESTS, "conftest.py": _CONFTEST}.items():
        (tmp_path / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "dear", "-p", "no:cacheprovider", "-m", "not drill", "."]
    environment = os.environ | {"PYTHONPATH": str(PLUGINS), "PROOFROLL_NO_DEAR": "1"}
    environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # to load them takes longer than the tests
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    said = done.stdout
    assert done.returncode == pytest.ExitCode.TESTS_FAILED
    assert "2 without the mark drill took more than 0.3 s" in said
    assert "test_slow.py" in said
    assert "test_far.py" in said
    assert "test_first.py" not in said
