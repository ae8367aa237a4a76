"""Types of arrays, read-only arrays, and the largest difference of two arrays."""

import dataclasses
import itertools
import math
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
T = TypeVar("T")


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def read_only(item: T) -> T:
    """Makes all arrays of an item read-only, and returns the item.

    It descends into dataclasses (with their cached properties), tuples, lists and mappings to any depth.
    """
    inside: Iterable[Any] = ()
    if isinstance(item, np.ndarray):
        item.flags.writeable = False
    elif item is None or isinstance(item, str | int | float):
        pass  # most of what is inside, and the tests below are slow
    elif isinstance(item, Mapping):
        inside = item.values()
    elif isinstance(item, (tuple, list)):
        inside = item
    elif dataclasses.is_dataclass(item) and not isinstance(item, type):
        members = vars(item) if hasattr(item, "__dict__") else [field.name for field in dataclasses.fields(item)]
        inside = [getattr(item, name) for name in members]
    for part in inside:
        read_only(part)
    return item


def in_single_precision(values: FloatArray) -> bool:
    """True if every number is a float32 exactly and some are not whole; doubles are so only by rare chance."""
    return bool(np.any(values % 1) and np.array_equal(values, values.astype(np.float32)))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of two vectors or lists of vectors, (3,) or (n, 3); several times faster than numpy's."""
    product: FloatArray = a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1)
    return product


def hermite(grid: FloatArray, values: FloatArray, rates: FloatArray, times: FloatArray) -> FloatArray:
    """Cubic interpolation of samples with their rates, shape (grid, …), at times within the grid; shape (times, …)."""
    index = np.clip(np.searchsorted(grid, times, side="right") - 1, 0, len(grid) - 2)
    rows = (-1, *[1] * (values.ndim - 1))
    step = np.diff(grid)[index].reshape(rows)
    s = (times - grid[index]).reshape(rows) / step
    bend = s * (1 - s) * step * ((1 - s) * rates[index] - s * rates[index + 1])
    return np.asarray(values[index] + s * s * (3 - 2 * s) * (values[index + 1] - values[index]) + bend)


def slices(counts: Iterable[int]) -> tuple[slice, ...]:
    """Slices of consecutive parts with the given sizes."""
    ends = itertools.accumulate(counts, initial=0)
    return tuple(slice(start, end) for start, end in itertools.pairwise(ends))


def on_turns(time: FloatArray, u: FloatArray, rate: FloatArray, start: float, period: float) -> FloatArray:
    """Unwraps a periodic coordinate along its rates, beginning on the branch of ``start``; shape (time,).

    Unlike plain unwrapping it stays right when samples are a turn or more apart.
    """
    predicted = np.diff(time) * (rate[1:] + rate[:-1]) / 2
    turns = np.concatenate([[0.0], np.cumsum(np.round((predicted - np.diff(u)) / period))])
    return np.asarray(u + period * (turns + np.round((start - u[0]) / period)))


def longest(vectors: FloatArray) -> float:
    """Length of the longest of some vectors, shape (…, 3), which is the same in all axes; 0 if there are none."""
    return float(np.max(np.linalg.norm(vectors, axis=-1), initial=0.0))


def uneven(count: int) -> FloatArray:
    """Sizes from 1 to 2 that differ by parts of the golden ratio, so that no few of them cancel each other."""
    return np.asarray(1.0 + np.modf(np.arange(1, count + 1) * (np.sqrt(5.0) - 1) / 2)[0])


_SWEEPS = 4  # of largest_distance; along a line two suffice
# Number of the vector to which each component of a sample belongs, ascending; None: every component is on its own.
Vectors = tuple[int, ...] | None


def magnitudes(values: FloatArray, vectors: Vectors = None) -> FloatArray:
    """Lengths of the vectors in the samples of a curve, which are the same in all axes; shape (samples, vectors).

    Args:
        values: of the curve, shape (samples, …).
        vectors: of its components.
    """
    flat = np.abs(values.reshape(len(values), math.prod(values.shape[1:])))
    if vectors is None or len(vectors) != flat.shape[1]:
        return flat
    begins = np.flatnonzero(np.diff(vectors, prepend=-1))
    return np.asarray(np.sqrt(np.add.reduceat(flat * flat, begins, axis=1)))


def largest_magnitude(values: FloatArray, vectors: Vectors = None) -> float:
    """Largest of the :func:`magnitudes` of a curve; 0 if it has none."""
    return float(np.max(magnitudes(values, vectors), initial=0.0))


def largest_distance(values: FloatArray, vectors: Vectors = None) -> float:
    """Largest distance between two samples of one vector of a curve, or at least half of it; the same in all axes.

    It goes from the first sample to the farthest, and from there on until none is farther.
    """
    flat = values.reshape(len(values), math.prod(values.shape[1:]))
    members = np.arange(flat.shape[1]) if vectors is None else np.unique(vectors, return_inverse=True)[1]
    if not flat.size or len(members) != flat.shape[1]:
        return 0.0
    begin, distance = np.zeros(int(members.max()) + 1, dtype=int), 0.0
    for _ in range(_SWEEPS):
        away = magnitudes(flat - flat[begin[members], np.arange(flat.shape[1])], vectors)
        farthest = float(np.nanmax(away, initial=0.0))
        if farthest <= distance:
            break
        begin, distance = np.argmax(np.nan_to_num(away), axis=0), farthest
    return distance


def largest_difference(curve: FloatArray, rival: FloatArray, vectors: Vectors = None) -> float:
    """Largest difference of two curves; infinite if their shapes differ or a difference is not finite.

    ``vectors``: of their components, whose lengths are taken.
    """
    if curve.shape != rival.shape:
        return float("inf")
    difference = largest_magnitude(curve - rival, vectors) if curve.size else 0.0
    return difference if np.isfinite(difference) else float("inf")


def known_difference(array: FloatArray, rival: FloatArray) -> float:
    """Largest difference of the known values of two arrays; infinite if one value is not finite and its partner is.

    Pairs of NaN are left out.
    """
    unknown = np.isnan(array) & np.isnan(rival)
    return largest_difference(np.where(unknown, 0.0, array), np.where(unknown, 0.0, rival))
