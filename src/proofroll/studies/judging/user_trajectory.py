"""Reads a trajectory from any program as a dataset with ``time`` and variables that can be compared with the truth."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.dataset import BETWEEN, add_events, columns_of, observe
from proofroll.core.element_abilities import BeginsAnywhere, WatchesRuns
from proofroll.core.engine import Sample
from proofroll.core.errors import Diverged, InputError, require_known
from proofroll.core.events import events_of, wrong_bracket
from proofroll.core.multi_element import REQUIRED
from proofroll.core.observable import Role
from proofroll.core.scene import Scene
from proofroll.core.time_grid import LATEST
from proofroll.core.unit_conversion import in_si, name_and_unit
from proofroll.core.whole_turns import on_turns_of
from proofroll.files.atomic import ordinary_content
from proofroll.files.trajectory_file import CSV, STORED
from proofroll.running.recording import require_unit
from proofroll.studies.judging.run_values import turned_alike

if TYPE_CHECKING:
    import xarray as xr

RunInput = Any
"""An ``xarray.Dataset``, the path of a file (netCDF, CSV, ``.npz``), or arrays by name, ``time`` [s] among them."""
_WRITE_NETCDF = "; xarray writes it by to_netcdf(path, format='NETCDF3_64BIT')"
FROM_STATE = "it follows from the state, which is judged"


@dataclass(frozen=True)
class GivenRun:
    """Run of the user.

    Attributes:
        dataset: with ``time``, and with all variables that follow from the state if that is given.
        units: variable -> its unit, if it has one.
        labels: dimension -> its labels (names of bodies) in order.
        besides: given variable -> reason why it is not judged, or None if that is not known yet; empty for a run of
            proofroll's own.
        reactions: columns that do not follow from the state: forces and moments.
        twice: column that follows from the state -> its values as given and as they follow, turns and signs alike.
    """

    dataset: xr.Dataset
    units: Mapping[str, str]
    labels: Mapping[str, list[str]]
    besides: Mapping[str, str | None]
    reactions: Collection[str] = ()
    twice: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)

    def require_units(self, truth: xr.Dataset) -> None:
        """Checks that variables are numbers, those with a unit in that of the truth, and bodies in its order.

        Raises:
            InputError: a variable has no numbers or another unit, or the bodies another order.
        """
        for dim, written in self.labels.items():
            expected = truth.variables[dim].values.tolist() if dim in truth.coords else written
            if written != expected:
                advice = f"name them as the scene does, in its order: {', '.join(expected)}"
                raise InputError("run", f"{dim} {', '.join(written)}", advice)
        variables = truth.variables
        for name, unit in self.units.items():
            if name in variables and "units" in variables[name].attrs:
                _require_unit(name, unit, str(variables[name].attrs["units"]))
        for column, item in self.dataset.variables.items():
            if column in variables and variables[column].dtype.kind in "iuf":
                _require_numbers(str(column), item)


def _require_numbers(name: str, item: xr.Variable | np.ndarray[Any, Any]) -> None:
    """Raises InputError unless a variable holds real numbers."""
    if item.dtype.kind not in "iuf":
        kinds = {"c": "complex numbers", "b": "truth values", "U": "text", "S": "text", "M": "dates", "m": "durations"}
        held = kinds.get(item.dtype.kind, f"values of type {item.dtype}")
        advice = "seconds as real numbers" if item.dtype.kind in "mM" else "real numbers"
        raise InputError("run", name, f"it holds {held}; give {advice}")


def _require_unit(name: str, unit: str, expected: str) -> None:
    if in_si(unit)[0] != expected:
        advice = f"convert {name} to {expected}, the unit of the truth, or correct its attribute units"
        raise InputError("run", f"{name} in {unit}", advice)


def read_run(run: RunInput, scene: Scene, columns: Mapping[str, str] | None = None) -> GivenRun:
    """Reads a trajectory; numbers in degrees, centimetres, milliseconds … are converted to SI units.

    Args:
        run: the trajectory.
        scene: the scene.
        columns: name in the trajectory -> name of a variable of the truth, perhaps with its unit: ``q.pivot[deg]``.

    Raises:
        InputError: the run is no trajectory, or belongs to another scene.
    """
    dataset = _converted(_dataset(run, columns or {}))
    made_of = dataset.attrs.get("scene_digest")
    if made_of is not None and str(made_of) != scene.digest:
        made = str(dataset.attrs.get("scene"))
        numbers = made == scene.name
        advice = f"it is a run of {made}" + (" with other numbers; give those parameters here too" if numbers else "")
        raise InputError("scene", scene.name, advice)
    units = {str(k): str(v.attrs["units"]).strip() for k, v in dataset.variables.items() if "units" in v.attrs}
    labels = {
        str(k): list(map(str, v.values))
        for k, v in dataset.variables.items()
        if k in dataset.coords and v.dtype.kind in "UO" and v.ndim
    }
    if "time" in units:
        _require_unit("time", units["time"], "s")
    times = dataset.variables["time"].values
    _require_numbers("time", dataset.variables["time"])
    if not (times.size and np.all(np.isfinite(times)) and times[0] >= 0 and np.all(np.diff(times) > 0)):
        raise InputError("run", "time", f"{_wrong_times(times)}give times in s that rise from 0 or later")
    if times[-1] > LATEST:
        raise InputError("run", f"time up to {times[-1]:.4g} s", f"no motion is followed beyond {LATEST:g} s")
    if times[-1] == 0:
        raise InputError("run", "time", "it has only the start, t = 0 s, where nothing has moved; add samples after it")
    _require_finite_state(dataset, scene)
    if wrong := wrong_bracket(events_of(dataset)):
        raise InputError("run", "event_low", wrong)
    if made_of is not None:
        if _whole(dataset, scene):
            return GivenRun(dataset, units, labels, {}, twice=_twice(dataset, scene))
        # The user left variables out: the rest, on the grid only, is judged like a foreign run.
        dataset = dataset.drop_dims(BETWEEN, errors="ignore").drop_attrs(deep=False)
    names = [str(name) for name in dataset.data_vars]
    # a scene of several elements is judged by its given variables only
    if not all(name in dataset for name in REQUIRED) or len(scene.elements) > 1 or times[0] > 0:
        return GivenRun(dataset, units, labels, dict.fromkeys(names))
    state = [item.name for item in fields(scene.elements[0].sample_type) if item.name in dataset]
    completed = _completed(dataset, scene, times)
    # Reactions do not follow from the state: they are judged as they are given.
    values = {name for name in names if name in completed and np.any(np.isfinite(completed[name].to_numpy()))}
    kept = [name for name in names if name not in state and name not in values]
    besides: dict[str, str | None] = dict.fromkeys([name for name in names if name not in (*state, *kept)], FROM_STATE)
    besides |= dict.fromkeys((*state, *kept))  # the judged observables may be of some bodies' places alone
    return GivenRun(
        dataset=completed.assign({name: dataset[name] for name in kept}),
        units=units,
        labels=labels,
        besides=besides,
        reactions=kept,
        twice=_twice(dataset, scene, completed),
    )


def begun(scene: Scene, run: xr.Dataset) -> Scene:
    """The scene; one of a file that gives no start, with that of the trajectory's first row, if this has all of it."""
    if not _is_drawn(scene) or "scene_digest" in run.attrs or float(run["time"][0]):
        return scene
    variables = {str(name): item for name, item in run.isel(time=0).data_vars.items() if not item.dims}
    values = {name: float(item) for name, item in variables.items() if name.startswith(("q.", "v."))}
    values = {name: value for name, value in values.items() if np.isfinite(value)}
    elements = [item.begun(values) if isinstance(item, BeginsAnywhere) else None for item in scene.elements]
    return replace(scene, elements=tuple(filter(None, elements))) if all(elements) else scene


