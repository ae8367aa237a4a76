"""The result of a run: one xarray.Dataset with units on every variable, and netCDF in and out."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.engine import Sample
from proofroll.files import replacing
from proofroll.mechanics import energy, slip_velocity
from proofroll.scene import RollingBall, Scene
from proofroll.surfaces import FloatArray, Surface

if TYPE_CHECKING:
    import xarray as xr


def from_samples(scene: Scene, times: FloatArray, samples: Sequence[Sample]) -> xr.Dataset:
    """The trajectory of a run.

    Args:
        scene: the scene that was run.
        times: of the samples [s], shape (time,).
        samples: one per time; fewer if the run ended early.
    """

    def stacked(values: list[FloatArray | None]) -> FloatArray | None:
        return None if any(value is None for value in values) else np.asarray(values, dtype=np.float64)

    p, v, w = (np.array([getattr(s, key) for s in samples], dtype=np.float64) for key in ("p_WB", "v_WB", "w_WB"))
    dataset = trajectory(
        scene,
        np.asarray(times[: len(samples)], dtype=np.float64),
        p,
        v,
        w,
        force=stacked([s.force for s in samples]),
        q_WB=stacked([s.q_WB for s in samples]),
    )
    if any(s.sticking is None for s in samples):
        return dataset
    sticking = np.array([s.sticking for s in samples], dtype=np.int8)  # netCDF has no boolean
    return dataset.assign(sticking=("time", sticking, {"units": "1", "long_name": "1 sticks, 0 slips"}))


def trajectory(
    scene: Scene,
    times: FloatArray,
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    *,
    force: FloatArray | None = None,
    q_WB: FloatArray | None = None,
) -> xr.Dataset:
    """Everything that follows from the state and the contact force, as one Dataset.

    Variables: ``p_WB`` [m], ``v_WB`` [m/s], ``w_WB`` [rad/s] with dims (time, xyz), ``q_WB`` (time, wxyz);
    the surface's coordinates (``gamma``, unwrapped, and ``z`` on a cylinder) and their rates; ``omega1..3`` [rad/s],
    ``slip2``, ``slip3`` [m/s] and ``N``, ``F2``, ``F3`` [N] in the local frame e1, e2, e3; ``needed_friction``
    |F|/N [-]; ``gap`` [m]; ``energy`` [J]. What the engine cannot say is absent.
    """
    import xarray as xr

    body = scene.rolling
    surface = body.surface
    rates = _coordinate_rates(surface, p_WB, v_WB)
    u = _unwrapped(body, times, surface.locate(p_WB), rates)
    frame = surface.frame(u)
    e1 = surface.normal(p_WB)
    spin = np.einsum("tij,ti->tj", frame, w_WB)
    slip = np.einsum("tij,ti->tj", frame, slip_velocity(body.ball.radius, e1, v_WB, w_WB))

    variables: dict[str, tuple[tuple[str, ...], FloatArray, dict[str, str]]] = {}

    def put(name: str, values: FloatArray, units: str, meaning: str, *dims: str) -> None:
        variables[name] = (("time", *dims), values, {"units": units, "long_name": meaning})

    put("p_WB", p_WB, "m", "centre of the ball in the world", "xyz")
    put("v_WB", v_WB, "m/s", "velocity of the centre in the world", "xyz")
    put("w_WB", w_WB, "rad/s", "angular velocity in the world", "xyz")
    if q_WB is not None:
        put("q_WB", q_WB, "1", "orientation, quaternion scalar first", "wxyz")
    for index, (name, unit) in enumerate(zip(surface.coordinates, surface.units, strict=True)):
        put(name, u[:, index], unit, f"surface coordinate {name}")
        put(f"{name}_rate", rates[:, index], f"{unit}/s", f"rate of {name}")
    for index in range(3):
        put(f"omega{index + 1}", spin[:, index], "rad/s", f"angular velocity about e{index + 1}")
    for index in (1, 2):
        put(f"slip{index + 1}", slip[:, index], "m/s", f"velocity of the contact point along e{index + 1}")
    if force is not None:
        local = np.einsum("tij,ti->tj", frame, force)
        put("N", -local[:, 0], "N", "normal force")
        put("F2", local[:, 1], "N", "friction on the ball along e2")
        put("F3", local[:, 2], "N", "friction on the ball along e3")
        with np.errstate(divide="ignore", invalid="ignore"):
            put("needed_friction", np.hypot(local[:, 1], local[:, 2]) / -local[:, 0], "1", "friction needed, |F|/N")
    put("gap", surface.gap(p_WB), "m", "distance of the ball from the wall")
    put("energy", energy(body, p_WB, v_WB, w_WB), "J", "kinetic plus potential energy")
    return xr.Dataset(
        variables,
        coords={"time": ("time", times, {"units": "s"}), "xyz": ["x", "y", "z"], "wxyz": ["w", "x", "y", "z"]},
        attrs={"scene": scene.name, "scene_digest": scene.digest} | _smallest(variables),
    )


def _smallest(variables: Mapping[str, tuple[tuple[str, ...], FloatArray, dict[str, str]]]) -> dict[str, float]:
    """``smallest_N``, the least normal force at the samples [N], without time 0 (where several engines know none)."""
    found = variables["N"][1] if "N" in variables else np.zeros(0)
    return {"smallest_N": float(np.min(found[1:] if len(found) > 1 else found))} if len(found) else {}


def _coordinate_rates(surface: Surface, p_WB: FloatArray, v_WB: FloatArray) -> FloatArray:
    tangents = surface.tangents(surface.locate(p_WB))
    return np.asarray(np.einsum("tij,tj->ti", np.linalg.pinv(tangents), v_WB))


def _unwrapped(body: RollingBall, times: FloatArray, located: FloatArray, rates: FloatArray) -> FloatArray:
    """Continuous coordinates: each point takes the branch nearest to what the rates predict.

    Prediction by the rates, rather than a plain unwrapping, stays right when samples are a turn or more apart.
    """
    u = located.copy()
    predicted = np.diff(times)[:, None] * (rates[1:] + rates[:-1]) / 2
    for column, period in enumerate(body.surface.periods):
        if period is None:
            continue
        step = predicted[:, column] - np.diff(located[:, column])
        turns = np.concatenate([[0.0], np.cumsum(np.round(step / period))])
        start = np.round((body.u0[column] - located[0, column]) / period)
        u[:, column] = located[:, column] + period * (turns + start)
    return u


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
        return {key: value for key, value in item.attrs.items() if key not in _OF_HDF5}

    with h5py.File(path) as file:
        columns: dict[str, tuple[tuple[str, ...], Any, dict[str, Any]]] = {}
        for name, item in file.items():
            own = item.is_scale
            if own and item.attrs["NAME"].startswith(b"This is a netCDF dimension but not a netCDF variable."):
                continue
            dims = (name,) if own else tuple(file[dim[0].name].name.rpartition("/")[2] for dim in item.dims)
            text = h5py.check_string_dtype(item.dtype)
            values = item.asstr()[...].astype(str) if text else item[...]
            columns[name] = (dims, values, attributes(item))
        coordinates = {name: column for name, column in columns.items() if column[0] == (name,)}
        others = {name: column for name, column in columns.items() if name not in coordinates}
        return xr.Dataset(others, coordinates, attributes(file))
