"""Trajectories in netCDF files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

from proofroll.files.atomic import replacing

if TYPE_CHECKING:
    import xarray as xr


def write(dataset: xr.Dataset, path: Path) -> None:
    """Writes netCDF so that the file is either whole or not there.

    Raises:
        ProofrollError: the place cannot be written.
    """
    import h5py

    # Made in memory first: HDF5 does not survive a disk that fills while it writes, and the error would name no reason.
    content = io.BytesIO()
    with h5py.File(content, "w") as file:
        _fill(file, dataset)
    with replacing(path) as temporary:
        temporary.write_bytes(content.getbuffer())


def _fill(file: Any, dataset: xr.Dataset) -> None:
    """Variables, dimensions and attributes as netCDF-4 lays them out in HDF5 (NetCDF User's Guide, appendix C).

    The libraries above HDF5 look through all dimensions for each variable, which takes three times as long as this.
    """
    import h5py

    text = h5py.string_dtype()
    for name, length in dataset.sizes.items():
        if name not in dataset.coords:  # a dimension without values of its own
            file.create_dataset(name, shape=(length,), dtype=">f4")
            file[name].make_scale(f"This is a netCDF dimension but not a netCDF variable.{length:10d}")
    for name in sorted(dataset.variables, key=lambda name: name not in dataset.dims):  # scales before their users
        variable = dataset.variables[name]
        values = variable.to_numpy()
        kind = text if values.dtype.kind == "U" else None
        made = file.create_dataset(name, data=values.astype(object) if kind else values, dtype=kind)
        for key, value in variable.attrs.items():
            made.attrs[key] = value
        if name in dataset.dims:
            made.make_scale(name)
        else:
            for axis, dimension in enumerate(variable.dims):
                made.dims[axis].attach_scale(file[dimension])
    for key, value in dataset.attrs.items():
        file.attrs[key] = value


# What HDF5 keeps about dimensions in attributes.
_OF_HDF5 = frozenset({"CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST"})


def read(path: Path) -> xr.Dataset:
    """A trajectory from the netCDF file that :func:`write` made, wholly in memory.

    By HDF5 itself: the libraries above it take forty times as long for a file of this size, more than many a run.
    """
    import h5py
    import xarray as xr

    def attributes(item: Any) -> dict[str, Any]:
        return {key: item.attrs[key] for key in item.attrs if key not in _OF_HDF5}

    with h5py.File(path) as file:
        columns: dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]] = {}
        for name, item in file.items():
            own = item.is_scale
            if own and item.attrs["NAME"].startswith(b"This is a netCDF dimension but not a netCDF variable."):
                continue
            dims = (name,) if own else tuple(dim[0].name.rpartition("/")[2] for dim in item.dims)
            text = h5py.check_string_dtype(item.dtype)
            values = item.asstr()[...].astype(str) if text else item[...]
            columns[name] = (dims, values, attributes(item))
        coordinates = {name: column for name, column in columns.items() if column[0] == (name,)}
        others = {name: column for name, column in columns.items() if name not in coordinates}
        return xr.Dataset(others, coordinates, attributes(file))
