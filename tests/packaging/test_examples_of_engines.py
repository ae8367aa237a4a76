"""Packages of engines under ``examples/`` can be tested as their README says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted((ROOT / "examples" / "engines").iterdir())


@pytest.mark.nightly
def test_pytest_takes_a_package_without_our_plugins() -> None:
    """``pytest examples/engines/NAME`` needs pytest alone: no option of proofroll's own tests is asked of it."""
    options = ["-p", "no:timeout", "-p", "no:cacheprovider", "--collect-only"]
    program = "import sys, pytest; sys.exit(any(pytest.main([*sys.argv[2:], one]) == 4 for one in sys.argv[1].split()))"
    named = [str(package.relative_to(ROOT)) for package in PACKAGES]
    command = [sys.executable, "-c", program, " ".join(named), *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert pytest.ExitCode.USAGE_ERROR == 4
    assert done.returncode == 0, done.stderr
    for name in named:
        assert name in (ROOT / name / "README.md").read_text(encoding="utf-8")
