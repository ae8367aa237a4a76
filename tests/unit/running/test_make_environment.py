"""Packages of engines in a checkout of the source, found by the names of their engines and installed."""

from __future__ import annotations

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from proofroll.core.errors import InputError, ProofrollError
from proofroll.running import make_environment
from proofroll.running.make_environment import install

ROOT = Path(__file__).resolve().parents[3]


def test_each_package_is_found_by_its_engine() -> None:
    """Each folder of examples/engines announces an engine, by which it is found; elsewhere there is none."""
    found = make_environment.example_packages(ROOT)
    assert set(found.values()) == set((ROOT / "examples" / "engines").iterdir())
    assert found["mujoco_warp"].name == "proofroll-mujoco-warp"
    assert make_environment.example_packages(ROOT / "tests") == {}


def test_a_package_is_installed_by_its_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pip gets the folder for this Python, and the engine is started once to tell its version."""
    calls: list[list[str]] = []
    monkeypatch.setattr(make_environment, "output_of", calls.append)
    monkeypatch.setattr(make_environment, "describe", lambda name: SimpleNamespace(version=f"9 of {name}"))
    assert install("rapier", {"rapier": ROOT}) == (f"9 of rapier@{sys.executable}", ROOT)
    assert calls == [[sys.executable, "-m", "pip", "install", "--quiet", str(ROOT)]]


@pytest.mark.parametrize(("packages", "advice"), [({"rapier": ROOT}, "choose one of rapier"), ({}, "a checkout of")])
def test_an_engine_without_a_package_is_refused(packages: dict[str, Path], advice: str) -> None:
    """The line names what there is to choose, or where more can be had."""
    with pytest.raises(InputError, match=f"engine = 'chrono'.*{advice}.*--requirement"):
        install("chrono", packages)


@pytest.mark.nightly
def test_a_package_that_pip_refuses_says_why(tmp_path: Path) -> None:
    """A package for another Python is refused in pip's own words."""
    project = '[project]\nname = "none"\nversion = "1"\nrequires-python = "<3"\n'
    (tmp_path / "pyproject.toml").write_text(project, encoding="utf-8")
    with pytest.raises(ProofrollError, match="requires a different Python"):
        install("none", {"none": tmp_path})
