"""Frames, attitudes and forces of a ball's run, from what it has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall

if TYPE_CHECKING:
    import xarray as xr

SURFACE, BODY = "the surface's axes e1, e2, e3", "body axes"
_SUBSTEPS = 32


def frames(body: RollingBall, truth: xr.Dataset) -> dict[str, FloatArray]:
    """The frames in which a vector may be given by mistake, at each time of the true run."""
    local = body.surface.frame(body.surface.locate(truth["p_WB"].to_numpy()))
    return {SURFACE: local, BODY: attitudes(truth["time"].to_numpy(), truth["w_WB"].to_numpy())}


def attitudes(time: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Rotations of the body from its true angular velocity; the identity at time 0, shape (time, 3, 3)."""
    if len(time) < 2:
        return np.eye(3)[None]
    spin, h = make_interp_spline(time, w_WB, k=min(7, len(time) - 1)), np.diff(time) / _SUBSTEPS
    turned, found = Rotation.identity(len(h)), [np.eye(3)]
    for step in range(_SUBSTEPS):
        one, two = (spin(time[:-1] + (step + 0.5 + side / np.sqrt(12)) * h) for side in (-1, 1))
        bent = h[:, None] * (one + two) / 2 - np.sqrt(3) / 12 * h[:, None] ** 2 * np.cross(one, two)
        turned = Rotation.from_rotvec(bent) * turned
    for rotation in turned.as_matrix():
        found.append(rotation @ found[-1])
    return np.array(found)


def forces(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """The wall's force on the ball in the world, NaN where it is not said, shape (time, 3)."""
    frame = body.surface.frame(body.surface.locate(dataset["p_WB"].to_numpy()))
    local = np.stack([-dataset["N"].to_numpy(), dataset["F2"].to_numpy(), dataset["F3"].to_numpy()], axis=-1)
    return np.asarray(np.einsum("tij,tj->ti", frame, local))
