"""Trajectories in files: ``.npz`` for the store and between processes; netCDF and CSV for users and other programs.

numpy is imported anyway, while importing the libraries for netCDF takes longer than a short run.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import sys
import weakref
import zipfile
from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from threading import Lock
from typing import IO, TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from proofroll.core.columns import Columns, Variable
from proofroll.core.time_grid import MOST_SAMPLES
from proofroll.files.atomic import ordinary_content, replacing

if TYPE_CHECKING:
    import xarray as xr

# Endings of files: of the store, and of those written for users.
STORED, NETCDF, CSV = ".npz", ".nc", ".csv"
# Largest total size of the trajectories that are kept in memory [bytes]: those of a few comparisons.
MOST_HELD = 128 * 2**20
# Entry of a stored file with the dimensions of its variables and all attributes.
_ABOUT = "about.json"
# True if xarray was imported without dask; then dask is hidden, too, when xarray asks for a scheduler to write.
_without_dask = False
_LONGEST = 200  # characters shown of the error of a library that reads a file
# Shape of an array, True if it is stored by columns, and the type of its numbers.
_Header = tuple[tuple[int, ...], bool, np.dtype[Any]]


@contextlib.contextmanager
def reading(what: str) -> Iterator[None]:
    """Context manager for a library that reads somebody's file: any error of it becomes a ValueError.

    Args:
        what: clause about the file, as in ``run.npz is no stored trajectory``.

    Raises:
        OSError, MemoryError: of the library.
        ValueError: any other error of it; a damaged file may make it raise anything.
    """
    try:
        yield
    except (OSError, MemoryError):
        raise
    except Exception as error:
        raise ValueError(f"{what} ({' '.join(str(error).split())[:_LONGEST]})" if str(error) else what) from error


def import_xarray() -> None:
    """Imports xarray without dask, unless one of them is imported already.

    xarray would import all of dask at its first array, which takes half as long as a run of a second; we do not use it.
    """
    global _without_dask  # noqa: PLW0603 -- of the process, as xarray's own memory of dask is
    is_new = not {"xarray", "dask"} & set(sys.modules)
    with _dask_aside():
        import xarray as xr

        xr.Variable((), 0.0)
    _without_dask |= is_new


@contextlib.contextmanager
def _dask_aside() -> Iterator[None]:
    """Context manager in which xarray does not find dask, unless dask is imported already."""
    hidden = "dask" not in sys.modules
    if hidden:
        sys.modules["dask"] = None  # type: ignore[assignment]  # what Python documents to make an import fail
    try:
        yield
    finally:
        if hidden:
            sys.modules.pop("dask", None)


def write(trajectory: xr.Dataset | Columns, path: Path) -> None:
    """Writes a trajectory atomically, in the format of the file's ending.

    netCDF-3 has no integers beyond 32 bits: a larger number is refused. Other numbers are kept exactly.

    Raises:
        ProofrollError: the file cannot be written.
        ValueError: the format cannot hold a number.
    """
    # Made in memory first, so that a full disk gives one clear error.
    made = (
        _csv(trajectory)
        if path.suffix == CSV
        else _stored(trajectory)
        if path.suffix == STORED
        else _netcdf(trajectory)
    )
    with replacing(path) as temporary:
        temporary.write_bytes(made)


def _stored(trajectory: xr.Dataset | Columns) -> bytes:
    columns = trajectory if isinstance(trajectory, Columns) else Columns.of(trajectory)
    layout = {name: [item.dims, dict(item.attrs)] for name, item in columns.variables.items()}
    about = json.dumps([layout, dict(columns.attrs)], default=lambda value: value.tolist())  # numpy arrays and numbers
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(zipfile.ZipInfo(_ABOUT), about)  # without a date: equal trajectories give equal files
        for name, item in columns.variables.items():
            with archive.open(f"{name}.npy", "w") as entry:
                np.lib.format.write_array(entry, item.values, allow_pickle=False)
    return buffer.getvalue()


def _csv(trajectory: xr.Dataset | Columns) -> bytes:
    from proofroll.files.csv_table import csv_text

    return csv_text(trajectory.dataset() if isinstance(trajectory, Columns) else trajectory).encode()


def _netcdf(trajectory: xr.Dataset | Columns) -> bytes:
    dataset = trajectory.dataset() if isinstance(trajectory, Columns) else trajectory
    # No number is a mark for missing values.
    plain = {name: {"_FillValue": None} for name in dataset.variables}
    with _dask_aside() if _without_dask else contextlib.nullcontext():
        return bytes(dataset.to_netcdf(None, engine="scipy", encoding=plain))


def read(path: Path) -> xr.Dataset:
    """Trajectory from a file made by :func:`write`, read into memory; one from CSV has no attributes but units.

    Raises:
        OSError, ValueError: the file cannot be read, or does not have the format of its ending.
    """
    if path.suffix == STORED:
        return read_columns(path).dataset()
    if path.suffix == CSV:
        from proofroll.files.csv_table import read_csv

        return read_csv(ordinary_content(path).decode())
    import xarray as xr

    # Times stay numbers of seconds, and no number is a mark for missing values.
    content = ordinary_content(path)
    with reading(f"{path} is cut off, or no netCDF-3"):
        dataset = xr.load_dataset(io.BytesIO(content), engine="scipy", decode_times=False, mask_and_scale=False)
    return dataset.assign({name: item.astype(str) for name, item in dataset.variables.items() if item.dtype == object})


@dataclass(frozen=True)
class StoredTrajectory:
    """Trajectory in a file, read at the first access and kept in memory while there is room."""

    file: Path
    _held: ClassVar[deque[tuple[weakref.ref[StoredTrajectory], int]]] = deque()
    _one_at_a_time: ClassVar[Lock] = Lock()

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The trajectory; raises as :func:`read` does. The trajectories read longest ago are dropped to make room."""
        made = read(self.file)
        with self._one_at_a_time:
            used = [entry for entry in self._held if entry[0]() is not None]
            self._held.clear()
            self._held.extend([*used, (weakref.ref(self), made.nbytes)])
            while sum(size for _, size in self._held) > MOST_HELD and len(self._held) > 1:
                oldest = self._held.popleft()[0]()
                if oldest is not None:
                    vars(oldest).pop("dataset", None)
        return made

    @property
    def shown(self) -> str:
        """Path of the file, relative to the folder of a report, which contains the folder of results."""
        return f"{self.file.parent.name}/{self.file.name}"


