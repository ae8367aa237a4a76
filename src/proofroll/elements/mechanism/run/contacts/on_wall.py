"""A ball on a wall, as its variables and observables see it, and vector formulas of both.

The contact point is at ``p_WB + a e1``; array arguments may carry leading dimensions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, cross
from proofroll.elements.mechanism.dynamics.held_signals import placed_start
from proofroll.elements.mechanism.scene.balls import Ball, Contact
from proofroll.elements.mechanism.scene.checks import WORLD, ZERO
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, SphereShape
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall, Declared
from proofroll.elements.mechanism.scene.shapes.walls.charts import WallCoordinates, wall_coordinates

if TYPE_CHECKING:
    import xarray as xr

    from proofroll.elements.mechanism.scene.model import Mechanism
    from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact

_SAME = 1e-12  # relative difference of moments of inertia, and of directions, that is round-off


class LocalCoordinates(Protocol):
    """Coordinates of the centre of a ball on its wall, and the local frame: e1 towards the wall, e2, e3."""

    @property
    def coordinates(self) -> tuple[str, str]:
        """Their names."""

    @property
    def units(self) -> tuple[str, str]:
        """Their units."""

    @property
    def periods(self) -> tuple[float | None, float | None]:
        """Their periods, or None."""

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """Centre in the world [m]."""

    def tangents(self, u: npt.ArrayLike) -> FloatArray:
        """Its derivatives."""

    def second(self, u: npt.ArrayLike) -> FloatArray:
        """Its second derivatives."""

    def frame(self, u: npt.ArrayLike) -> FloatArray:
        """Columns e1, e2, e3."""

    def locate(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Coordinates of the nearest centre that touches."""

    def gap(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Distance of the ball from the wall [m]."""

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """e1."""


@dataclass(frozen=True)
class LocalStart:
    """A ball whose motion is described in the local frame of its wall.

    Attributes:
        ball: name of its body.
        coordinates: of its centre at the start, an angle with its whole turns.
        flies: True if it starts off the wall or may leave it and land.
    """

    ball: str
    coordinates: tuple[float, float]
    flies: bool = False


@dataclass(frozen=True, eq=False)
class BodyOnWall:
    """The ball of a mechanism: data, coordinates and start; its wall may turn about an axis through ``surface.origin``.

    Attributes:
        index: of its body.
        contact_index: of its contact.
        sign: 1 if the force of that contact is one on the ball, else -1.
    """

    ball: Ball
    contact: Contact
    surface: WallCoordinates | Declared
    gravity: FloatArray
    u0: FloatArray
    v0: FloatArray
    w0: FloatArray
    flies: bool
    wall_rate: FloatArray | None
    index: int
    contact_index: int
    sign: float

    def own(self, dataset: xr.Dataset, name: str) -> FloatArray:
        """A variable of all bodies, for the ball alone, shape (time, ...)."""
        return np.asarray(dataset[name].to_numpy()[:, self.index])

    def resisting(
        self, N: FloatArray, e1: FloatArray, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray
    ) -> FloatArray:
        """Moment of the rolling resistance, of a ball that slips, too [N m]; both motions are relative to the wall."""
        rate = np.zeros(3) if self.wall_rate is None else self.wall_rate
        # Turned by a right angle, turning is the velocity with which a ball that rolls moves relative to its wall.
        moving = cross(e1, w_WB - rate) if self.contact.against == "turning" else v_WB - cross(rate, p_WB)
        return resistance_moment(self.contact.rolling_resistance, N, e1, moving)


def body_on_wall(mechanism: Mechanism, local: LocalStart) -> BodyOnWall | None:
    """A body as a ball on its wall.

    None: it is no homogeneous free ball, or it does not touch one wall that stands or turns evenly along itself.
    """
    body = local.ball
    ball = _as_ball(mechanism, body)
    touching = [contact for contact in mechanism.contacts if body in {contact.body_a, contact.body_b}]
    if ball is None or len(touching) != 1:
        return None
    (contact,) = touching
    is_a = contact.body_a == body
    sphere, wall = (contact.shape_a, contact.shape_b) if is_a else (contact.shape_b, contact.shape_a)
    carrier = contact.body_b if is_a else contact.body_a
    if not (isinstance(sphere, SphereShape) and isinstance(wall, HalfSpace | CurvedWall)) or np.any(sphere.centre):
        return None
    start = placed_start(mechanism)
    index, wall_body = mechanism.body_index[body], mechanism.body_index[carrier]
    moved_to = np.zeros(3) if wall_body < 0 else start.p_WB[0, wall_body]
    surface = wall_coordinates(wall, sphere.radius, start.R_WB[0, wall_body], moved_to)
    rate = _turning(mechanism, carrier, surface)
    if rate is None:
        return None
    return BodyOnWall(
        ball=Ball(body, sphere.radius, ball[0], ball[1] / (ball[0] * sphere.radius**2)),
        contact=_law(contact, body, carrier),
        surface=surface,
        gravity=np.array(mechanism.gravity),
        u0=np.array(local.coordinates),
        v0=start.v_WB[0, index],
        w0=start.w_WB[0, index],
        flies=local.flies,
        wall_rate=rate if np.any(rate) else None,
        index=index,
        contact_index=mechanism.contacts.index(contact),
        sign=1.0 if is_a else -1.0,
    )


def _as_ball(mechanism: Mechanism, name: str) -> tuple[float, float] | None:
    """Mass and moment of inertia of a free body like a ball about the origin of its frame; None: it is another."""
    body = next(body for body in mechanism.bodies if body.name == name)
    joint = next(joint for joint in mechanism.joints if joint.child == name)
    inertia = np.array(body.inertia)
    moment = float(inertia[0, 0])
    round_ball = np.abs(inertia - moment * np.eye(3)).max() <= _SAME * moment
    free = joint.kind == JointKind.FREE and joint.parent == WORLD and joint.child_position == ZERO
    return (body.mass, moment) if round_ball and free and body.com == ZERO and body.mass and moment else None


def _law(contact: BodyContact, ball: str, wall: str) -> Contact:
    """Law of a contact as a ball's."""
    return Contact(
        body=ball,
        surface=wall,
        rolling_resistance=contact.rolling_resistance,
        against=contact.against,
        mu_static=contact.static,
        mu_kinetic=contact.friction,
        restitution=contact.restitution,
        tangential_restitution=contact.tangential_restitution,
    )


def _turning(mechanism: Mechanism, carrier: str, surface: WallCoordinates | Declared) -> FloatArray | None:
    """Rate at which a wall turns along itself [rad/s], shape (3,); None: it moves in another way."""
    if carrier == WORLD:
        return np.zeros(3)
    joint = next(joint for joint in mechanism.joints if joint.child == carrier)
    if joint.motion is None or joint.kind != JointKind.REVOLUTE or joint.parent != WORLD:
        return None
    axis = joint.parent_frame[:, 2]
    start, later = (moved(joint.motion, time) for time in (0.0, 1.0))
    even = start.rate == later.rate and start.acceleration == later.acceleration == 0.0
    about_itself = np.abs(cross(axis, surface.axis)).max() <= _SAME
    through_origin = not np.any(np.array(joint.position)) and not np.any(cross(axis, surface.origin))
    return np.asarray(float(start.rate) * axis) if even and about_itself and through_origin else None


def slip_velocity(radius: float, e1: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Velocity of the ball's contact point in the world [m/s], shape (..., 3): v + ω × a e1."""
    return np.asarray(v_WB + radius * cross(w_WB, e1))


def wall_velocity(body: BodyOnWall, p_WB: FloatArray, e1: FloatArray) -> FloatArray:
    """Velocity of the wall where the ball touches it [m/s], shape (..., 3): W × (p + a e1)."""
    if body.wall_rate is None:
        return np.zeros_like(p_WB)
    return np.asarray(cross(body.wall_rate, p_WB + body.ball.radius * e1))


def resistance_moment(f: float, N: npt.ArrayLike, e1: FloatArray, v_WB: FloatArray) -> FloatArray:
    """Moment of the rolling resistance about the centre [N m], shape (..., 3).

    The normal force -N e1 is shifted by ``f`` [m] along the direction of the centre's velocity (Blajer 2006,
    section 2.4), which gives f (v/V) × (-N e1). At V = 0 the direction does not exist and the moment is zero.
    """
    speed = np.linalg.norm(v_WB, axis=-1, keepdims=True)
    direction = np.divide(v_WB, speed, out=np.zeros_like(v_WB), where=speed > 0)
    return np.asarray(-f * np.asarray(N)[..., None] * cross(direction, e1))


def energy(body: BodyOnWall, p_WB: FloatArray, v_WB: FloatArray, w_WB: FloatArray) -> FloatArray:
    """Kinetic plus potential energy [J], shape (...); the potential is zero at the world's origin."""
    m, J = body.ball.mass, body.ball.inertia
    kinetic = 0.5 * m * np.sum(v_WB**2, axis=-1) + 0.5 * J * np.sum(w_WB**2, axis=-1)
    return np.asarray(kinetic - m * p_WB @ body.gravity)


def exceeds_grip(lines: Sequence[Mapping[str, Any]], friction: FloatArray) -> str | None:
    """Reason why an engine whose friction is bounded moves another ball than one that never slips; None: it does not.

    Args:
        lines: of a stored certificate (:meth:`proofroll.core.certificate.Line.as_dict`).
        friction: friction over normal force of the true motion [1], shape (time,); NaN without contact.
    """
    needed = float(np.max(friction[np.isfinite(friction)], initial=0.0))
    for line in lines:
        largest = max(line["found"], default=0.0) if line["quantity"] == "inverse friction" else 0.0
        if largest * needed > 1:
            return (
                f"another scene: a friction of {1 / largest:.4g}, where the scene has no bound and needs {needed:.4g}"
            )
    return None
