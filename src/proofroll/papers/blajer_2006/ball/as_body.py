"""A body in an upright cylinder as a ball for the article's formulations, and their runs as runs of that body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray, cross, longest
from proofroll.core.element import Element
from proofroll.core.errors import Diverged, Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.shapes.walls.of_revolution import Bore
from proofroll.papers.blajer_2006.ball.cylinder import UprightCylinder
from proofroll.papers.blajer_2006.ball.model import RollingBall
from proofroll.papers.blajer_2006.ball.sampling import BallBuilt, BallSample

_SAME = 1e-12  # relative difference of directions that is round-off
__tracebackhide__ = True  # whatever goes wrong goes wrong in the run of the ball
# What a ball's certificate calls a quantity that a body's calls otherwise.
_NAMES: Mapping[str, tuple[str, ...]] = {
    "gap in the engine": ("gaps",),
    "gap": ("position", "places_of_contact"),
    "slip": ("velocity",),
    **dict.fromkeys(("N", "F2", "F3"), ("forces_of_contact",)),
    **dict.fromkeys(("1 / static friction", "1 / kinetic friction"), ("inverse_friction",)),
    "rolling resistance": ("rolling_resistance",),
    "angular acceleration": ("angular_acceleration",),
}


def in_upright_bore(body: BodyOnWall) -> bool:
    """True if it moves in a cylinder at rest about a line through the world's origin along gravity."""
    place, gravity = body.surface, body.gravity
    wall = getattr(getattr(place, "chart", None), "wall", None)
    if body.flies or body.wall_rate is not None or not isinstance(wall, Bore):
        return False
    off_axis, leaning = (longest(cross(vector, place.axis)) for vector in (place.origin, gravity))
    return off_axis <= _SAME * wall.radius and leaning <= _SAME * longest(gravity)


def ball_of(element: Element) -> RollingBall | None:
    """Ball in a cylinder at rest about a line through the world's origin along gravity; None: it is another element."""
    on_wall = element.on_wall if isinstance(element, MechanismElement) and len(element.bodies) == 1 else None
    if on_wall is None or not in_upright_bore(on_wall) or on_wall.surface.axis[1]:
        return None
    place = on_wall.surface
    x, _, z = place.axis.tolist()
    wall = UprightCylinder(on_wall.contact.surface, radius=place.chart.wall.radius, tilt=float(np.arctan2(x, z)))  # type: ignore[union-attr]  # of a bore
    surface, p0 = wall.offset(on_wall.ball.radius), place.position(on_wall.u0)
    return RollingBall(
        ball=on_wall.ball,
        contact=on_wall.contact,
        surface=surface,
        wall=wall,
        gravity=on_wall.gravity,
        u0=surface.locate(p0),
        p0=p0,
        v0=on_wall.v0,
        w0=on_wall.w0,
    )


def rolling_ball(scene: Scene) -> RollingBall:
    """Ball of a scene with one ball in an upright cylinder. Raises Refused if the scene has another element."""
    (element,) = scene.elements if len(scene.elements) == 1 else (None,)
    ball = None if element is None else ball_of(element)
    if ball is None:
        what = ", ".join(item.name for item in scene.elements)
        raise Refused(f"represents one ball in an upright cylinder, and the scene holds {what}")
    return ball


def on_body(run: Any, scene: Scene) -> RunOnBody:
    """Run of a ball as one of the scene's body."""
    (element,) = scene.elements
    assert isinstance(element, MechanismElement)  # by `rolling_ball`
    assert element.on_wall is not None
    return RunOnBody(run, element.on_wall)


class RunOnBody:
    """Run of a ball as one of the body that stands for it; what it does not give is that run's.

    Attributes:
        own: the run of the ball.
    """

    def __init__(self, run: Any, on_wall: BodyOnWall) -> None:
        """Wraps ``run``, whose samples are of :class:`.BallSample`."""
        self.own, self._on_wall = run, on_wall

    def __getattr__(self, name: str) -> Any:
        return getattr(self.own, name)

    def advance(self, t: float) -> None:
        """See :class:`proofroll.core.engine.Engine`."""
        self.own.advance(t)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`."""
        sample = self.own.sample()
        if not isinstance(sample, BallSample):
            return sample  # type: ignore[no-any-return]  # whoever asked refuses it
        force = np.full(3, np.nan) if sample.force is None else np.asarray(sample.force)
        if force.shape != (3,):
            raise Diverged(f"the engine gave force with shape {force.shape} instead of (3,)")
        return MechanismSample(
            sample.p_WB, sample.v_WB, sample.w_WB, sample.q_WB, contact_force=self._on_wall.sign * force[None]
        )

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        built = self.own.built()
        if not isinstance(built, BallBuilt):
            return built  # type: ignore[no-any-return]  # as of samples
        place = None
        p = np.asarray(getattr(self.own.sample(), "p_WB", None))
        if built.ball_radius is not None and p.shape == (3,):
            place = (p + built.ball_radius * self._on_wall.surface.normal(p))[None]
        softened: dict[str, Any] = {}
        for name, soft in built.regularised.items():
            for key in _NAMES.get(name, (name,)):
                softened[key] = max(softened.get(key, soft), soft, key=lambda item: item.tolerance)
        return MechanismBuilt(
            mass=_one(built.mass),
            inertia=None if built.inertia is None else np.diag(built.inertia)[None],
            gravity=built.gravity,
            acceleration=_one(built.acceleration),
            angular_acceleration=_one(built.angular_acceleration),
            contact_gap=_one(built.gap),
            contact_place=place,
            contact_friction=_one(built.mu_kinetic),
            contact_rolling=_one(built.rolling_resistance),
            terms=built.terms,
            regularised=softened,
        )


def _one(value: float | FloatArray | None) -> FloatArray | None:
    return None if value is None else np.array([value])
