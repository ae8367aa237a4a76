"""The gallery of robots from packages."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from proofroll.core.errors import InputError
from proofroll.robots.check import check
from proofroll.robots.explain import RobotCause
from proofroll.robots.gallery import locate, outcome, read_gallery
from proofroll.robots.meaning import CheckSettings
from proofroll.robots.records import HeldLayer, ImporterRow
from proofroll.running.engine_questions import lent_workers

Proofroll = Callable[..., tuple[int, str, str]]


def test_the_file() -> None:
    """The gallery has at least 25 robots of two formats, fixed and free, each with what is expected of the engines."""
    entries = read_gallery()
    assert len({entry.name for entry in entries}) == len(entries) >= 25
    assert {entry.base for entry in entries} == {"fixed", "free"}
    assert {Path(entry.file).suffix for entry in entries} == {".urdf", ".xml"}
    assert all({"mujoco", "pinocchio", "exudyn", "drake"} <= entry.engines.keys() for entry in entries)


def test_unknown_cause(tmp_path: Path) -> None:
    """A cause that there is not, or a missing field, is refused in one line."""
    path = tmp_path / "robots.toml"
    path.write_text('[[robots]]\nname="r"\npackage="p"\nfile="f"\n[robots.engines]\nmujoco=["no_such_cause"]\n')
    with pytest.raises(InputError, match="choose one of"):
        read_gallery(path)
    path.write_text('[[robots]]\nname="r"\n')
    for text, said in (
        ('[[robots]]\nname="r"\n', r"robots\.toml: robots\.0\.package = 'nothing': this key is required"),
        ("robots = 3", "robots = 3: give a list"),
        ('[[robots]]\nname="r"\npackage="p"\nfile="f"\nengines = { mujoco = 3 }', "engines.mujoco = 3: give a list"),
        ('[[robots]]\nname="r"\npackage="p"\nfile="f"\nbase="x"\nengines = {}', "robots.0.base = 'x'"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=said):
            read_gallery(path)


def test_outcomes() -> None:
    """What an engine does is its causes in order, and whether something stays open."""
    causes = [RobotCause(name, name, "mass", 1.0, 0.0, "", "") for name in "bab"]
    layers = {"mass": HeldLayer(1.0, 0.0, False)}
    row = ImporterRow(engine="one", status="differs", layers=layers, causes=causes, unexplained="bias")
    assert outcome(row) == ["b", "a", "open"]
    assert outcome(ImporterRow(engine="one", status="refused")) == ["refuses"]
    assert outcome(ImporterRow(engine="one", status="timeout")) == ["timeout"]


def test_unknown_robot(proofroll: Proofroll) -> None:
    """A robot that is not in the gallery gives one line."""
    code, _, err = proofroll("robots", "no_such_robot")
    assert code == 2
    assert "choose one of panda" in err


@pytest.mark.parametrize("name", ["z1", "allegro_right_hand", "half_cheetah", "pusher"])
def test_as_expected(proofroll: Proofroll, name: str) -> None:
    """A robot does in our engines what the gallery expects."""
    entry = next(entry for entry in read_gallery() if entry.name == name)
    if locate(entry) is None:
        pytest.skip(f"{entry.package} is not installed: pip install 'proofroll[robots]'")
    code, out, _ = proofroll("robots", name, "--engine", "pinocchio", "--engine", "mujoco", "--json")
    (row,) = json.loads(out)["robots"]
    assert row["unexpected"] == []
    assert code == 0
    assert {"pinocchio", "mujoco"} <= {item["engine"] for item in row["engines"]}


@pytest.mark.drill
@pytest.mark.own_workers
def test_what_was_read_before_changes_nothing() -> None:
    """A gallery reads all robots in one process of an engine: each is found alike, to the last digit, first or last."""
    entries = [entry for entry in read_gallery() if entry.name in {"half_cheetah", "swimmer"}]
    assert len(entries) == 2
    files = {entry.name: locate(entry) for entry in entries}
    for entry in entries:
        if files[entry.name] is None:
            pytest.skip(f"{entry.package} is not installed: pip install 'proofroll[robots]'")
    found: list[dict[str, list[ImporterRow]]] = []
    for order in (entries, entries[::-1]):
        with lent_workers(None) as workers:
            asked = {entry.name: (files[entry.name], entry.base) for entry in order}
            found.append(
                {
                    name: check(path, ["mujoco", "pinocchio", "exudyn"], CheckSettings(base), workers=workers).engines
                    for name, (path, base) in asked.items()
                    if path is not None
                }
            )
    assert list(found[0]) == list(found[1])[::-1]
    for name, rows in found[0].items():
        assert {row.status for row in rows} <= {"holds", "explained"}
        assert rows == found[1][name]
