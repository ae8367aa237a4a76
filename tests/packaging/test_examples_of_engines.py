"""Packages of engines under ``examples/`` can be tested as their README says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = sorted((ROOT / "examples" / "engines").iterdir())


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.name)
def test_pytest_takes_a_package_without_our_plugins(package: Path) -> None:
    """``pytest examples/engines/NAME`` needs pytest alone: no option of proofroll's own tests is asked of it."""
    command = [sys.executable, "-m", "pytest", "-p", "no:timeout", "-p", "no:cacheprovider", "--collect-only"]
    done = subprocess.run([*command, str(package)], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode != pytest.ExitCode.USAGE_ERROR, done.stderr
    assert str(package.relative_to(ROOT)) in (package / "README.md").read_text(encoding="utf-8")
