"""Our files against those that xarray makes and reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from proofroll.core.columns import Columns
from proofroll.core.events import Event, with_events
from proofroll.files.netcdf import read, read_columns, write
from proofroll.running.simulation import simulate

ALL_KINDS = xr.Dataset(
    {
        "number": ("time", [0.1, np.nan]),
        "small": ("time", np.array([1, 2], dtype=np.float32)),
        "count": ("time", [1, 2]),
        "holds": ("time", [True, False]),
        "name": (("body", "time"), [["a", "zwölf"]]),
        "scalar": 3.0,
    },
    {"time": ("time", [0.0, 1.0], {"units": "s"})},
    {"count": 3, "half": 0.5, "list": [1, 2, 3], "empty": "", "holds": True},
)


def made_by_xarray(dataset: xr.Dataset) -> bytes:
    """The file of xarray's own."""
    plain = {name: {"_FillValue": None} for name in dataset.variables}
    return bytes(dataset.to_netcdf(None, engine="scipy", encoding=plain))


@pytest.mark.parametrize(
    "dataset",
    [
        ALL_KINDS,
        with_events(ALL_KINDS, []),
        with_events(ALL_KINDS, [Event("slip", 0.5, 0.4, 0.6)]),
        simulate("slide_to_roll", "projection", until=0.3),
        simulate("double_pendulum", until=0.1),
    ],
    ids=["kinds", "no event", "an event", "balls", "mechanisms"],
)
def test_a_file_is_the_one_that_xarray_makes(tmp_path: Path, dataset: xr.Dataset) -> None:
    """Each file is, byte for byte, that of xarray, and what is read without xarray is what it reads."""
    file = tmp_path / "run.nc"
    for given in (dataset, Columns.of(dataset)):
        write(given, file)
        assert file.read_bytes() == made_by_xarray(dataset)
    assert read_columns(file).dataset().identical(read(file))


def test_what_the_format_cannot_hold_is_refused(tmp_path: Path) -> None:
    """An integer beyond 32 bits is not cut."""
    with pytest.raises(ValueError, match="int64 does not fit"):
        write(xr.Dataset({"count": ("time", [2**40])}), tmp_path / "run.nc")


def test_what_is_no_file_of_ours_is_refused(tmp_path: Path) -> None:
    """Bytes of another kind are no trajectory, to either reader."""
    (tmp_path / "run.nc").write_bytes(b"no netCDF")
    for reader in (read, read_columns):
        with pytest.raises(ValueError, match="netCDF"):
            reader(tmp_path / "run.nc")
