"""``proofroll recommend`` as a user meets it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

Proofroll = Callable[..., tuple[int, str, str]]
ENGINE = "mujoco[formulation=joints,preset=tuned]"


def asked(out: Path, *more: str) -> list[str]:
    """A recommendation for half a second of a pendulum."""
    return ["recommend", "pendulum", "--until", "0.5", "--engine", ENGINE, "--out", str(out), *more]


@pytest.mark.drill
def test_an_answer_is_found_once_and_then_stored(proofroll: Proofroll, tmp_path: Path) -> None:
    """It says what it will cost, prints answers as they come, and is the same when it is read again."""
    code, out, err = proofroll(*asked(tmp_path, "--tolerance", "1 mm"))
    assert code == 0
    assert out.startswith("Take MuJoCo joints, best, dt ")
    assert all(len(line) <= 80 for line in out.splitlines())
    assert " of 1 mm in " in " ".join(out.split())
    assert "Not judged: attitudes." in " ".join(out.split())
    assert err.startswith(
        "proofroll: searching mujoco in pendulum over 0.5 s: about 30 s of processor time each at most"
    )
    assert "MuJoCo joints, best" in err
    assert proofroll(*asked(tmp_path, "--tolerance", "1 mm")) == (0, out, "")
    code, text, err = proofroll(*asked(tmp_path, "--tolerance", "1 mm", "--json"))
    assert (code, err) == (0, "")
    content = json.loads(text)
    assert " ".join(out.split()).startswith(content["sentence"])
    (engine,) = content["engines"]
    assert engine["state"] == "holds"
    assert engine["error"] <= engine["bound"]["allowed"] == 1e-3
    assert f"dt={engine['step']!r}" in engine["spec"]
    code, lines, _ = proofroll(*asked(tmp_path, "--tolerance", "1 mm", "--lines"))
    assert code == 0
    assert "<option" in lines


@pytest.mark.nightly
def test_a_tolerance_below_the_truth_is_no_ones_fault(proofroll: Proofroll, tmp_path: Path) -> None:
    """Where the truth itself is not known so well no engine is judged, and nothing is advised: exit code 1."""
    code, out, _ = proofroll(*asked(tmp_path, "--tolerance", "1e-18 m"))
    assert code == 1
    assert out.startswith("Nothing can be advised for 1e-18 m: the truth itself is known to ")
    code, out, err = proofroll(*asked(tmp_path, "--tolerance", "1e-18 m", "--lines"))
    assert (code, out) == (2, "")
    assert "no engine is shown to hold the tolerance" in err


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--tolerance", "soon"], "tolerance = 'soon'"),
        (["--tolerance", "nan"], "tolerance = 'nan'"),
        (["--tolerance", "1 mN"], "judged here are positions [m]"),
        (["--tolerance", "positions=1 mN"], "its unit is m"),
        (["--tolerance", "-1"], "tolerance = '-1'"),
        (["--tolerance", "colour=1"], "there is no such observable"),
        (["--until", "0"], "positive, finite time"),
        (["--set", "length=0"], "length"),
    ],
)
def test_a_question_that_makes_no_sense(proofroll: Proofroll, tmp_path: Path, more: list[str], words: str) -> None:
    """Bad input is one line on standard error and exit code 2, before anything runs."""
    code, out, err = proofroll(*asked(tmp_path, *more))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert not list(tmp_path.glob("**/*.nc"))
