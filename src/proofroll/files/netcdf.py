"""Trajectories in netCDF files."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from proofroll.files.atomic import ordinary_content, replacing

if TYPE_CHECKING:
    import xarray as xr


def import_xarray() -> None:
    """Imports xarray and its backend, in a process that is ours alone: from then on it takes no array of dask's.

    At its first array xarray imports all of dask, half of what a run of a second costs; no array of ours is dask's.
    """
    with _dask_aside():
        import scipy.io
        import xarray as xr

        xr.Variable((), 0.0)
        assert scipy.io.netcdf_file  # the backend of read and write, which would import it at the first file


@contextlib.contextmanager
def _dask_aside() -> Iterator[None]:
    """Meanwhile dask is not found, unless it is imported already."""
    hidden = "dask" not in sys.modules
    if hidden:
        sys.modules["dask"] = None  # type: ignore[assignment]  # what Python documents to make an import fail
    try:
        yield
    finally:
        if hidden:
            sys.modules.pop("dask", None)


def write(dataset: xr.Dataset, path: Path) -> None:
    """Writes netCDF-3 so that the file is either whole or not there.

    The format has no truth values, no text of variable length and no integers beyond 32 bits; xarray keeps the first
    as 0 and 1, the second as characters, and refuses a number that does not fit. Numbers of 64 bits stay as they are.

    Raises:
        ProofrollError: the place cannot be written.
    """
    plain: dict[Any, dict[str, Any]] = {name: {"_FillValue": None} for name in dataset.variables}
    # Made in memory first: a disk that fills meanwhile gives one reason, and no half of a file.
    with _dask_aside():  # of which xarray would import the scheduler to learn that it writes nothing
        made = dataset.to_netcdf(None, engine="scipy", encoding=plain)
    with replacing(path) as temporary:
        temporary.write_bytes(made)


def read(path: Path) -> xr.Dataset:
    """A trajectory from the netCDF file that :func:`write` made, wholly in memory.

    Raises:
        OSError, ValueError: it cannot be read, or is no netCDF-3.
    """
    import xarray as xr

    # Times stay numbers of seconds, and no number stands for an absent one.
    try:
        found = xr.load_dataset(
            io.BytesIO(ordinary_content(path)), engine="scipy", decode_times=False, mask_and_scale=False
        )
    except TypeError:
        raise ValueError(f"{path} is no netCDF-3") from None
    return found.assign({name: item.astype(str) for name, item in found.variables.items() if item.dtype == object})


def read_some(path: Path, names: Sequence[str]) -> dict[str, npt.NDArray[Any]]:
    """Some variables of a trajectory, those that there are: a tenth of the time that :func:`read` takes."""
    from scipy.io import netcdf_file

    with netcdf_file(io.BytesIO(ordinary_content(path)), mmap=False) as file:
        found = {name: file.variables[name][...] for name in names if name in file.variables}
    return {
        name: values.astype(values.dtype.newbyteorder("="))
        if values.dtype.kind != "S"
        else np.array([b"".join(letters).decode() for letters in values], dtype=str)
        for name, values in found.items()
    }
