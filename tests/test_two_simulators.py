"""The page on two simulators leads from its files to the named cause, as a reader would type it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from proofroll.cli import app

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "two_simulators.md").read_text(encoding="utf-8")


def _write_files(folder: Path) -> None:
    """Writes each block of the page that begins with the name of its file."""
    for name, text in re.findall(r"^```\w+\n(?:<!-- |# )([\w.]+)(?: -->)?\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE):
        (folder / name).write_text(text, encoding="utf-8")


@pytest.mark.nightly
def test_the_page_ends_with_a_named_cause(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Engines agree; the page's loops break by half of kd and by a late target, and without the mistakes nowhere."""
    _write_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    runner = CliRunner()
    compared = runner.invoke(app, ["compare", "arm.urdf", "--control", "control.toml"])
    assert compared.exit_code == 0, compared.output
    assert "differs" not in compared.output
    judged = ["judge", "record.csv", "--robot", "arm.urdf", "--control", "control.toml"]
    for gain, code in (("0.75", 1), ("1.5", 0)):
        loop = (tmp_path / "my_loop.py").read_text(encoding="utf-8").replace("0.75,", f"{gain},")
        (tmp_path / "loop.py").write_text(loop, encoding="utf-8")
        subprocess.run([sys.executable, "loop.py"], check=True, cwd=tmp_path)
        result = runner.invoke(app, judged)
        assert result.exit_code == code, result.output
        assert ("✗ effort" in result.output) is (code == 1)
        assert ("kd is 0.5 of the right one" in result.output) is (code == 1)
    late = (tmp_path / "other_loop.py").read_text(encoding="utf-8")
    at_once = re.sub(r"( +target = computed).*\n( +computed = .*\n)", r"\2\1\n", late)
    for loop, code in ((late, 1), (at_once, 0)):
        (tmp_path / "loop.py").write_text(loop, encoding="utf-8")
        subprocess.run([sys.executable, "loop.py"], check=True, cwd=tmp_path)
        result = runner.invoke(app, ["judge", "states.csv", *judged[2:]])
        assert result.exit_code == code, result.output
        assert ("targets act one instant late" in result.output) is (code == 1)
