"""The variables of a run as plain arrays, without xarray, whose import takes half the time of a short run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import xarray as xr

# Prefix of an attribute of the whole dataset: ``smallest_<variable>`` is the least value of that variable.
SMALLEST = "smallest_"
# Attribute UNCERTAIN of a variable: why its values may be wrong through no fault of an engine, as a clause. An angle
# with the attribute PERIOD (in its unit) may be wrong by whole periods.
UNCERTAIN, PERIOD = "uncertain", "period"
# Attribute of a variable that a run sums over its samples: error of that sum, in its unit.
SAMPLED_BAR = "sampled_bar"


class Variable(NamedTuple):
    """One variable; its fields have the order of xarray's constructor.

    Attributes:
        dims: names of the dimensions; a variable with the name of its only dimension is that dimension's coordinate.
        values: in the unit ``attrs["units"]``.
        attrs: ``units``, ``long_name`` and further attributes.
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
        variables: by name, with those of the dimensions.
        attrs: attributes of the whole dataset.

    Raises:
        ValueError: the number of dimensions does not fit a variable's shape, or two variables have different lengths
        along one dimension; a file would hide that where one length is 1.
    """

    variables: Mapping[str, Variable]
    attrs: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lengths: dict[str, int] = {}
        for name, (dims, values, _) in self.variables.items():
            shape = np.shape(values)
            if len(shape) != len(dims):
                declared = f"the dimensions {', '.join(dims)}" if dims else "no dimension"
                raise ValueError(f"{name} has the shape {shape}, and {declared}")
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

    def assign(self, **attrs: Any) -> Columns:
        """Copy with further attributes."""
        return Columns(self.variables, {**self.attrs, **attrs})

    def at(self, dim: str, chosen: npt.NDArray[np.bool_]) -> Columns:
        """Columns restricted to the indices along ``dim`` at which ``chosen`` is True."""
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
    """Coordinate variables ``time`` [s], ``xyz`` and ``wxyz`` of quantities that depend on time and world axes."""
    components = {name: Variable((name,), np.array(list(name))) for name in ("xyz", "wxyz")}
    return {"time": Variable(("time",), times, {"units": "s"})} | components
