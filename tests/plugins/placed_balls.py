"""Runs and samples of a ball in an upright cylinder, made from arrays."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import xarray as xr

from proofroll.core.arrays import FloatArray
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.dataset import columns, unturned
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.files.scene_file import load_scene
from proofroll_drill.placed_balls import gravity_of, placed, scene_with

__all__ = ["compared", "gravity_of", "leaning_cylinder", "of_ball", "placed", "run_of", "sample_of", "scene_with"]


def run_of(
    scene: Scene,
    times: FloatArray,
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    *,
    force: FloatArray | None = None,
    q_WB: FloatArray | None = None,
) -> xr.Dataset:
    """A run of a scene's ball that moves so; arrays over time, with or without an axis of bodies.

    ``force``: of the wall on the ball [N]; None: not known.
    """
    element = the_mechanism(scene)
    assert element.on_wall is not None
    count = len(times)
    forces = np.full((count, 3), np.nan) if force is None else np.asarray(force)
    p, v, w, turned = (
        np.reshape(values, (count, 1, -1))
        for values in (p_WB, v_WB, w_WB, np.tile([1.0, 0, 0, 0], (count, 1)) if q_WB is None else q_WB)
    )
    wrench = np.zeros((count, 2, len(element.mechanism.connections), 3))
    made = columns(
        element,
        Placed(element.mechanism, times, p, v, w, turned),
        wrench,
        element.on_wall.sign * forces[:, None],
        np.zeros((count, 0)),
    )
    return (unturned(made) if q_WB is None else made).dataset()


def sample_of(
    p_WB: FloatArray,
    v_WB: FloatArray,
    w_WB: FloatArray,
    q_WB: FloatArray | None = None,
    force: FloatArray | None = None,
) -> MechanismSample:
    """A sample of a ball that is the first body of its contact, with the wall's force on it [N]."""
    p, v, w = (np.reshape(values, (1, 3)) for values in (p_WB, v_WB, w_WB))
    pressed = np.full((1, 3), np.nan) if force is None else np.reshape(force, (1, 3))
    return MechanismSample(p, v, w, None if q_WB is None else np.reshape(q_WB, (1, 4)), contact_force=pressed)


def leaning_cylinder(tilt: float, **parameters: float) -> Scene:
    """The cylinder with its axis, and gravity along it, leaning by ``tilt`` [rad]."""
    scene = load_scene("sphere_in_cylinder", **parameters)
    gravity = Gravity(9.81, (-math.sin(tilt), 0.0, -math.cos(tilt)))
    return scene_with(scene, surface=dataclasses.replace(placed(scene).surface, tilt=tilt), gravity=gravity)


def of_ball(run: xr.Dataset) -> xr.Dataset:
    """A run of one body without the axis of bodies."""
    return run.isel(body=0)


def compared(true: xr.Dataset, run: xr.Dataset) -> list[str]:
    """Variables of numbers that both have, but for times of events."""
    names = (str(name) for name in true.data_vars if name in run and not str(name).startswith("event"))
    return [name for name in names if np.issubdtype(true[name].dtype, np.floating)]
