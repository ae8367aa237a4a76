"""The tables from which a scene of one ball in an upright cylinder is made, and scenes of changed tables."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import xarray as xr

from proofroll.core.arrays import FloatArray
from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.as_body import rolling_ball
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.run.balls import PlacedBall, ball_as_body
from proofroll.elements.mechanism.run.dataset import columns, unturned
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.elements.mechanism.run.sampling import MechanismSample
from proofroll.elements.mechanism.scene.balls import InitialMotion


def placed(scene: Scene) -> PlacedBall:
    """Ball, wall, contact and start of a scene."""
    body = rolling_ball(scene)
    (wall,) = (item for item in the_mechanism(scene).mechanism.geometries if item.kind == "bore")
    frame = body.surface.frame(body.u0)
    start = InitialMotion(
        body.ball.name,
        coordinates=tuple(body.u0.tolist()),
        velocity=tuple((frame[:, 1:].T @ body.v0).tolist()),
        spin=float(frame[:, 0] @ body.w0),
    )
    contact = dataclasses.replace(body.contact, surface=wall.name, restitution=None)
    return PlacedBall(body.ball, dataclasses.replace(body.wall, name=wall.name), contact, start)


def gravity_of(scene: Scene) -> Gravity:
    """Gravity of a scene."""
    vector = the_mechanism(scene).mechanism.gravity
    size = float(np.linalg.norm(vector))
    return Gravity(size, vector) if size else Gravity(0.0)


def scene_with(scene: Scene, gravity: Gravity | None = None, **parts: Any) -> Scene:
    """Copy of a scene with another ``ball``, ``surface``, ``contact``, ``start`` or ``gravity``."""
    element = ball_as_body(placed(scene)._replace(**parts), gravity or gravity_of(scene), "scene")
    return dataclasses.replace(scene, elements=(element,))


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


def of_ball(run: xr.Dataset) -> xr.Dataset:
    """A run of one body without the axis of bodies."""
    return run.isel(body=0)


def compared(true: xr.Dataset, run: xr.Dataset) -> list[str]:
    """Variables of numbers that both have, but for times of events."""
    names = (str(name) for name in true.data_vars if name in run and not str(name).startswith("event"))
    return [name for name in names if np.issubdtype(true[name].dtype, np.floating)]
