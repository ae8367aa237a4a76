"""Scenes with rolling balls, as one mechanism and rolling contacts."""

from __future__ import annotations

from typing import Any

from rolling_rows import RollingContact

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism import WORLD, Body, Joint, Mechanism
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.checks import Vector
from proofroll.papers.blajer_2006.ball.as_body import ball_of
from proofroll.papers.blajer_2006.ball.model import RollingBall


def rolling_scene(scene: Scene) -> tuple[Mechanism, tuple[RollingContact, ...]]:
    """All elements of a scene as one mechanism, whose balls are free bodies, and the rolling contacts of these.

    Raises:
        Refused: an element or a law of contact has no such rows; the text names it.
    """
    bodies: list[Body] = []
    joints: list[Joint] = []
    others: dict[str, list[Any]] = {
        name: [] for name in ("loops", "springs", "points", "unmodelled", "actuators", "couplings")
    }
    contacts = []
    gravity = None
    for element in scene.elements:
        ball = ball_of(element)
        if ball is not None:
            contacts.append(_contact(ball))
            body, joint = _free(ball)
            bodies.append(body)
            joints.append(joint)
            gravity = _vector(ball.gravity)
        elif isinstance(element, MechanismElement):
            bodies += element.mechanism.bodies
            joints += element.mechanism.joints
            for name in others:
                others[name] += getattr(element.mechanism, name)
            gravity = element.mechanism.gravity
        else:
            raise Refused(f"{element.name} ({type(element).__name__}) has no rows in maximal coordinates")
    assert gravity is not None  # a scene has an element
    return Mechanism(tuple(bodies), tuple(joints), gravity=gravity, **{k: tuple(v) for k, v in others.items()}), (
        *contacts,
    )


def _contact(ball: RollingBall) -> RollingContact:
    name, law = ball.ball.name, ball.contact
    if law.rolling_resistance:
        raise Refused(f"rolling resistance of {name} is a moment that its normal force makes; no row gives it")
    return RollingContact(name, float(ball.ball.radius), ball.surface)


def _free(ball: RollingBall) -> tuple[Body, Joint]:
    """A ball as a free body, whose axes are the world's at the start."""
    name, inertia = ball.ball.name, float(ball.ball.inertia)
    start = (*_vector(ball.p0), 1.0, 0.0, 0.0, 0.0)
    body = Body(name, ball.ball.mass, inertia=(inertia, inertia, inertia))  # type: ignore[arg-type]  # three moments
    return body, Joint(f"{name} is free", "free", WORLD, name, q0=start, v0=(*_vector(ball.v0), *_vector(ball.w0)))


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
