"""Balls that roll on surfaces in maximal coordinates: a further witness of scenes with balls, and of those that mix.

Tests hold it against a ball's two routes, with which it shares neither coordinates nor equations; it makes no truth.

A ball is a free body. Its contact point stands still, v + ω × a e1 = 0, in three rows; of these only the distance along
the normal e1 can be violated by a place, the other two hold velocities alone (Blajer 2006, section 2). Of the surface
only its distance is used, and its derivatives; neither coordinates nor frames of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.ball_on_surface.element import BallOnSurface
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.surfaces import Cylinder, Declared, Plane, Surface
from proofroll.elements.ball_on_surface.surfaces.formula import Jet, sqrt, variables
from proofroll.elements.mechanism.checks import WORLD, Vector
from proofroll.elements.mechanism.element import MechanismElement
from proofroll.elements.mechanism.joint import Joint
from proofroll.elements.mechanism.model import Mechanism
from proofroll.elements.mechanism.parts import Body
from proofroll.truth.scalars import Scalar, dot


@dataclass(frozen=True)
class RollingContact:
    """A ball that rolls without slip on a wall that stands.

    Attributes:
        body: its name.
        radius: a [m].
        path: the surface on which its centre moves.
        start: a place of its centre [m], which tells on which side of a plane or cylinder it is.
    """

    body: str
    radius: float
    path: Surface
    start: Vector

    def normal(self, r: Sequence[Scalar], v: Sequence[Scalar]) -> tuple[Scalar, list[Scalar], list[Scalar]]:
        """Gap [m], normal e1 towards the wall and its rate [1/s] of a centre at r with velocity v, of any scalars."""
        gap: Jet = self._distance(*variables(*r))
        xx, xy, xz, yy, yz, zz = gap.second
        bent = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        return gap.value, [-1.0 * x for x in gap.first], [-1.0 * dot(row, v) for row in bent]

    def _distance(self, *r: Any) -> Any:
        if isinstance(self.path, Declared):
            return self.path.distance(*r)
        if isinstance(self.path, Plane):
            normal = self.path.normal(np.array(self.start))
            return float(self.path.gap(np.zeros(3))) - sum(x * float(n) for x, n in zip(r, normal, strict=True))
        assert isinstance(self.path, Cylinder)
        axis = [float(k) for k in self.path.generators[1].axis]
        along = sum(x * k for x, k in zip(r, axis, strict=True))
        return self.path.radius - sqrt(sum((x - k * along) ** 2 for x, k in zip(r, axis, strict=True)))


def rolling_scene(scene: Scene) -> tuple[Mechanism, tuple[RollingContact, ...]]:
    """All elements of a scene as one mechanism, its balls as free bodies, and what these roll on.

    Raises:
        Refused: an element, or a law of contact, that such rows do not have; the text names it.
    """
    bodies: list[Body] = []
    joints: list[Joint] = []
    others: dict[str, list[Any]] = {
        name: [] for name in ("loops", "springs", "points", "unmodelled", "actuators", "couplings")
    }
    contacts = []
    gravity = None
    for element in scene.elements:
        if isinstance(element, MechanismElement):
            bodies += element.mechanism.bodies
            joints += element.mechanism.joints
            for name in others:
                others[name] += getattr(element.mechanism, name)
            gravity = element.mechanism.gravity
        elif isinstance(element, BallOnSurface):
            contacts.append(_contact(element.rolling))
            body, joint = _free(element.rolling)
            bodies.append(body)
            joints.append(joint)
            gravity = _vector(element.rolling.gravity)
        else:
            raise Refused(f"{element.name} ({type(element).__name__}) has no rows in maximal coordinates")
    assert gravity is not None  # a scene has an element
    return Mechanism(tuple(bodies), tuple(joints), gravity=gravity, **{k: tuple(v) for k, v in others.items()}), (
        *contacts,
    )


def _contact(ball: RollingBall) -> RollingContact:
    name, law = ball.ball.name, ball.contact
    if not math.isinf(law.mu_static):
        raise Refused(f"mu_static = {law.mu_static:g} bounds the friction of {name}; rows that always hold do not slip")
    if law.rolling_resistance:
        raise Refused(f"rolling resistance of {name} is a moment that its normal force makes; no row gives it")
    if ball.flies:
        raise Refused(f"{name} may leave its wall; rows that always hold do not let it")
    if ball.wall_rate is not None:
        raise Refused(f"the wall of {name} moves; rows here are those of walls that stand")
    return RollingContact(name, float(ball.ball.radius), ball.surface, _vector(ball.p0))


def _free(ball: RollingBall) -> tuple[Body, Joint]:
    """The ball as a body whose axes are the world's at the start."""
    name, inertia = ball.ball.name, float(ball.ball.inertia)
    start = (*_vector(ball.p0), 1.0, 0.0, 0.0, 0.0)
    body = Body(name, ball.ball.mass, inertia=(inertia, inertia, inertia))  # type: ignore[arg-type]  # three moments
    return body, Joint(f"{name} is free", "free", WORLD, name, q0=start, v0=(*_vector(ball.v0), *_vector(ball.w0)))


def _vector(values: Any) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z
