"""``proofroll plot`` and ``run --plot``: a person's own run as a picture."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr

from proofroll.files.netcdf import read
from proofroll.report.run_plot import curves

Proofroll = Callable[..., tuple[int, str, str]]
RUN = ["--until", "0.1", "--every", "0.05"]


@pytest.mark.parametrize(
    ("scene", "engine", "names"),
    [("sphere_in_cylinder", "oracle", {"gamma", "z", "N"}), ("pendulum", "projection", {"q.pivot", "force.pivot.x"})],
)
def test_every_curve_with_its_unit(
    proofroll: Proofroll, tmp_path: Path, scene: str, engine: str, names: set[str]
) -> None:
    """The picture has a panel for each variable over time, of whatever kind of element; run says what it wrote."""
    run, picture = tmp_path / "run.nc", tmp_path / "run.svg"
    code, out, err = proofroll("run", scene, "--engine", engine, *RUN, "--out", str(run), "--plot", str(picture))
    assert (code, err) == (0, "")
    assert "The trajectory is in" in out
    assert "The plot is in" in out
    found = curves(read(run))
    assert names <= set(found)

    assert proofroll("plot", str(run))[0] == 0
    page = run.with_suffix(".html").read_text(encoding="utf-8").replace("\\u002f", "/")  # as plotly writes it
    units = read(run)
    for name in found:
        assert f"{name} [{units[name].attrs['units']}]" in page
    assert "<script src=" not in page  # plotly is inside
    assert "<svg" in picture.read_text(encoding="utf-8")


def test_json_says_what_was_written(proofroll: Proofroll, tmp_path: Path) -> None:
    """With --json the paths of the files stand in the document."""
    run, picture = tmp_path / "run.nc", tmp_path / "run.png"
    files = ["--out", str(run), "--plot", str(picture), "--json"]
    code, out, _ = proofroll("run", "sphere_in_cylinder", "--engine", "oracle", *RUN, *files)
    content = json.loads(out)
    assert (code, content["trajectory"], content["plot"]) == (0, str(run), str(picture))
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_bad_files(proofroll: Proofroll, tmp_path: Path) -> None:
    """No file, no run in it, or an ending that no picture has: one line, exit code 2, and nothing is written."""
    (tmp_path / "text.nc").write_text("no netCDF")
    for arguments, word in (
        ([str(tmp_path / "none.nc")], "no such file"),
        ([str(tmp_path / "text.nc")], "no netCDF"),
        ([str(tmp_path / "text.nc"), "--out", str(tmp_path / "run.gif")], ".html"),
    ):
        code, out, err = proofroll("plot", *arguments)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert word in err
    assert [path.name for path in tmp_path.iterdir() if path.suffix in {".html", ".gif"}] == []


def test_what_has_no_value_is_not_drawn() -> None:
    """A variable without any value, of text or without a unit has no panel."""
    times = [0.0, 1.0]
    made = xr.Dataset(
        {
            "z": ("time", [1.0, float("nan")], {"units": "m"}),
            "force": ("time", [float("nan")] * 2, {"units": "N"}),
            "sticks": ("time", ["yes", "no"], {"units": "1"}),
            "count": ("time", [1, 2]),
            "p": (("time", "xyz"), [[0.0] * 3] * 2, {"units": "m"}),
        },
        {"time": times},
    )
    assert curves(made) == ["z"]
