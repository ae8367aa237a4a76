"""The variables of a run as plain arrays: to import xarray for them is half of what a short run costs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray as xr

# Beginning of an attribute of all: the least value of the variable named after it, where that tells something.
SMALLEST = "smallest_"
# Attribute of a variable whose values may be off for a reason that is no engine's: the reason, in a clause. Those of an
# angle may be off by whole turns, each as large as the attribute PERIOD says, in its unit.
UNCERTAIN, PERIOD = "uncertain", "period"


class Variable(NamedTuple):
    """One variable, in the order in which xarray takes one.

    Attributes:
        dims: names of the dimensions; a variable named as its only dimension is that dimension's coordinate.
        values: in the unit ``attrs["units"]``.
        attrs: ``units``, ``long_name`` and what else there is to say.
    """

    dims: tuple[str, ...]
    values: npt.NDArray[Any]
    attrs: Mapping[str, Any] = {}

    def to_numpy(self) -> npt.NDArray[Any]:
        """The values, as an xarray variable gives them."""
        return self.values


@dataclass(frozen=True)
class Columns:
    """Content of an ``xarray.Dataset``.

    Attributes:
        variables: by name, those of the dimensions among them.
        attrs: attributes of the whole dataset.

    Raises:
        ValueError: variables have other lengths along one dimension, which a file would hide where one of them is 1.
    """

    variables: Mapping[str, Variable]
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths: dict[str, int] = {}
        for name, (dims, values, _) in self.variables.items():
            shape = np.shape(values)
            if len(shape) != len(dims):
                said = f"the dimensions {', '.join(dims)}" if dims else "no dimension"
                raise ValueError(f"{name} has the shape {shape}, and {said}")
            for dim, length in zip(dims, shape, strict=True):
                if lengths.setdefault(dim, length) != length:
                    raise ValueError(f"{name} has {length} values along {dim}, and others have {lengths[dim]}")

    @classmethod
    def of(cls, dataset: xr.Dataset) -> Columns:
        """Columns of a dataset."""
        variables = dataset.variables.items()
        columns = {str(name): Variable(tuple(map(str, v.dims)), v.to_numpy(), v.attrs) for name, v in variables}
        return cls(columns, {str(key): value for key, value in dataset.attrs.items()})

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]

    def assign(self, **said: Any) -> Columns:
        """Copy with further attributes."""
        return Columns(self.variables, {**self.attrs, **said})

    def at(self, dim: str, chosen: npt.NDArray[np.bool_]) -> Columns:
        """Columns at the chosen places along one dimension."""
        variables = {
            name: item._replace(values=np.compress(chosen, item.values, item.dims.index(dim)))
            if dim in item.dims
            else item
            for name, item in self.variables.items()
        }
        return Columns(variables, self.attrs)

    def dataset(self) -> xr.Dataset:
        """The columns as an ``xarray.Dataset``."""
        import xarray as xr

        return xr.Dataset(self.variables, attrs=self.attrs)


def axes(times: npt.NDArray[np.float64]) -> dict[str, Variable]:
    """The coordinates of what depends on the time [s] and on components in the world."""
    components = {name: Variable((name,), np.array(list(name))) for name in ("xyz", "wxyz")}
    return {"time": Variable(("time",), times, {"units": "s"})} | components
