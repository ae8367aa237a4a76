"""A kind of element that nobody here knows goes through every verb: the harness has no line for any kind."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from unittest import SkipTest

import pytest

from proofroll.core import plugins, truth

PLUGINS = Path(__file__).parent / "plugins"
Proofroll = Callable[..., tuple[int, str, str]]
SCENE = """
title = "A mass on a spring"
source = "invented"

[parameters.mass]
value = 2.0
unit = "kg"
meaning = "mass"
source = "invented"
above = 0

[parameters.stiffness]
value = 50.0
unit = "N/m"
meaning = "stiffness"
source = "invented"
above = 0

[gravity]
magnitude = 0.0

[[masses]]
name = "m"
mass = "$mass"
stiffness = "$stiffness"
x0 = 0.3
"""
COMPARISON = """
title = "Springs"
question = "Does it swing?"
scene = {scene!r}
until = 1.0
every = 0.02

[vary]
mass = [1.0, 2.0]

[tolerances.fine]
because = "of second order"
x = "1e-3 m"
pull = "1 %"
energy_error = "1e-3 J"

[[rows]]
engine = "sprung[dt=1e-3]"
tolerance = "fine"
"""
STABILITY = """
study = "stability"
title = "Springs at the extremes"
question = "Where does it break?"
scene = {scene!r}

[[axes]]
name = "stiffness"
unit = "N/m"
meaning = "stiffer"
values = [50.0, 5000.0]
parameters = {{ stiffness = {{}} }}
"""


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scene of the new kind and files about it, and what an installed package would announce."""
    folder = tmp_path_factory.mktemp("springs")
    info = folder / "site" / "springs-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: springs\nVersion: 1.0\n")
    groups = {"elements": "spring = spring:SpringKind", "truths": "spring = spring:SpringTruth"}
    groups["engines"] = "sprung = spring:Sprung"
    (info / "entry_points.txt").write_text("".join(f"[proofroll.{k}]\n{v}\n" for k, v in groups.items()))
    scene = folder / "swing"
    scene.mkdir()
    (scene / "scene.toml").write_text(SCENE)
    (folder / "springs.toml").write_text(COMPARISON.format(scene=str(scene)))
    (folder / "hard.toml").write_text(STABILITY.format(scene=str(scene)))
    return folder


@pytest.fixture
def springs(home: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The scene; kind, truth and engine are installed, and the working folder is its home."""
    site = str(home / "site")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([site, str(PLUGINS), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.syspath_prepend(site)
    plugins.load_element_kinds.cache_clear()
    truth.load_truths.cache_clear()
    monkeypatch.chdir(home)
    yield home / "swing"
    plugins.load_element_kinds.cache_clear()
    truth.load_truths.cache_clear()


@pytest.mark.drill
def test_run(command_line: Proofroll, springs: Path) -> None:
    """Run gives the truth with its error bars, and the engine's end near it."""
    ends = {}
    for engine in ("truth", "sprung"):
        code, out, err = command_line("run", str(springs), "--engine", engine, "--until", "1", "--json")
        assert code == 0, err
        ends[engine] = json.loads(out)["final"]["x"]
    assert ends["sprung"] == pytest.approx(ends["truth"], abs=1e-4)


@pytest.mark.drill
@pytest.mark.usefixtures("springs")
def test_compare(command_line: Proofroll) -> None:
    """Compare judges every observable of the new kind."""
    code, out, err = command_line("compare", "springs.toml", "--json")
    assert code == 0, err
    document = json.loads(out)
    content = document.get("comparisons", [document])[0]
    assert {j["observable"] for run in content["runs"] for j in run["judgements"]} == {"x", "pull", "energy_error"}


@pytest.mark.nightly
def test_recommend(command_line: Proofroll, springs: Path) -> None:
    """Recommend bounds the deciding observable."""
    arguments = ("--until", "0.1", "--tolerance", "1e-3", "--engine", "sprung", "--json")
    code, out, err = command_line("recommend", str(springs), *arguments)
    assert code == 0, err
    found = json.loads(out)
    assert found["engines"][0]["engine"].startswith("sprung")
    assert [bound["quantity"] for bound in found["bounds"]] == ["x"]


@pytest.mark.nightly
@pytest.mark.usefixtures("springs")
def test_stability(command_line: Proofroll) -> None:
    """Stability finds boundaries, measures them by the kind's own number and names its own sign of failure."""
    code, out, err = command_line("stability", "hard.toml", "--engine", "sprung", "--quick", "--json")
    assert code == 0, err
    study = json.loads(out)
    assert study["step_symbols"] == {"phase": "ωh"}
    assert "far out" in study["meanings"]
    assert all(point["sides"]["accurate"]["largest"] for point in study["points"])


@pytest.mark.drill
def test_ladder(command_line: Proofroll, springs: Path) -> None:
    """Ladder puts the engine on its rung."""
    code, out, err = command_line("ladder", str(springs), "--engine", "sprung", "--until", "0.5", "--json")
    assert code == 0, err
    assert [rung["engine"] for rung in json.loads(out)["rungs"] if rung["engine"]] == ["sprung"]


@pytest.mark.nightly
@pytest.mark.usefixtures("springs")
def test_report(command_line: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """Report writes a page about it, of results that are stored."""
    monkeypatch.setattr(import_module("proofroll.cli.report"), "search_answers", lambda *_: None)
    code, _, err = command_line("report", "springs.toml")
    assert code == 0, err
    assert "A mass on a spring" in Path("out", "report.html").read_text(encoding="utf-8")


@pytest.mark.drill
@pytest.mark.usefixtures("springs")
def test_conformance() -> None:
    """Every check of its engine holds, on the scenes of the new kind."""
    from spring import Sprung

    from proofroll.conformance import checks

    refused = []
    for check in checks(Sprung):
        try:
            check()
        except SkipTest as skipped:
            refused.append(str(skipped))
    assert set(refused) == {"the engine does not report its model", "the step is fixed"}


@pytest.mark.usefixtures("springs")
def test_other_kinds_keep_their_units(command_line: Proofroll, monkeypatch: pytest.MonkeyPatch) -> None:
    """A kind may write the unit of a number as it likes: scenes of other kinds with such a key still have theirs."""
    from spring import SpringKind

    monkeypatch.setattr(SpringKind, "units", {**SpringKind.units, "inertia": "kg m²"})
    code, _, err = command_line("scenes")
    assert code == 0, err


@pytest.mark.nightly
def test_replay_and_judge(command_line: Proofroll, springs: Path) -> None:
    """A run of a scene that is no scene of the package is held against its truth; who draws no such scene says so."""
    assert command_line("run", str(springs), "--engine", "sprung", "--until", "1", "--out", "run.nc")[0] == 0
    code, out, err = command_line("judge", "run.nc", "--scene", str(springs))
    assert (code, err) == (0, ""), out
    code, _, err = command_line("replay", "run.nc")
    assert code == 2
    assert "nothing that is installed draws the scene A mass on a spring" in err


def test_cite(command_line: Proofroll, springs: Path) -> None:
    """The truths that cover the scene are cited, and those of other kinds only where no scene is named."""
    names = {}
    for subject in (str(springs), "pendulum", "sprung"):
        code, out, err = command_line("cite", subject, "--json")
        assert code == 0, err
        names[subject] = [len(item["references"]) for item in json.loads(out)["cited"] if item["kind"] == "truth"]
    assert names[str(springs)] == [0]
    assert names["pendulum"] == names["sprung"] != [0]
