"""The command ``figures`` as a user meets it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

TEXT = """
study = "figures"
title = "Some figures"
source = "somebody"
scene = "sphere_in_cylinder"
engine = "projection[formulation=rotating_frame]"
until = 0.3
every = 0.01

[runs.free]
label = "free"
parameters = { speed = 4 }

[[figures]]
name = "height"
caption = "The height."
[[figures.panels]]
y = ["z"]
runs = ["free"]

[[statements]]
says = "ω3 = -160 1/s"
source = "section 3"
runs = ["free"]
of = "omega3"
measure = "every"
stated = "-160"
"""

Proofroll = Callable[..., tuple[int, str, str]]


def written(tmp_path: Path, text: str = TEXT) -> str:
    """The path of a file with this text."""
    path = tmp_path / "made.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


@pytest.mark.drill
def test_figures_and_numbers(proofroll: Proofroll, tmp_path: Path) -> None:
    """Exit 0, the files asked for, one JSON document, and the same content beside the figures."""
    out = tmp_path / "out"
    code, stdout, _ = proofroll("paper", "figures", written(tmp_path), "--out", str(out), "--format", "png", "--json")
    content = json.loads(stdout)
    assert code == 0
    assert content == json.loads((out / "figures.json").read_text(encoding="utf-8"))
    assert content["figures"][0]["files"] == ["height.png"]
    (entry,) = content["statements"]
    assert (entry["stated"], entry["holds"], entry["source"]) == ("-160", True, "section 3")
    assert entry["found"] == pytest.approx(-160, abs=1e-6)
    assert (out / "height.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.nightly
def test_a_wrong_number_is_a_contradiction(proofroll: Proofroll, tmp_path: Path) -> None:
    """Exit 1, and the table shows what was stated and found, within 100 columns."""
    path = written(tmp_path, TEXT.replace('"-160"', '"-150"'))
    code, stdout, stderr = proofroll("paper", "figures", path, "--engine", "truth", "--out", str(tmp_path / "out"))
    assert code == 1
    assert "-150" in stdout
    assert "✗" in stdout
    assert "0 of 1 statements hold" in stdout
    assert max(map(len, stdout.splitlines())) <= 100
    assert not stderr


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.nightly_of('runs = ["free"]-runs = ["free"]\\ntitle = "$z_{$"-arguments4-2-its text cannot be drawn')
@pytest.mark.drill_of('label = "free"-label = "free"-arguments5-3-no wheel, no ball')
@pytest.mark.parametrize(
    ("old", "new", "arguments", "code", "words"),
    [
        ('y = ["z"]', 'y = ["height"]', [], 2, "figures.0.panels.0 = 'height'"),
        ('caption = "The height."', 'caption = "x"\nwheels = 4', [], 2, "wheels"),
        ('label = "free"', 'label = "free"', ["--engine", "adams"], 2, "engine = 'adams'"),
        ('label = "free"', 'label = "free"', ["--format", "gif"], 2, "gif"),
        ('runs = ["free"]', 'runs = ["free"]\ntitle = "$z_{$"', [], 2, "its text cannot be drawn"),
        ('label = "free"', 'label = "free"', ["--engine", "refuses"], 3, "no wheel, no ball"),
    ],
)
def test_what_goes_wrong_is_one_line(
    proofroll: Proofroll, tmp_path: Path, old: str, new: str, arguments: list[str], code: int, words: str
) -> None:
    """A broken file or argument ends with 2, an engine that refuses with 3, each in one line."""
    assert old in TEXT
    text = TEXT.replace(old, new, 1)
    said = proofroll("paper", "figures", written(tmp_path, text), "--out", str(tmp_path / "out"), *arguments)
    assert said[0] == code
    assert words in said[2]
    assert said[2].count("\n") == 1