def read_columns(path: Path) -> Columns:
    """Trajectory from a ``.npz`` file made by :func:`write`, without xarray.

    Raises:
        OSError, ValueError: the file cannot be read, or has another format.
    """
    content = ordinary_content(path)
    what = f"{path} is no stored trajectory"
    with reading(what), zipfile.ZipFile(io.BytesIO(content)) as archive:
        about, attrs = map(dict, json.loads(archive.read(_ABOUT)))  # first: a foreign file has none
    arrays = _arrays(content, what)
    with reading(what):
        variables = {name: Variable(tuple(dims), arrays[name], dict(its)) for name, (dims, its) in about.items()}
    return Columns(variables, attrs)


def read_arrays(path: Path, times: str = "time") -> dict[str, npt.NDArray[Any]]:
    """Arrays from a file made by ``numpy.savez``, by name.

    Args:
        path: file of numpy.
        times: name of the array of times; every other array has a row for each of them.

    Raises:
        OSError, ValueError: the file cannot be read, has another format, or an array other rows.
    """
    content = ordinary_content(path)
    return _arrays(content, f"{path.name} is no file of numpy's arrays", times)


def _arrays(content: bytes, what: str, times: str = "") -> dict[str, npt.NDArray[Any]]:
    """Arrays of a file of numpy by name, whose headers are parsed once for all that are alike.

    Raises:
        ValueError: a header promises what does not follow, whose memory numpy would ask for, or other rows than times.
    """
    arrays, headers, files, fault = dict[str, npt.NDArray[Any]](), dict[str, _Header](), dict[str, IO[bytes]](), ""
    with reading(what), zipfile.ZipFile(io.BytesIO(content)) as archive:
        for entry in [item for item in archive.infolist() if item.filename.endswith(".npy")]:
            name = entry.filename.removesuffix(".npy")
            files[name] = archive.open(entry)
            headers[name] = shape, _, kind = _header_of(files[name])
            if not fault and math.prod(shape) * kind.itemsize > entry.file_size:
                fault = f"the header of {name} promises {math.prod(shape):.3g} numbers, which do not follow"
        fault = fault or _other_rows(headers, times)
        for name, (shape, by_columns, kind) in headers.items() if not fault else ():
            numbers = bytearray(files[name].read())
            arrays[name] = np.ndarray(shape, kind, numbers, order="F" if by_columns else "C")
    if fault:
        raise ValueError(fault)
    return arrays


def _other_rows(headers: Mapping[str, _Header], times: str) -> str:
    """Clause on too many times, or on the first array whose rows are not as many; empty: there is none."""
    count = headers[times][0][:1] if times in headers else None
    if count and count[0] > MOST_SAMPLES:
        return f"it has {count[0]} times; thin them to at most {MOST_SAMPLES}"
    for name, (shape, _, _) in headers.items():
        if count is not None and shape[:1] != count:
            return f"{name} has the shape {shape}; give one row for each of {count[0] if count else 1} times"
    return ""


def _header_of(file: IO[bytes]) -> _Header:
    """Shape, order by columns, and type of an array, whose file stands at its numbers then."""
    version = np.lib.format.read_magic(file)
    size = file.read(2 if version == (1, 0) else 4)
    return _header(version, size + file.read(int.from_bytes(size, "little")))


@lru_cache(maxsize=1000)
def _header(version: tuple[int, int], text: bytes) -> _Header:
    """Shape, order by columns, and type of an array, by its header in a version of numpy's format."""
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, by_columns, kind = read(io.BytesIO(text))
    if kind.hasobject:
        raise ValueError("it holds objects, which only Python could load")
    return shape, by_columns, kind
