"""The tables from which a scene of one ball in an upright cylinder is made, and scenes of changed tables."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from proofroll.core.gravity import Gravity
from proofroll.core.scene import Scene
from proofroll.elements.balls.reader import PlacedBall
from proofroll.elements.mechanism.run.element import the_mechanism
from proofroll.elements.mechanism.scene.balls import InitialMotion
from proofroll.papers.blajer_2006.ball.as_body import rolling_ball
from proofroll.papers.blajer_2006.ball.kind import ball_element


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
    element = ball_element(placed(scene)._replace(**parts), gravity or gravity_of(scene), "scene")
    return dataclasses.replace(scene, elements=(element,))
