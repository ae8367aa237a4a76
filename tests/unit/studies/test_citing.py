"""``proofroll cite``: what a result rests on, told by files that lie beside it."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from proofroll.core.errors import InputError
from proofroll.core.plugins import engine_names
from proofroll.files.data_folders import data_folder
from proofroll.files.trajectory_file import read, write
from proofroll.studies.citing import citations, entries

Proofroll = Callable[..., tuple[int, str, str]]
ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.drill
def test_a_run_is_cited_with_its_versions(proofroll: Proofroll, tmp_path: Path) -> None:
    """Trajectory (of both kinds) and document of a run name engine, version, scene, truth and suite."""
    run, stored, document = tmp_path / "run.nc", tmp_path / "run.npz", tmp_path / "run.json"
    words = ("run", "pendulum", "--engine", "projection", "--until", "0.02", "--out", str(run), "--json")
    code, out, err = proofroll(*words)
    assert code == 0, err
    document.write_text(out, encoding="utf-8")
    version = json.loads(out)["versions"]["projection"]
    found = {(item.kind, item.name): item for item in citations([str(document)])}
    assert found[("engine", "projection")].versions == [version]
    assert "Whittaker" in found[("scene", "pendulum")].references[0]
    write(read(run), stored)
    for file in (run, stored):
        code, out, _ = proofroll("cite", str(file))
        assert code == 0
        assert f"% engine projection {version}\n@article{{blajer2002elimination," in out
    code, out, _ = proofroll("cite", str(document), "sphere_in_cylinder")
    keys = re.findall(r"^@\w+\{(\w+),", out, flags=re.MULTILINE)
    assert code == 0
    assert {"proofroll", "blajer2002elimination", "blajer2006sphere", "whittaker1937treatise"} <= set(keys)
    assert len(keys) == len(set(keys))


def test_a_comparison_is_cited_with_all_its_engines(proofroll: Proofroll) -> None:
    """The name of a comparison stands for its scene and every engine of its rows."""
    code, out, _ = proofroll("cite", "paper", "--json")
    told = json.loads(out)["cited"]
    assert code == 0
    assert [item["name"] for item in told if item["kind"] == "scene"] == ["sphere_in_cylinder"]
    assert {"mujoco", "exudyn", "pinocchio", "projection"} <= {item["name"] for item in told}


@pytest.mark.parametrize("text", ["{", "[1]", '{"engine": "nobody"}'])
def test_a_file_that_is_no_result(text: str, tmp_path: Path) -> None:
    """What is no document, or names neither engine nor scene, is refused in one line with its name."""
    path = tmp_path / "odd.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"odd\.json"):
        citations([str(path)])


def test_nothing_of_the_name(proofroll: Proofroll) -> None:
    """A word that is neither a scene, a comparison, an engine nor a file is wrong usage, in one line."""
    code, out, err = proofroll("cite", "no_such_thing")
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_every_engine_of_ours_is_cited() -> None:
    """Each engine that comes with proofroll has a reference, each file of references can be read, and none is empty."""
    ours = [name for name in engine_names() if (ROOT / "src" / "proofroll" / "engines" / name).is_dir()]
    assert all(item.references for item in citations(ours))
    files = [*(ROOT / "src").rglob("references.bib"), *data_folder("models").rglob("references.bib")]
    assert len(files) > 8
    for path in files:
        assert all(re.match(r"@\w+\{\w+,\n[^@]*title = ", entry) for entry in entries(path.parent))


def test_the_suite_says_the_same_everywhere() -> None:
    """CITATION.cff, the package's metadata and its BibTeX agree on title, authors, version and licence."""
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (entry,) = citations([])[0].references
    assert f"title = {{{{{cff['title']}}}}}" in entry or f"title = {{{cff['title']}}}" in entry
    assert cff["authors"][0]["name"] in entry
    assert (cff["version"], cff["license"]) == (project["version"], project["license"])
