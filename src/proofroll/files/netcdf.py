"""Trajectories in netCDF files."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from proofroll.core.columns import Columns, Variable
from proofroll.files.atomic import ordinary_content, replacing

if TYPE_CHECKING:
    import xarray as xr


def import_xarray() -> None:
    """Imports xarray and its backend, in a process that is ours alone: from then on it takes no array of dask's.

    At its first array xarray imports all of dask, half of what a run of a second costs; no array of ours is dask's.
    """
    with _dask_aside():
        import xarray as xr

        xr.Variable((), 0.0)
    import_backend()


def import_backend() -> None:
    """Imports the library that reads and writes the files, which would otherwise be imported at the first one."""
    import scipy.io

    assert scipy.io.netcdf_file


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


def write(dataset: xr.Dataset | Columns, path: Path) -> None:
    """Writes netCDF-3 so that the file is either whole or not there.

    The format has no truth values, no text of variable length and no integers beyond 32 bits; the first are kept as 0
    and 1, the second as characters, as xarray does, and a number that does not fit is refused. Numbers of 64 bits stay
    as they are.

    Raises:
        ProofrollError: the place cannot be written.
    """
    columns = dataset if isinstance(dataset, Columns) else Columns.of(dataset)
    # Made in memory first: a disk that fills meanwhile gives one reason, and no half of a file.
    made = _encoded(columns)
    with replacing(path) as temporary:
        temporary.write_bytes(made)


def _encoded(columns: Columns) -> bytes:
    """The file, byte for byte as xarray makes it by the same library, without the half second that it imports."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    file = netcdf_file(buffer, "w", version=2)
    for key, value in columns.attrs.items():
        setattr(file, key, _attribute(value))
    made = {name: _stored(*column) for name, column in columns.variables.items()}
    for dims, values, _ in made.values():
        for dim, length in zip(dims, values.shape, strict=True):
            if dim not in file.dimensions:
                file.createDimension(dim, length)
    for name, (dims, values, attrs) in made.items():
        variable = file.createVariable(name, values.dtype, dims)
        variable[slice(None) if dims else ...] = values  # of no length the library takes no ellipsis
        for key, value in attrs.items():
            setattr(variable, key, _attribute(value))
    file.flush()
    written = buffer.getvalue()
    buffer.close()  # or the file would write itself once more when it is collected
    return written


def _stored(dims: tuple[str, ...], values: npt.NDArray[Any], attrs: Mapping[str, Any]) -> Variable:
    """A variable as the format can hold it: text becomes characters, in one more dimension."""
    if values.dtype.kind != "U":
        return Variable(dims, _narrow(values), {**attrs, "dtype": "bool"} if values.dtype == bool else attrs)
    texts = np.array([text.encode() for text in values.ravel()], dtype=bytes)
    letters = texts.view("S1").reshape(*values.shape, texts.itemsize)
    return Variable((*dims, f"string{texts.itemsize}"), letters, {**attrs, "_Encoding": "utf-8"})


def _attribute(value: Any) -> bytes | npt.NDArray[Any]:
    return value.encode() if isinstance(value, str) else _narrow(np.atleast_1d(value))


def _narrow(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """In a type that the format has.

    Raises:
        ValueError: an integer does not fit.
    """
    narrow = {"int64": "int32", "bool": "int8"}.get(str(values.dtype))
    found = values if narrow is None else values.astype(narrow)
    if not np.array_equal(found, values, equal_nan=True):
        raise ValueError(f"{values.dtype} does not fit into {narrow}, the widest of netCDF-3")
    return found


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


def read_columns(path: Path, names: Collection[str] | None = None) -> Columns:
    """A trajectory that :func:`write` made, or those of its variables that are named: a tenth of :func:`read`'s time.

    Raises:
        OSError, ValueError: it cannot be read, or is no netCDF-3.
    """
    from scipy.io import netcdf_file

    try:
        file = netcdf_file(io.BytesIO(ordinary_content(path)), mmap=False)
    except TypeError:
        raise ValueError(f"{path} is no netCDF-3") from None
    found = {
        name: _read(item.dimensions, item[...], _said(item))
        for name, item in file.variables.items()
        if names is None or name in names
    }
    return Columns(found, _said(file))


def read_some(path: Path, names: Collection[str]) -> dict[str, npt.NDArray[Any]]:
    """The values of some variables of a trajectory, those that there are; see :func:`read_columns`."""
    return {name: column.values for name, column in read_columns(path, names).variables.items()}


def _said(item: Any) -> dict[str, Any]:
    attrs = item._attributes
    return {key: value.decode() if isinstance(value, bytes) else value for key, value in attrs.items()}


def _read(dims: tuple[str, ...], values: npt.NDArray[Any], attrs: dict[str, Any]) -> Variable:
    """A variable as it was before :func:`_stored`."""
    if values.dtype.kind != "S":
        own = bool if attrs.pop("dtype", None) == "bool" else values.dtype.newbyteorder("=")
        return Variable(dims, values.astype(own), attrs)
    del attrs["_Encoding"]
    texts = [b"".join(letters).decode() for letters in values.reshape(-1, values.shape[-1])]
    return Variable(dims[:-1], np.array(texts, dtype=str).reshape(values.shape[:-1]), attrs)
