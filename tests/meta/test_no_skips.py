"""Where everything must be installed, a test that is skipped for what is not there fails."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

PLUGINS = Path(__file__).parents[1] / "plugins"
TESTS = {
    "test_module.py": "import pytest\npytest.importorskip('no_such_engine')\ndef test_it(): pass\n",
    "test_inside.py": "import pytest\ndef test_it(): pytest.importorskip('no_such_engine')\n",
    "test_marked.py": "import pytest\n@pytest.mark.skipif(True, reason='no browser')\ndef test_it(): pass\n",
    "test_check.py": "import unittest\ndef test_it(): raise unittest.SkipTest('there is no fixed step')\n",
    "test_root.py": "import pytest\ndef test_it(): pytest.skip('root may write anywhere')\n",
}


@pytest.mark.drill
def test_what_is_lacking_fails_where_it_must_be_there(tmp_path: Path) -> None:
    """An engine or a browser that is lacking skips on a person's machine, and fails where no skip is allowed."""
    for name, text in TESTS.items():
        (tmp_path / name).write_text(text)
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no_skips", "-p", "no:cacheprovider", "-rA", "."]
    command.append("--continue-on-collection-errors")
    said = {}
    for value in ("", "1"):
        environment = os.environ | {"PYTHONPATH": str(PLUGINS), "PROOFROLL_NO_SKIPS": value}
        environment["PYTEST_DISABLE_PLUGIN_AUTOLOAD"] = "1"  # to load them takes longer than the tests
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
        said[value] = done.stdout.splitlines()
    assert said[""][-1].startswith("5 skipped")
    assert said["1"][-1].startswith("1 failed, 2 skipped, 2 errors")
    lost = {line.split()[1].partition("::")[0] for line in said["1"] if line.startswith(("FAILED", "ERROR "))}
    assert lost == {"test_module.py", "test_inside.py", "test_marked.py"}
