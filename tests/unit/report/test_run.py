"""What ``proofroll run`` says of one run."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import xarray as xr
from rich.console import Console

from proofroll.files.trajectory_file import write
from proofroll.report.run import run_content, run_lines
from proofroll.running.case import Result, Status


def test_a_variable_without_value_says_why(tmp_path: Path) -> None:
    """It stands below the table with its reason, once for all such variables, and no line has a nan or is too long."""
    units = {"units": "N", "long_name": "a force"}
    nothing = ("time", np.full(2, np.nan), units | {"absent": "not determined by the equations"})
    held = {f"force.a_joint_{number}.z": nothing for number in range(9)}
    dataset = xr.Dataset(held | {"x": ("time", np.ones(2), units)}, {"time": ("time", [0.0, 1.0], {"units": "s"})})
    write(dataset, tmp_path / "run.npz")
    case = SimpleNamespace(scene="s", parameters={}, engine=SimpleNamespace(name="e", settings={}), until=1.0, asks=())
    result = Result(Status.DONE, "reached 1 s", trajectory="run.npz", wall_seconds=0.1)

    content = run_content(case, result, tmp_path / "run.npz")
    shown = Console(file=io.StringIO(), width=80)
    for line in run_lines(content):
        shown.print(line)
    text = shown.file.getvalue()

    assert content.absent == dict.fromkeys(held, "not determined by the equations")
    assert np.isnan(content.final["force.a_joint_0.z"])
    assert "nan" not in text
    assert text.count("not determined by the equations") == 1
    assert all(name in text for name in held)
    assert max(map(len, text.splitlines())) <= 80
