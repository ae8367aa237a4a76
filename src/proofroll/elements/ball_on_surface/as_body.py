"""A body that rolls on a wall as a ball in the form that its own formulations take, and their runs as runs of the body."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.errors import Diverged, Refused
from proofroll.elements.ball_on_surface.model import RollingBall
from proofroll.elements.ball_on_surface.sampling import BallBuilt, BallSample
from proofroll.elements.ball_on_surface.surfaces import Cylinder, Plane, Surface
from proofroll.elements.mechanism.run.contacts.on_wall import BodyOnWall
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.run.sampling import MechanismBuilt, MechanismSample
from proofroll.elements.mechanism.scene.shapes.walls.charts import OnBore, OnPlane

# Pull of the wall, relative to the largest force so far, that is round-off.
_FAINT = 1e-6


def ball_of(element: MechanismElement) -> RollingBall:
    """Ball of an element that is described in the local frame of a plane or of a cylinder.

    Raises:
        Refused: it has other bodies, or its wall is another one, turns, or has an axis out of the world's x-z plane.
    """
    on_wall = element.on_wall
    if on_wall is None or len(element.bodies) != 1 or on_wall.wall_rate is not None:
        raise Refused("represents one ball on a plane or in a cylinder at rest, and the scene holds other bodies or walls")
    wall = _wall(on_wall)
    surface = wall.offset(on_wall.ball.radius)
    return RollingBall(
        ball=on_wall.ball,
        contact=on_wall.contact,
        surface=surface,
        wall=wall,
        gravity=on_wall.gravity,
        u0=on_wall.u0,
        p0=surface.position(on_wall.u0),
        v0=on_wall.v0,
        w0=on_wall.w0,
    )


def _wall(on_wall: BodyOnWall) -> Surface:
    """The wall among those of balls."""
    place, name = on_wall.surface, on_wall.contact.surface
    x, y, z = place.axis.tolist()
    tilt = float(np.arctan2(x, z))
    if not y and isinstance(place.chart, OnPlane):
        return Plane(name, tilt=tilt, height=float(place.origin @ place.axis))
    if not y and isinstance(place.chart, OnBore) and not np.any(np.cross(place.origin, place.axis)):
        return Cylinder(name, radius=place.chart.round_radius + place.chart.radius, tilt=tilt)
    raise Refused("represents a plane, or a cylinder about a line through the world's origin, tilted about the y axis")


class RunAsBody:
    """Run of a ball as one of the body that stands for it; what it does not give is that run's."""

    def __init__(self, run: Any, element: MechanismElement) -> None:
        """Wraps ``run``, whose samples are of :class:`.BallSample`."""
        self._run, self._element = run, element
        assert element.on_wall is not None  # by `ball_of`
        self._on_wall = element.on_wall
        self._largest = 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._run, name)

    def sample(self) -> MechanismSample:
        """See :class:`proofroll.core.engine.Engine`.

        Raises:
            Diverged: the wall would have to pull.
        """
        sample: BallSample = self._run.sample()
        force = np.full(3, np.nan) if sample.force is None else np.asarray(sample.force)
        self._require_press(sample, force)
        return MechanismSample(
            p_WB=np.reshape(sample.p_WB, (1, 3)),
            v_WB=np.reshape(sample.v_WB, (1, 3)),
            w_WB=np.reshape(sample.w_WB, (1, 3)),
            q_WB=np.array([[1.0, 0, 0, 0]]) if sample.q_WB is None else np.reshape(sample.q_WB, (1, 4)),
            contact_force=self._on_wall.sign * force[None],
        )

    def _require_press(self, sample: BallSample, force: FloatArray) -> None:
        pull = float(self._on_wall.surface.normal(sample.p_WB) @ force)
        if pull > _FAINT * self._largest and self._largest:
            raise Diverged("the ball leaves the wall, which this formulation does not model")
        if np.all(np.isfinite(force)):
            self._largest = max(self._largest, float(np.linalg.norm(force)))

    def built(self) -> MechanismBuilt:
        """See :class:`proofroll.core.engine.Engine`."""
        built: BallBuilt = self._run.built()
        return MechanismBuilt(
            mass=_row(built.mass),
            com=np.zeros((1, 3)),
            inertia=None if built.inertia is None else np.diag(built.inertia)[None],
            gravity=built.gravity,
            acceleration=None if built.acceleration is None else np.reshape(built.acceleration, (1, 3)),
            angular_acceleration=(
                None if built.angular_acceleration is None else np.reshape(built.angular_acceleration, (1, 3))
            ),
            contact_gap=_row(built.gap),
            contact_friction=_row(built.mu_kinetic),
            contact_static=_row(built.mu_static),
            regularised={name: soft for name, soft in _renamed(built.regularised).items()},
        )


def _row(value: float | None) -> FloatArray | None:
    return None if value is None else np.array([value])


def _renamed(regularised: Mapping[str, Any]) -> Mapping[str, Any]:
    return {name.replace(" ", "_"): soft for name, soft in regularised.items()}