def _is_drawn(scene: Scene) -> bool:
    """True if the start of the scene is a random one."""
    return "seed" in scene.parameters and not scene.parameters.get("keyframe")


def start_words(scene: Scene, judged: Scene, run: xr.Dataset) -> str:
    """Sentence on where the truth of a file that gives no start begins; empty: the file gives one."""
    if not _is_drawn(scene) or "scene_digest" in run.attrs:
        return ""
    if judged is not scene:
        return "the file gives no start: the truth begins as the first row"
    giving = "of an open tree of hinges and slides, q.JOINT and v.JOINT of all in a first row at time 0 give one"
    return f"the file gives no start, so a random one was taken; {giving}"


def _whole(run: xr.Dataset, scene: Scene) -> bool:
    """True if a run of proofroll's own still has all headline variables of its motion."""
    try:
        observed = observe(scene, run)
    except (KeyError, AttributeError):  # of xarray, for a variable or an attribute of one that is not there
        return False
    motion = [name for name, item in scene.observables.items() if item.headline and item.role is Role.MOTION]
    return all(name in observed for name in motion)


def _require_finite_state(run: xr.Dataset, scene: Scene) -> None:
    """Raises InputError unless positions, velocities and orientations are finite, and quaternions of unit length."""
    for element in scene.elements:
        for variable in element.sample_type.widths:
            name = scene.label(element, variable)
            item = run.variables.get(name)
            if item is None or item.dims[:1] != ("time",):
                continue
            _require_numbers(name, item)
            values = item.values.reshape(len(item), -1)
            bad = ~np.all(np.isfinite(values), axis=1)
            if np.any(bad):
                time = float(run["time"][int(np.argmax(bad))])
                rows = f" and in {bad.sum() - 1} of the {len(bad)} rows besides" if bad.sum() > 1 else ""
                raise InputError("run", name, f"it is not finite at {time:.6g} s{rows}; leave it out, or correct it")
            if variable == "q_WB" and values.shape[1] % 4 == 0:
                try:
                    require_unit(values.reshape(-1, 4), "somewhere")
                except Diverged as error:
                    raise InputError("run", name, str(error)) from None


