"""``proofroll diff`` of two versions of one engine, by real runs in two interpreters."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from dataclasses import fields
from functools import partial
from pathlib import Path

import distributed
import pytest
from other_pythons import seeing

from proofroll.core.plugins import load_engine, release
from proofroll.report.changes import Against

Proofroll = Callable[..., tuple[int, str, str]]
ROOT = Path(__file__).resolve().parents[1]
CLAIM = """title = "Balls"
question = "Does it agree?"
scene = "sphere_in_cylinder"
until = 0.4
every = 0.08
[tolerances.close]
because = "Euler's rule leaves more than this at this step, and the midpoint rule does not"
z = "1e-3 m"
[[rows]]
engine = "aged[formulation=midpoint,dt=0.002]"
tolerance = "close"
[[rows]]
engine = "aged[formulation=walls,dt=0.002]"
tolerance = "close"
"""


@pytest.fixture(scope="module")
def pythons(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """An interpreter for each version of the engine."""
    folder = tmp_path_factory.mktemp("pythons")
    return {version: seeing(folder / version, version) for version in ("1.0", "2.0", "2.0.1")}


@pytest.fixture
def versions(
    proofroll: Proofroll,
    install_engines: Callable[[dict[str, str]], None],
    pythons: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Callable[..., tuple[int, str, str]]:
    """Runs ``proofroll diff aged@OLD aged@NEW`` on the claim."""
    install_engines({"aged": "aged:Aged"})  # announced here, installed there alone
    monkeypatch.setenv("PROOFROLL_ENGINES", str(tmp_path / "engines"))
    claim = tmp_path / "balls.toml"
    claim.write_text(CLAIM, encoding="utf-8")

    def run(old: str, new: str, *more: str) -> tuple[int, str, str]:
        places = [f"aged@{pythons.get(item, item)}" for item in (old, new)]
        return proofroll("diff", *places, str(claim), *more, "--out", str(tmp_path / "out"))

    return run


@pytest.mark.nightly
def test_what_changed_is_shown(versions: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """Verdicts, refusals, orders and defaults, as between two reports; a verdict that changed is exit code 1."""
    comment = tmp_path / "changes.md"
    code, out, err = versions("1.0", "2.0", "--json", "--comment", str(comment))
    assert code == 1, err
    found = json.loads(out)
    assert set(found) == {item.name for item in fields(Against)}
    assert found["versions"] == {"aged": ["1.0", "2.0"], "default iterations": ["50", "100"]}
    changes = {change["run"]: change for change in found["changes"]}
    midpoint, walls = (changes[f"aged {name} matched dt 2e-3 s"] for name in ("midpoint", "walls"))
    assert midpoint["kind"] == walls["kind"] == "verdict"
    assert [re.sub(r"\d\S*", "N", text) for text in midpoint["says"]] == [
        "z converges → agrees", "observed order of z N → N", "error of z N → N m",
    ]  # fmt: skip
    assert walls["says"] == ["refused (walls came with version 2) → done"]
    assert {changes[f"aged {name} matched dt 4e-3 s"]["kind"] for name in ("midpoint", "walls")} == {"value", "new"}
    code, out, _ = versions("1.0", "2.0")
    lines = out.splitlines()
    assert code == 1
    assert lines[0].startswith("Against aged@")
    assert "Other versions: aged 1.0 → 2.0, default iterations 50 → 100." in " ".join(lines)
    assert max(map(len, lines)) <= 80
    assert "| change | run |" in comment.read_text(encoding="utf-8")


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("2.0", "2.0", "both are aged@"),
        ("latest", "2.0", "no environment of aged has this label"),
        ("9.9", "2.0", "no environment of 9.9 is remembered; proofroll engines add aged --requirement PACKAGE==9.9"),
        ("/nowhere/python", "2.0", "there is no /nowhere/python"),
    ],
)
def test_versions_that_are_none(versions: Callable[..., tuple[int, str, str]], old: str, new: str, says: str) -> None:
    """Each wrong version gives one line that says what to do."""
    code, out, err = versions(old, new)
    assert (code, out) == (2, "")
    assert says in err
    assert err.count("\n") == 1


def test_what_versions_are_asked_is_allowed(
    versions: Callable[..., tuple[int, str, str]], proofroll: Proofroll, pythons: dict[str, Path]
) -> None:
    """Versions are of one engine, and files have neither jobs nor scenes: each is one line."""
    del versions  # it announces the engine
    sides = [f"aged@{pythons[version]}" for version in ("2.0", "2.0.1")]
    for words, says in (
        ([sides[0], "projection@1.0"], "is no version of aged; name two of one engine"),
        (["old.nc", "new.nc", "--jobs", "3"], "--jobs = 3: this is for two versions of an engine"),
        (["old.nc", "new.nc", "pendulum"], "this is for two versions of an engine"),
    ):
        code, out, err = proofroll("diff", *words)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert says in err


@pytest.mark.nightly
def test_versions_that_do_the_same(
    versions: Callable[..., tuple[int, str, str]],
    tmp_path: Path,
    proofroll: Proofroll,
    pythons: dict[str, Path],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where nothing changed that is said, on a cluster as at home, and is exit code 0.

    Scenes and comparisons may be several; what is named twice is run once.
    """
    del versions
    # Its worker is a thread here: test_cluster.py has processes, which cost seconds.
    monkeypatch.setattr(distributed, "LocalCluster", partial(distributed.LocalCluster, processes=False))
    (tmp_path / "more.toml").write_text(CLAIM.replace("0.002", "0.004"), encoding="utf-8")
    claims = [str(tmp_path / name) for name in ("balls.toml", "more.toml", "balls.toml")]
    sides = [f"aged@{pythons[version]}" for version in ("2.0", "2.0.1")]
    code, out, err = proofroll("diff", *sides, *claims, "--scheduler", "local:1", "--out", str(tmp_path / "out"))
    assert code == 0, err
    assert re.search(r"Of \d+ runs in both reports, changed: nothing", " ".join(out.split()))


def test_lower_bounds_are_those_of_the_adapters() -> None:
    """What `pip install proofroll[ENGINE]` brings at least is no older than the adapter supports."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for name in ("mujoco", "exudyn", "pinocchio"):
        (requirement,) = extras[name]
        assert release(requirement.partition(">=")[2]) >= release(load_engine(name).oldest)
