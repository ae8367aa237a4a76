"""What can happen to attitudes, and to all numbers of a run, on their way into samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.diagnosis import Cause, above_round_off, apart

if TYPE_CHECKING:
    import xarray as xr

_START = 1e-6


def rounded(run: xr.Dataset, truth: xr.Dataset, names: tuple[str, ...]) -> Iterator[Cause]:
    """The cause that all numbers of a run are float32: of random doubles one in 5e8 is."""
    for name in names:
        said = run[name].to_numpy()
        if not np.any(said % 1) or not np.array_equal(said, said.astype(np.float32)):
            return
    name = names[0]
    before = apart(run[name].to_numpy(), truth[name].to_numpy()) if run[name].shape == truth[name].shape else np.inf
    says = "every number of the run is a single-precision one (float32)"
    yield Cause("float32", says, name, "m", before, 0.0, "compute and report in double precision")


def quaternions(said: FloatArray, true: FloatArray) -> Iterator[Cause]:
    """Causes by which quaternions, scalar first, differ from the true ones, shape (…, 4)."""
    if said.shape != true.shape:
        return
    if len(said) > 1 and apart(np.abs(said[0]), np.abs(true[0])) < _START:
        said, true = said[1:], true[1:]  # an engine may give at time 0 what it was given

    def from_true(values: Any) -> float:
        signs = np.where(np.sum(said * values, axis=-1, keepdims=True) < 0, -1.0, 1.0)
        return apart(said * signs, values)

    lengths, before = np.linalg.norm(said, axis=-1, keepdims=True), from_true(true)
    if not above_round_off(before, 1.0) or not np.all(lengths > 0):
        return
    unit = said / lengths
    signs = np.where(np.sum(unit * true, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    for says, after in (
        ("q_WB has its scalar last", from_true(true[..., [1, 2, 3, 0]])),
        ("q_WB is that of the inverse rotation, of the world in the body", from_true(true * [1, -1, -1, -1])),
        ("q_WB is not of unit length: it was not normalised", apart(unit * signs, true)),
    ):
        yield Cause("quaternion", says, "q_WB", "1", before, after, "give a unit quaternion of the body, scalar first")