def _converted(run: xr.Dataset) -> xr.Dataset:
    """The trajectory with numbers in SI units where their units are known, none longer than float64."""
    changes: dict[Any, Any] = {}
    for name, item in run.variables.items():
        written = str(item.attrs.get("units", "")).strip()
        unit, factor = in_si(written)
        longer = item.dtype.kind == "f" and item.dtype.itemsize > np.dtype(float).itemsize
        if item.dtype.kind in "iuf" and (factor != 1.0 or longer):
            values = item.values.astype(float) if longer else item.values
            changes[name] = (item.dims, values * factor, {**item.attrs, "units": unit} if written else item.attrs)
    times = {"time": changes.pop("time")} if "time" in changes else {}
    converted: xr.Dataset = run.assign_coords(times).assign(changes)
    return converted


def _renamed(run: xr.Dataset, columns: Mapping[str, str]) -> xr.Dataset:
    """The trajectory with its variables renamed, and units given to them. Raises InputError for an unknown name."""
    for name, text in columns.items():
        require_known("columns", name, map(str, run.variables), "the trajectory has")
        new, unit = name_and_unit(text)
        run = run.assign({name: run[name].assign_attrs({"units": unit})}) if unit else run
        run = run.rename({name: new})
    return run.set_coords("time") if "time" in run else run


def _wrong_times(times: Any) -> str:
    """The first mistake in times [s] as a clause; empty where they are no numbers at all."""
    if not times.size:
        return "there are no samples; "
    if times.ndim != 1:
        return ""
    if np.any(late := ~np.isfinite(times)):
        return f"sample {int(np.argmax(late)) + 1} has no time; "
    if np.any(back := np.diff(times) <= 0):
        index = int(np.argmax(back))
        return f"{times[index + 1]:.9g} s follows {times[index]:.9g} s; "
    return f"it begins at {times[0]:.9g} s; "


def _dataset(run: RunInput, columns: Mapping[str, str]) -> xr.Dataset:
    """The trajectory as a dataset with ``time``."""
    import xarray as xr

    if isinstance(run, str | Path):
        try:
            path = Path(run)
            run = _from_file(path, columns)
            columns = {} if path.suffix == CSV else columns  # whose header is renamed as it is read
        except FileNotFoundError:
            raise InputError("run", Path(run), "there is no such file") from None
        except MemoryError:
            raise InputError("run", Path(run), "its numbers do not fit into the memory") from None
        except (OSError, ValueError, LookupError) as error:  # a truncated file may raise any of them
            how = "" if Path(run).suffix in {CSV, STORED} else _WRITE_NETCDF
            advice = f"it cannot be read ({error}){how}"
            raise InputError("run", Path(run), advice) from None
    if isinstance(run, xr.Dataset):
        dataset = _renamed(run, columns)
        if "time" not in dataset.variables:
            names = ", ".join(map(str, dataset.variables))
            raise InputError("run", names, "it has no time; add the times in s as time")
        return dataset
    for name, text in columns.items():
        require_known("columns", name, run, "the trajectory has")
        new, unit = name_and_unit(text)
        renamed = xr.DataArray(np.asarray(run[name]), attrs={"units": unit} if unit else {})
        run = {key: item for key, item in run.items() if key != name} | {new: renamed}
    arrays = {str(name): np.asarray(run[name]) for name in run}
    if "time" not in arrays:
        raise InputError("run", ", ".join(arrays) or "nothing", "it has no time; add the times in s as time")
    for column, values in arrays.items():
        if column == "time" or (values.dtype.kind in "mM" and np.datetime_data(values.dtype)[0] == "generic"):
            _require_numbers(column, values)  # of dates without a unit numpy cannot even make a text
    _check_lengths(arrays)
    if arrays["time"].dtype == np.float16:
        arrays["time"] = arrays["time"].astype(float)  # an index cannot hold them
    attrs = {str(name): dict(getattr(run[name], "attrs", {})) for name in run}
    dims = {name: ("time", *(f"{name}_{axis}" for axis in range(1, np.ndim(v)))) for name, v in arrays.items()}
    variables = {name: (dims[name], values, attrs[name]) for name, values in arrays.items()}
    return xr.Dataset({name: item for name, item in variables.items() if name != "time"}, {"time": variables["time"]})


