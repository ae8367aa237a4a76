"""Trajectories as CSV for any other program: a column for each number over time, with its unit in the header.

The header names each column as ``q.pivot [rad]``. An array has a column for each of its numbers, whose labels
follow its name: ``p_WB/rod/x [m]``. Attributes, and variables without the dimension time, are left out.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.unit_conversion import name_and_unit

if TYPE_CHECKING:
    import xarray as xr

_LONGEST = 300  # characters of names that a message lists
_AXES = ("xyz", "wxyz")


def csv_text(trajectory: xr.Dataset) -> str:
    """CSV of all numbers of a trajectory over time, to the last bit."""
    columns = [trajectory["time"], *trajectory.data_vars.values()]
    header, values = [], []
    for item in columns:
        if item.dims[:1] != ("time",) or item.dtype.kind not in "fiub":
            continue
        unit = f" [{item.attrs['units']}]" if "units" in item.attrs else ""
        header += [column + unit for column in column_names(item)]
        numbers = item.to_numpy()
        numbers = numbers.astype(np.int8) if numbers.dtype == bool else numbers
        values += list(numbers.reshape(len(numbers), -1).T.tolist())
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([header, *zip(*values, strict=True)])
    return text.getvalue()


def column_names(item: xr.DataArray) -> list[str]:
    """Names of the columns of a variable, one for each of its numbers at a time: ``p_WB/rod/x``."""
    labels = [item[dim].to_numpy().tolist() if dim in item.coords else range(item.sizes[dim]) for dim in item.dims[1:]]
    return ["/".join(map(str, (item.name, *labels_of))) for labels_of in itertools.product(*labels)]


def read_csv(text: str, new_names: Mapping[str, str] | None = None) -> xr.Dataset:
    """Trajectory in a CSV file, whose columns are separated by commas, or by semicolons or tabs if its header has some.

    Beside semicolons and tabs, numbers may have decimal commas.

    Args:
        text: of the file.
        new_names: column -> its name here, perhaps with a unit, ``q.pivot[deg]``.

    Raises:
        ValueError: the text is no table of numbers with a header, lacks a column of ``new_names`` or the column time.
    """
    text = text.removeprefix("\ufeff").removeprefix("#")
    head = text.partition("\n")[0]
    separator = next((mark for mark in ";\t" if mark in head), ",")
    reader = csv.reader(io.StringIO(text), strict=True, delimiter=separator)
    try:
        rows = list(reader)
    except csv.Error as error:  # for example an unclosed quote
        raise ValueError(f"line {reader.line_num}: {error}") from None
    header = [field.strip() for field in rows[0]] if rows else []
    if not any(header):
        raise ValueError("it is empty; its first line has names with units, as time [s], q.pivot [rad]")
    listed = ", ".join(header)[:_LONGEST]
    header = _renamed(header, new_names or {})
    numbers = _numbers(header, rows[1:], decimal_comma=separator != ",")
    columns: dict[str, dict[tuple[str, ...], Any]] = {}
    units: dict[str, set[str]] = {}
    for index, field in enumerate(header):
        whole, unit = name_and_unit(field)
        name, *labels = whole.split("/")
        if not name:
            raise ValueError(
                f"column {index + 1} is called {field!r}; the header has names with units, as q.pivot [rad]"
            )
        cells = columns.setdefault(name, {})
        if tuple(labels) in cells:
            raise ValueError(f"two columns are called {'/'.join((name, *labels))}")
        cells[tuple(labels)] = numbers[:, index]
        if unit is not None:
            units.setdefault(name, set()).add(unit)
    if "time" not in columns:
        raise ValueError(
            f"it has no column time [s]; its first line has the names, here {listed}; "
            "--map t=time,theta=q.pivot[deg] names the columns"
        )
    variables: dict[str, Any] = {}
    coordinates: dict[str, list[str]] = {}
    for name, cells in columns.items():
        if len(units.get(name, ())) > 1:
            raise ValueError(f"the columns of {name} have several units")
        values, labels_of = _array(name, cells)
        dims = ["time"]
        for level, names in enumerate(labels_of):
            dims.append(_dimension(name, level, names))
            if not names[0].isdigit():
                coordinates[dims[-1]] = list(names)
        variables[name] = (dims, values, {"units": units[name].pop()} if name in units else {})
    import xarray as xr

    return xr.Dataset(variables, coordinates)


def _renamed(header: list[str], names: Mapping[str, str]) -> list[str]:
    """Header with columns renamed. Raises ValueError if one is not there."""
    plain = [name_and_unit(field) for field in header]
    for name in names:
        if name not in [original for original, _ in plain]:
            raise ValueError(
                f"it has no column {name}; it has {', '.join(original for original, _ in plain)[:_LONGEST]}"
            )
    renamed = []
    for field, (name, unit) in zip(header, plain, strict=True):
        new, new_unit = name_and_unit(names[name]) if name in names else (name, None)
        kept = unit if new_unit is None else new_unit
        renamed.append(field if name not in names else new if kept is None else f"{new} [{kept}]")
    return renamed


def _dimension(name: str, level: int, labels: Sequence[str]) -> str:
    """Name of a dimension of an array: ``xyz``, ``wxyz``, ``body``, or one of its own."""
    axes = "".join(labels)
    if axes in _AXES:
        return axes
    return "body" if level == 0 and not labels[0].isdigit() else f"{name}_{level + 1}"


def _numbers(header: list[str], rows: list[list[str]], *, decimal_comma: bool) -> Any:
    numbers, wrong = [], list[str]()
    for line, row in enumerate(rows, start=2):
        if not any(field.strip() for field in row):  # spreadsheets end with rows of separators
            continue
        fields = [field.replace(",", ".") if decimal_comma else field for field in row]
        try:
            if len(row) != len(header):
                raise ValueError(f"line {line} has {len(row)} fields, the header {len(header)}")
            numbers.append([_number(field, line, column) for field, column in zip(fields, header, strict=True)])
        except ValueError as error:
            wrong.append(str(error))
    if wrong:
        further = f"; {len(wrong) - 1} further lines are wrong" if len(wrong) > 1 else ""
        raise ValueError(f"{wrong[0]}{further}")
    return np.array(numbers).reshape(len(numbers), len(header))


def _number(field: str, line: int, column: str) -> float:
    try:
        if "_" in field:  # which Python would ignore
            raise ValueError
        return float(field)
    except ValueError:
        what = f"{field[:60]!r} is no number" if field.strip() else "there is no number"
        raise ValueError(f"line {line}, column {column}: {what}; fill it, or leave its row or column out") from None


def _array(name: str, columns: Mapping[tuple[str, ...], Any]) -> tuple[Any, list[tuple[str, ...]]]:
    """Values with time first, and the labels of each further dimension; ``xyz`` and ``wxyz`` in their usual order."""
    depth = {len(labels) for labels in columns}
    labels = [tuple(dict.fromkeys(level)) for level in zip(*columns, strict=len(depth) == 1)]
    labels = [next((tuple(axes) for axes in _AXES if set(axes) == set(level)), level) for level in labels]
    expected = list(itertools.product(*labels))
    part = bool(labels) and set(labels[-1]) < set("wxyz") and "".join(labels[-1]) not in _AXES
    if part or len(depth) > 1 or set(expected) != set(columns):
        raise ValueError(f"the columns of {name} are not whole; write one for each of {name}/x, {name}/y, {name}/z")
    values = np.stack([columns[label] for label in expected], axis=1)
    return values.reshape(-1, *map(len, labels)), labels
