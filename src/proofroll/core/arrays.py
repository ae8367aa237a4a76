"""Types of arrays, read-only arrays, and the largest difference of two arrays."""

import dataclasses
import itertools
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


def largest_difference(curve: FloatArray, rival: FloatArray) -> float:
    """Largest difference of two curves; infinite if their shapes differ or a difference is not finite."""
    if curve.shape != rival.shape:
        return float("inf")
    difference = float(np.max(np.abs(curve - rival), initial=0.0))
    return difference if np.isfinite(difference) else float("inf")


def known_difference(array: FloatArray, rival: FloatArray) -> float:
    """Largest difference of the known values of two arrays; infinite if one value is not finite and its partner is.

    Pairs of NaN are left out.
    """
    unknown = np.isnan(array) & np.isnan(rival)
    return largest_difference(np.where(unknown, 0.0, array), np.where(unknown, 0.0, rival))
