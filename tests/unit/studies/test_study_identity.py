"""What a stored study is held against."""

from __future__ import annotations

from proofroll.running.timing import machine
from proofroll.studies import study_identity as installed


def measured() -> dict[str, object]:
    """A study that was made here and now."""
    return {"machine": machine(), "versions": installed.versions(), "code": installed.code()}


def test_nothing_has_changed_since_now() -> None:
    """What was measured here with this code still holds."""
    assert installed.changes(measured()) == []


def test_engines_are_among_the_versions() -> None:
    """Every engine's package is told with its version, without importing it."""
    assert {"proofroll", "mujoco", "exudyn", "pin", "numpy", "scipy"} <= installed.versions().keys()


def test_each_change_is_told() -> None:
    """Another machine, another version, a package that is gone and other code are each one short text."""
    now = measured()
    other = installed.changes(
        {
            "machine": machine() | {"processor": "an abacus"},
            "versions": {name: v for name, v in installed.versions().items() if name != "mujoco"} | {"numpy": "1.0"},
            "code": "0",
        }
    )
    assert len(other) == 4
    text = "; ".join(other)
    for words in ("processor an abacus then", "mujoco absent then", "numpy 1.0 then", "own code has changed"):
        assert words in text
    assert installed.changes({**now, "machine": None}) != []
