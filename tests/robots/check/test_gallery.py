"""The gallery of robots from packages."""

from __future__ import annotations

from pathlib import Path

import pytest
from robot_gallery import locate, outcome, read_gallery

from proofroll.core.plugins import engine_names, parse_engine
from proofroll.robots.check.check import check
from proofroll.robots.check.explain import RobotCause
from proofroll.robots.check.records import HeldLayer, ImporterRow
from proofroll.robots.files.meaning import CheckSettings
from proofroll.robots.hypotheses import hypotheses
from proofroll.robots.protocol import GROUP
from proofroll.running.engine_questions import lent_workers


def test_the_file() -> None:
    """The gallery has at least 25 robots of two formats, fixed and free, and names only causes that exist."""
    entries = read_gallery().values()
    assert len(entries) >= 25
    assert {entry.base for entry in entries} == {"fixed", "free"}
    assert {Path(entry.file).suffix for entry in entries} == {".urdf", ".xml"}
    assert all({"mujoco", "pinocchio", "exudyn", "drake"} <= entry.engines.keys() for entry in entries)
    named = {cause for entry in entries for causes in entry.engines.values() for cause in causes}
    assert named <= {"refuses", "crashed", "open", *(hypothesis.id for hypothesis in hypotheses())}


def test_outcomes() -> None:
    """What an engine does is its causes in order, and whether something stays open."""
    causes = [RobotCause(name, name, "mass", 1.0, 0.0, "", "") for name in "bab"]
    layers = {"mass": HeldLayer(1.0, 0.0, False)}
    row = ImporterRow(engine="one", status="differs", layers=layers, causes=causes, unexplained="bias")
    assert outcome(row) == ["b", "a", "open"]
    assert outcome(ImporterRow(engine="one", status="refused")) == ["refuses"]
    assert outcome(ImporterRow(engine="one", status="timeout")) == ["timeout"]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize("name", ["z1", "allegro_right_hand", "half_cheetah", "pusher"])
def test_as_expected(name: str) -> None:
    """A robot does in our engines what the gallery expects."""
    entry = read_gallery()[name]
    rows = check(locate(name), ["pinocchio", "mujoco"], CheckSettings(base=entry.base)).engines
    assert {row.engine: set(outcome(row)) for row in rows} == {
        engine: set(entry.engines[engine]) for engine in ("pinocchio", "mujoco")
    }


@pytest.mark.nightly
def test_all_as_expected() -> None:
    """Every robot of an installed package does in every installed engine what the gallery expects."""
    unexpected, checked = {}, 0
    with lent_workers(None) as workers:
        for entry in read_gallery().values():
            try:
                path = locate(entry.name)
            except pytest.skip.Exception:
                continue
            checked += 1
            engines = [name for name in entry.engines if parse_engine(name).name in engine_names(GROUP)]
            for row in check(path, engines, CheckSettings(base=entry.base), workers=workers).engines:
                if row.status != "missing" and set(outcome(row)) != set(entry.engines[row.engine]):
                    unexpected[entry.name, row.engine] = outcome(row)
    assert unexpected == {}
    if not checked:
        pytest.skip("no package of robots is installed: pip install 'proofroll[robots]'")


@pytest.mark.nightly
@pytest.mark.own_workers
def test_what_was_read_before_changes_nothing() -> None:
    """Robots that one process of an engine reads: each is found alike, to the last digit, first or last."""
    names = ["half_cheetah", "swimmer"]
    entries, files = read_gallery(), {name: locate(name) for name in names}
    rows_of: list[dict[str, list[ImporterRow]]] = []
    for order in (names, names[::-1]):
        with lent_workers(None) as workers:
            rows = {}
            for name in order:
                how = CheckSettings(entries[name].base)
                rows[name] = check(files[name], ["mujoco", "pinocchio", "exudyn"], how, workers=workers).engines
            rows_of.append(rows)
    assert list(rows_of[0]) == list(rows_of[1])[::-1]
    for name, rows in rows_of[0].items():
        assert {row.status for row in rows} <= {"holds", "explained"}
        assert rows == rows_of[1][name]
