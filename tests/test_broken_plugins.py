"""Packages that announce what cannot be loaded: every command says so in a line, and works."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

_WRONG = {
    "raises": "raise ValueError('ouch')",
    "quits": "import sys; sys.exit(3)",
    "panics": "print('noise')\nclass Panic(BaseException): pass\nraise Panic('x' * 9000)",
    "lacks": "import no_such_module",
    "number": "thing = 3",
    "untyped": "def thing(value: int | str) -> None:\n    '''Do nothing.'''",
}
_GROUPS = ("elements", "truths", "surfaces", "report_kinds", "report_parts", "study_folders")


@pytest.fixture
def broken(tmp_path: Path) -> dict[str, str]:
    """An environment with a package whose announcements are all wrong."""
    info = tmp_path / "bad_plugin-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bad-plugin\nVersion: 1.0\n")
    for name, text in _WRONG.items():
        (tmp_path / f"bad_{name}.py").write_text(text)
    (tmp_path / "bad_empty.py").write_text("class thing: pass")
    lines = [f"[proofroll.commands]\n{name} = bad_{name}:thing" for name in _WRONG]
    named = ("raises", "quits", "number", "empty")
    lines += [f"[proofroll.{group}]\n{name} = bad_{name}:thing" for group in _GROUPS for name in named]
    (info / "entry_points.txt").write_text("\n".join(lines))
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])}


@pytest.mark.one_in(3)
@pytest.mark.drill
@pytest.mark.nightly_of("words2-ball.x", "words3-is sound")
@pytest.mark.parametrize(
    ("words", "shown"),
    [
        (["--version"], "proofroll "),
        (["--help"], "stability"),
        (["run", "sphere_in_cylinder", "--engine", "reduced", "--until", "0.1"], "ball.x"),
        (["check", "sphere_in_cylinder"], "is sound"),
        pytest.param(["check", "stick_slip"], "is sound", marks=pytest.mark.drill),
    ],
)
def test_every_command_works(words: list[str], shown: str, broken: dict[str, str]) -> None:
    """Whatever a package does when it is loaded, commands do their work, and each announcement is told in one line."""
    asked = [sys.executable, "-m", "proofroll", *words]
    done = subprocess.run(asked, capture_output=True, text=True, env=broken, check=False)
    assert done.returncode == 0
    assert shown in done.stdout
    assert "noise" not in done.stdout
    told = [line for line in done.stderr.splitlines() if line != "noise"]
    assert max(map(len, told)) < 500
    assert all(line.startswith("proofroll: bad-plugin announces bad_") for line in told)
    assert len([line for line in told if "(proofroll.commands)" in line]) == len(_WRONG)
    for name, why in (("raises", "(ValueError: ouch)"), ("quits", "(SystemExit: 3)"), ("number", "is no command")):
        assert any(f"bad_{name}:thing" in line and why in line for line in told)
    for group in {line.partition("(proofroll.")[2].partition(")")[0] for line in told} & set(_GROUPS):
        wrong = "is no module" if group == "study_folders" else "is no class"
        if group not in {"study_folders", "surfaces"}:
            assert any(f"(proofroll.{group})" in line and "for it lacks" in line for line in told)
        assert any(f"(proofroll.{group})" in line and wrong in line for line in told)
