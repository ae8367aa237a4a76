"""Trajectories in files: numpy's ``.npz`` between processes and in the store, netCDF and CSV for people and programs.

numpy is imported anyway; what reads and writes netCDF takes longer to import than a short run to make.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import weakref
import zipfile
import zlib
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import numpy.typing as npt

from proofroll.core.columns import Columns, Variable
from proofroll.files.atomic import ordinary_content, replacing

if TYPE_CHECKING:
    import xarray as xr

# Endings of the files in which trajectories are stored, and in which a person is given one.
STORED, NETCDF, CSV = ".npz", ".nc", ".csv"
# Trajectories that were read stay in memory up to this size together [bytes]: those of a few comparisons.
MOST_HELD = 128 * 2**20
# What is in such a file beside an array for each variable: their dimensions and all attributes.
_ABOUT = "about.json"
# Whether xarray was imported without dask, so that it may go on without: it asks for a scheduler when it writes.
_without_dask = False
# What numpy raises where a file is another, or damaged.
_NO_SUCH_FILE = (zipfile.BadZipFile, zlib.error, EOFError, KeyError, RecursionError, TypeError, ValueError)


def import_xarray() -> None:
    """Import xarray without dask, in a process that uses no array of dask's.

    At its first array xarray imports all of dask, half of what a run of a second costs; no array of ours is dask's.
    """
    global _without_dask  # noqa: PLW0603 -- of the process, as xarray's own memory of dask is
    first = not {"xarray", "dask"} & set(sys.modules)
    with _dask_aside():
        import xarray as xr

        xr.Variable((), 0.0)
    _without_dask |= first


@contextlib.contextmanager
def _dask_aside() -> Iterator[None]:
    """Context in which xarray does not find dask, unless dask is imported already."""
    hidden = "dask" not in sys.modules
    if hidden:
        sys.modules["dask"] = None  # type: ignore[assignment]  # what Python documents to make an import fail
    try:
        yield
    finally:
        if hidden:
            sys.modules.pop("dask", None)


def write(trajectory: xr.Dataset | Columns, path: Path) -> None:
    """Writes a file, by its ending, so that it is either whole or not there.

    netCDF-3 has no integers beyond 32 bits: a number that does not fit is refused. All others stay as they are.

    Raises:
        ProofrollError: the place cannot be written.
        ValueError: the format cannot hold a number.
    """
    # Made in memory first: a disk that fills meanwhile gives one reason, and no half of a file.
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
    said = {name: [item.dims, dict(item.attrs)] for name, item in columns.variables.items()}
    about = json.dumps([said, dict(columns.attrs)], default=lambda value: value.tolist())  # an array, or one number
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr(zipfile.ZipInfo(_ABOUT), about)  # of no date: the same trajectory gives the same file
        for name, item in columns.variables.items():
            with archive.open(f"{name}.npy", "w") as entry:
                np.lib.format.write_array(entry, item.values, allow_pickle=False)
    return buffer.getvalue()


def _csv(trajectory: xr.Dataset | Columns) -> bytes:
    from proofroll.files.csv_table import csv_text

    return csv_text(trajectory.dataset() if isinstance(trajectory, Columns) else trajectory).encode()


def _netcdf(trajectory: xr.Dataset | Columns) -> bytes:
    dataset = trajectory.dataset() if isinstance(trajectory, Columns) else trajectory
    # No number stands for an absent one.
    plain = {name: {"_FillValue": None} for name in dataset.variables}
    with _dask_aside() if _without_dask else contextlib.nullcontext():
        return bytes(dataset.to_netcdf(None, engine="scipy", encoding=plain))


def read(path: Path) -> xr.Dataset:
    """A trajectory from a file that :func:`write` made, wholly in memory; of CSV without attributes.

    Raises:
        OSError, ValueError: it cannot be read, or is of another kind than its ending says.
    """
    if path.suffix == STORED:
        return read_columns(path).dataset()
    if path.suffix == CSV:
        from proofroll.files.csv_table import read_csv

        return read_csv(ordinary_content(path).decode())
    import xarray as xr

    # Times stay numbers of seconds, and no number stands for an absent one.
    try:
        dataset = xr.load_dataset(
            io.BytesIO(ordinary_content(path)), engine="scipy", decode_times=False, mask_and_scale=False
        )
    except (TypeError, LookupError):
        raise ValueError(f"{path} is cut off, or no netCDF-3") from None
    return dataset.assign({name: item.astype(str) for name, item in dataset.variables.items() if item.dtype == object})


@dataclass(frozen=True)
class StoredTrajectory:
    """A trajectory in a file, read when it is first asked for and held while there is room for it."""

    file: Path
    _held: ClassVar[deque[tuple[weakref.ref[StoredTrajectory], int]]] = deque()
    _one_at_a_time: ClassVar[Lock] = Lock()

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The trajectory; raises as :func:`read` does. What was read longest ago makes room for it."""
        made = read(self.file)
        with self._one_at_a_time:
            self._held.append((weakref.ref(self), made.nbytes))
            while sum(size for _, size in self._held) > MOST_HELD and len(self._held) > 1:
                oldest = self._held.popleft()[0]()
                if oldest is not None:
                    vars(oldest).pop("dataset", None)
        return made

    @property
    def shown(self) -> str:
        """Path of the file from the folder of a report, in which that of the results lies."""
        return f"{self.file.parent.name}/{self.file.name}"


def read_columns(path: Path) -> Columns:
    """A stored trajectory, without xarray.

    Raises:
        OSError, ValueError: it cannot be read, or is no such file.
    """
    content = ordinary_content(path)
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            said, attrs = map(dict, json.loads(file[_ABOUT]))
            variables = {name: Variable(tuple(dims), file[name], dict(own)) for name, (dims, own) in said.items()}
    except _NO_SUCH_FILE as error:
        raise ValueError(f"{path} is no stored trajectory") from error
    return Columns(variables, attrs)


def read_arrays(path: Path) -> dict[str, npt.NDArray[Any]]:
    """The arrays of a file that ``numpy.savez`` made.

    Raises:
        OSError, ValueError: it cannot be read, or is no such file.
    """
    try:
        with np.load(io.BytesIO(ordinary_content(path)), allow_pickle=False) as file:
            return dict(file)
    except _NO_SUCH_FILE as error:
        raise ValueError(f"{path.name} is no file of numpy's arrays") from error
