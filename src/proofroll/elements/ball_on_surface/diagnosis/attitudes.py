"""Frames, attitudes and forces of a ball's run, from what it has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.core.arrays import FloatArray
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.stretches import carried

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
    found = [np.eye(3)]
    for rotation in carried(Rotation.identity(len(time) - 1), time, w_WB, _SUBSTEPS).as_matrix():
        found.append(rotation @ found[-1])
    return np.array(found)


def forces(body: RollingBall, dataset: xr.Dataset) -> FloatArray:
    """The wall's force on the ball in the world, NaN where it is not said, shape (time, 3)."""
    frame = body.surface.frame(body.surface.locate(dataset["p_WB"].to_numpy()))
    local = np.stack([-dataset["N"].to_numpy(), dataset["F2"].to_numpy(), dataset["F3"].to_numpy()], axis=-1)
    return np.asarray(np.einsum("tij,tj->ti", frame, local))
