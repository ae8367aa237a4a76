"""Checks of user input: numbers, vectors, axes, inertias; each failure is one clear line."""

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator

from proofroll.core.errors import InputError


def _diagonal(value: Any) -> Any:
    """Diagonal matrix for a list of three numbers; any other value unchanged."""
    if (
        isinstance(value, list | tuple)
        and len(value) == 3
        and not any(isinstance(part, list | tuple) for part in value)
    ):
        return [[part if row == column else 0.0 for column in range(3)] for row, part in enumerate(value)]
    return value


Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]
# A list of numbers; a single one stands for a list of one.
Numbers = Annotated[
    tuple[float, ...], BeforeValidator(lambda value: value if isinstance(value, list | tuple) else [value])
]
# Rows of a matrix; a file may give three principal moments instead.
Inertia = Annotated[Matrix, BeforeValidator(_diagonal)]
METRES, RADIANS, RATIO = ({"unit": unit} for unit in ("m", "rad", "1"))
WORLD = "world"
ZERO: Vector = (0.0, 0.0, 0.0)
Z: Vector = (0.0, 0.0, 1.0)
Against = Literal["motion", "turning"]  # what rolling resistance opposes
Cone = Literal["separate", "shared"]  # bounds of sliding, spinning and rolling friction
_LONGEST_NAME = 200  # characters
_SQUARED = 1e-150  # sizes above it, and below its inverse, have squares within the range of numbers


def assign(item: object, **values: Any) -> None:
    """Sets fields of a frozen dataclass during its construction."""
    for key, value in values.items():
        object.__setattr__(item, key, value)


def read(item: object, place: str, reader: Callable[..., Any], *keys: str, **options: Any) -> None:
    """Replaces fields of a frozen dataclass, during its construction, by what a check, e.g. :func:`vector`, returns.

    ``place``: location of the item in the user's file; ``options``: of the check.
    """
    for key in keys:
        assign(item, **{key: reader(f"{place}.{key}", getattr(item, key), **options)})


def name(value: Any, kind: str) -> str:
    """The value as a name. Raises InputError if it is empty, not printable, or too long."""
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{kind}.name", value, "give a name")
    if not value.isprintable():
        raise InputError(f"{kind}.name", value, "a name is one line of printable characters")
    if len(value) > _LONGEST_NAME:
        raise InputError(f"{kind}.name", value, f"it has {len(value)} characters; a name may have {_LONGEST_NAME}")
    return value


def number(field: str, value: Any, *, at_least: float | None = None, bounded: bool = True) -> float:
    """The value as a finite float, or infinity unless ``bounded``.

    Raises:
        InputError: the value is not one, or lies below ``at_least``.
    """
    if not bounded and isinstance(value, float) and value == np.inf:
        return value
    try:
        return numbers(field, [value], 1, at_least=at_least)[0]
    except InputError as error:
        raise InputError(field, value, error.advice) from None


def numbers(field: str, value: Any, count: int, *, at_least: float | None = None) -> tuple[float, ...]:
    """The value as ``count`` finite floats; a single number stands for a list of one.

    Raises:
        InputError: the value is not ``count`` finite numbers, or one lies below ``at_least``.
    """
    try:
        values = np.atleast_1d(np.asarray(value))
        if values.dtype.kind not in "iuf":  # a bool or a text is no number, though numpy would make it one
            raise ValueError
    except ValueError:
        raise InputError(field, value, f"give {_count(count)}") from None
    if values.shape != (count,):
        raise InputError(field, value, f"give {_count(count)}")
    if not np.isfinite(values).all():
        raise InputError(field, value, "must be finite")
    if at_least is not None and (values < at_least).any():
        raise InputError(field, value, f"must be at least {at_least:g}")
    return tuple(float(x) for x in values)


def vector(field: str, value: Any) -> Vector:
    """The value as three finite floats. Raises InputError if it is not."""
    x, y, z = numbers(field, value, 3)
    return x, y, z


def axis(field: str, value: Any) -> Vector:
    """The value as a unit vector. Raises InputError if it is not three finite numbers, or zero."""
    vector_read = np.array(vector(field, value))
    largest = np.abs(vector_read).max()
    if largest == 0.0:
        raise InputError(field, value, "an axis of length zero has no direction; give a nonzero vector")
    if not _SQUARED < largest < 1 / _SQUARED:
        vector_read = vector_read / largest
    x, y, z = (float(component) for component in vector_read / np.linalg.norm(vector_read))
    return x, y, z


def inertia(field: str, value: Any) -> Matrix:
    """Inertia matrix of a rigid body, from three principal moments or a symmetric 3×3 matrix [kg m²].

    Raises:
        InputError: the tensor is not symmetric, has a negative principal moment, or breaks the triangle inequality.
    """
    try:
        matrix = np.asarray(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        matrix = np.zeros(0)
    if matrix.shape == (3,):
        matrix = np.diag(matrix)
    if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
        raise InputError(field, value, "give three principal moments or a 3x3 matrix of finite numbers, kg m^2")
    size = np.abs(matrix).max()
    # 1e-9: digits of a file; a flat body fulfils the triangle inequality with equality, so round-off must pass.
    if np.abs(matrix - matrix.T).max() > 1e-9 * size:
        raise InputError(field, value, "must be symmetric")
    matrix = matrix / 2 + matrix.T / 2  # whose sum could overflow
    low, middle, high = np.linalg.eigvalsh(matrix)
    if low < -1e-9 * size:
        raise InputError(field, value, f"has a negative principal moment, {low:g} kg m^2")
    if high - low - middle > 1e-9 * size:
        raise InputError(
            field,
            value,
            f"breaks the triangle inequality: {high:g} > {low:g} + {middle:g}; no rigid body has these moments",
        )
    rows = [vector(field, row) for row in matrix]
    return rows[0], rows[1], rows[2]


def _count(count: int) -> str:
    return "one number" if count == 1 else f"{count} numbers"
