"""Whether a person's own step is good enough: yes or no, by how much, and which step would do."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

Proofroll = Callable[..., tuple[int, str, str]]


def asked(out: Path, engine: str, *more: str) -> list[str]:
    """A question for half a second of a pendulum."""
    given = ["compare", "pendulum", "--until", "0.5", "--engine", engine, "--out", str(out)]
    return [*given, *(more or ("--tolerance", "1 mm"))]


@pytest.mark.own_workers
@pytest.mark.drill
def test_a_step_is_good_enough_or_is_not(proofroll: Proofroll, tmp_path: Path, started_workers: list[str]) -> None:
    """Yes with the error of what is allowed and twice the step; no with the step that it needs at best.

    The stored answer starts no process.
    """
    engine = "mujoco[formulation=joints,preset=matched,dt={}]"
    code, out, _ = proofroll(*asked(tmp_path, engine.format(1e-3)))
    assert code == 0
    assert out.startswith("Yes: ")
    assert " of 1 mm over 0.5 s (dt 1e-3 s, " in out
    assert sorted(started_workers) == ["mujoco", "truth"]
    code, text, _ = proofroll(*asked(tmp_path, engine.format(1e-3)), "--json")
    content = json.loads(text)
    assert content["holds"]
    assert content["sentence"].startswith("Yes: ")
    assert content["error"] <= 1e-3
    assert json.loads(proofroll(*asked(tmp_path, engine.format(1e-3)), "--json")[1]) == content, "it is stored"
    assert len(started_workers) == 2
    code, out, _ = proofroll(*asked(tmp_path, engine.format(1e-3).replace("matched", "default"), "--tolerance", "1 nm"))
    assert code == 1
    assert out.startswith("No: ")
    assert "; at best it needs dt " in " ".join(out.split())


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.parametrize(
    ("engine", "tolerance", "words"),
    [
        ("projection[preset=default,dt=1]", "1 mm", "at most a quarter of the 0.5 s"),
        ("projection[dtt=1e-3]", "1 mm", "did you mean dt?"),
        ("projection[dt=1e-3]", "1 kg", "judged here are positions [m]"),
        ("reduced[formulation=closed_form]", "1 mm", "no step that could be good enough"),
    ],
)
def test_a_step_that_makes_no_sense(
    proofroll: Proofroll, tmp_path: Path, engine: str, tolerance: str, words: str
) -> None:
    """Bad input is one line on standard error and exit code 2, before anything runs."""
    code, out, err = proofroll(*asked(tmp_path, engine, "--tolerance", tolerance))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
