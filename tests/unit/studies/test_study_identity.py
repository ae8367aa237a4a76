"""What a stored study is held against."""

from __future__ import annotations

from pathlib import Path

import pytest

from proofroll.running.environments import STAMP, VARIABLE, Environment
from proofroll.running.timing import machine
from proofroll.studies import study_identity


def test_nothing_has_changed_since_now() -> None:
    """What was measured here with this code still holds."""
    assert study_identity.changes(study_identity.measured()) == []


def test_engines_are_among_the_versions() -> None:
    """Every engine's package is told with its version, without importing it."""
    assert {"proofroll", "mujoco", "exudyn", "pin", "numpy", "scipy"} <= study_identity.versions().keys()


def test_an_environment_that_was_made_anew_is_a_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same label with other packages outdates a study; a further label, or one that is gone, does not."""
    monkeypatch.setenv(VARIABLE, str(tmp_path))

    def make(label: str, *packages: str) -> None:
        (tmp_path / "aged" / label).mkdir(parents=True, exist_ok=True)
        Environment("aged", label, tmp_path / "aged" / label, "1.0", [], "3.11", list(packages)).stamp()

    make("1.0", "numpy==2.0")
    before = study_identity.measured()
    make("2.0", "numpy==2.0")
    assert study_identity.changes(before) == []
    make("1.0", "numpy==2.1")
    (change,) = study_identity.changes(before)
    assert change.startswith("aged@1.0 ")
    (tmp_path / "aged" / "1.0" / STAMP).unlink()
    assert study_identity.changes(before) == []


def test_each_change_is_told() -> None:
    """Another machine, another version, a package that is gone and other code are each one short text."""
    other = study_identity.changes(
        study_identity.Measured(
            "then",
            machine() | {"processor": "an abacus"},
            {name: v for name, v in study_identity.versions().items() if name != "mujoco"} | {"numpy": "1.0"},
            "0",
        )
    )
    assert len(other) == 4
    text = "; ".join(other)
    for words in ("processor an abacus then", "mujoco absent then", "numpy 1.0 then", "own code has changed"):
        assert words in text


def test_code_of_a_plug_in_is_among_the_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study does not outlive the code of an engine's package, edited without a new version; nothing imports it."""
    package = tmp_path / "edited_engine"
    (package / "inside").mkdir(parents=True)
    (package / "__init__.py").write_text("raise RuntimeError('imported')")
    info = tmp_path / "edited-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: edited\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[proofroll.engines]\nedited = edited_engine.adapter:Engine\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    before = study_identity.measured()
    assert study_identity.changes(before) == []
    (package / "inside" / "method.py").write_text("order = 1")
    (change,) = study_identity.changes(before)
    assert change.startswith("code of edited_engine ")