def _from_file(path: Path, columns: Mapping[str, str]) -> RunInput:
    """Content of a file: a dataset, or arrays by name for numpy's own formats."""
    from proofroll.files.trajectory_file import read, read_arrays

    if path.suffix == CSV and columns:
        from proofroll.files.csv_table import read_csv

        return read_csv(ordinary_content(path).decode(), columns)
    try:
        return read(path)
    except ValueError:
        if path.suffix != STORED:
            raise
        times = next((name for name, text in columns.items() if name_and_unit(text)[0] == "time"), "time")
        return read_arrays(path, times)


def _check_lengths(arrays: Mapping[str, Any]) -> None:
    shape = np.shape(arrays["time"])
    if len(shape) != 1:
        raise InputError("run", "time", f"its shape is {shape}; give one number for each sample")
    count = shape[0]
    for name, values in arrays.items():
        if np.ndim(values) == 0 or len(values) != count:
            raise InputError(
                "run", name, f"its shape is {np.shape(values)}; give one row for each of the {count} times"
            )


def _samples(run: xr.Dataset, scene: Scene, count: int) -> list[dict[str, Sample]]:
    """The states of all elements at each of these times."""
    samples: list[dict[str, Sample]] = [{} for _ in range(count)]
    for element in scene.elements:
        names = {item.name: scene.label(element, item.name) for item in fields(element.sample_type)}
        arrays = {key: np.asarray(run.variables[name].values, float) for key, name in names.items() if name in run}
        for index, sample in enumerate(samples):
            sample[element.name] = element.sample_type(**{key: values[index] for key, values in arrays.items()})
    return samples


def _completed(run: xr.Dataset, scene: Scene, times: FloatArray) -> xr.Dataset:
    """Dataset with all variables that follow from the state of a scene's only element, and its events."""
    element = scene.elements[0]
    try:
        samples = _samples(run, scene, len(times))
        columns = columns_of(scene, times, samples)
        if isinstance(element, WatchesRuns):
            events = element.watch(scene.asks).conclude(times, [item[element.name] for item in samples], None).events
            columns = columns if events is None else add_events(scene, element, columns, events)
        return columns.dataset()
    except (ValueError, TypeError, Diverged) as error:
        shapes = ", ".join(
            f"{item.name} {run[item.name].shape}" for item in fields(element.sample_type) if item.name in run
        )
        raise InputError("run", shapes, f"these are no states of {scene.name} ({error})") from None


def _twice(
    run: xr.Dataset, scene: Scene, follows: xr.Dataset | None = None
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """``twice`` of a :class:`GivenRun`; what the state does not determine is zero in both.

    Args:
        run: as given.
        scene: of the run.
        follows: all variables that follow from its state, if they are known.
    """
    if follows is None:
        try:
            times = run.variables["time"].values
            follows = columns_of(scene, times, _samples(run, scene, len(times))).dataset()
        except (TypeError, Diverged):  # a part of the state was left out
            return {}
    columns, given = {}, run.variables  # indexing a dataset would make coordinates, too
    for name, item in follows.variables.items():
        if name not in given or item.dims[:1] != ("time",) or given[name].shape != item.shape or name == "time":
            continue
        derived_values, values = item.values, given[name].values
        finite_mask = np.isfinite(derived_values)
        values = turned_alike(values, derived_values) if item.dims[-1:] == ("wxyz",) else values
        turned = on_turns_of(derived_values, values, str(name), (follows, run))
        if turned is not None and finite_mask.any():
            columns[str(name)] = np.where(finite_mask, turned, 0.0), np.where(finite_mask, derived_values, 0.0)
    return columns
