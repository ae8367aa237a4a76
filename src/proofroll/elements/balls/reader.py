"""Reads balls on walls, ``[[balls]] [[surfaces]] [[contacts]] [[initial]]``, as bodies with spheres that touch walls.

Each ball is a mechanism of its own: a free body, a sphere, a wall in the world or on a body that turns, and their pair.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, Union

import numpy as np
from pydantic import Field

from proofroll.core.errors import InputError, require_known
from proofroll.core.gravity import Gravity
from proofroll.core.parameters import Parameters
from proofroll.core.validation import strict, units_of, validated
from proofroll.elements.balls.surfaces import Cylinder, surface_kinds
from proofroll.elements.mechanism import WORLD, Body, Joint, Mechanism
from proofroll.elements.mechanism.reading.reader import started
from proofroll.elements.mechanism.run.contacts.on_wall import LocalStart
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.balls import Ball, Contact, InitialMotion
from proofroll.elements.mechanism.scene.checks import Vector
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import Array, cross
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair, declared_wall
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace
from proofroll.elements.mechanism.scene.shapes.walls import CurvedWall, Declared
from proofroll.elements.mechanism.scene.shapes.walls.charts import WallCoordinates, wall_coordinates
from proofroll.elements.mechanism.scene.signal import Formula

if TYPE_CHECKING:
    AnySurface = Any
else:
    AnySurface = Union[surface_kinds()]  # noqa: UP007 -- of a tuple
# Slip at the start, relative to the speed of the ball, that counts as round-off of rolling.
_ROUND_OFF = 1e-12


@dataclass(frozen=True)
class _Tables:
    """Tables of a scene file that describe balls on surfaces."""

    balls: tuple[Ball, ...]
    contacts: tuple[Contact, ...]
    initial: tuple[InitialMotion, ...]
    surfaces: tuple[Annotated[AnySurface, Field(discriminator="kind")], ...] = field(default=())


strict(_Tables, Ball, Contact, InitialMotion, *surface_kinds())
UNITS: Mapping[str, str] = units_of(Ball, Contact, InitialMotion, *surface_kinds())


class PlacedBall(NamedTuple):
    """A ball with the wall that it touches, the law of their contact and its number, and its start."""

    ball: Ball
    surface: Any
    contact: Contact
    start: InitialMotion
    number: int = 0


def placed_balls(tables: Mapping[str, Any], numbers: Parameters, file: str) -> Iterator[PlacedBall]:
    """Each contact of a file with the ball, the surface and the start that it names.

    Args:
        tables: of balls, surfaces, contacts and starts as the file writes them.
        numbers: the parameters.
        file: its name, for messages.

    Raises:
        InputError: a value is wrong, a name is missing or used twice, a coordinate has another unit than its surface,
            or a ball is larger than its cylinder.
    """
    filled = {key: numbers.filled(table, f"{file}: {key}", UNITS) for key, table in tables.items()}
    contents = validated(_Tables, filled, file)
    _check_names(contents, file)
    for surface in contents.surfaces:
        if isinstance(surface, Declared):
            surface.checked()
    balls, walls = {ball.name: ball for ball in contents.balls}, {wall.name: wall for wall in contents.surfaces}
    starts = {start.body: (index, start) for index, start in enumerate(contents.initial)}
    for index, contact in enumerate(contents.contacts):
        if contact.body not in starts:
            raise InputError(f"{file}: initial", contact.body, "say how this ball starts; add an [[initial]] of it")
        if any(contact.body == earlier.body for earlier in contents.contacts[:index]):
            raise InputError(f"{file}: contacts.{index}.body", contact.body, "a ball touches one surface")
        ball, surface, (number, start) = balls[contact.body], walls[contact.surface], starts[contact.body]
        # Only with the surface are the units of its coordinates known.
        place = f"{file}: initial.{number}.coordinates"
        numbers.filled(tables["initial"][number].get("coordinates", []), place, {}, surface.units)
        if isinstance(surface, Cylinder):
            try:
                surface.offset(ball.radius)
            except InputError as error:
                raise error.within(f"{file}: contacts.{index}", contact.body) from None
        yield PlacedBall(ball=ball, surface=surface, contact=contact, start=start, number=index)
    for name in balls.keys() - {contact.body for contact in contents.contacts}:
        raise InputError(f"{file}: contacts", name, "this ball touches no surface; add a contact or remove the ball")


def _check_names(contents: _Tables, file: str) -> None:
    """Raises InputError unless contacts and starts name balls and surfaces of the file, and all names are unique."""
    balls, walls = [ball.name for ball in contents.balls], [surface.name for surface in contents.surfaces]
    for kind, names in (("balls", balls), ("surfaces", walls)):
        for index, name in enumerate(names):
            if name in names[:index]:
                raise InputError(f"{file}: {kind}.{index}.name", name, "two have this name; rename one")
    for kind, items in (("contacts", contents.contacts), ("initial", contents.initial)):
        for index, item in enumerate(items):
            for key, known_names in (("body", balls), ("surface", walls)):
                named = getattr(item, key, None)
                if named is not None:
                    require_known(f"{file}: {kind}.{index}.{key}", named, known_names)


def ball_as_body(placed: PlacedBall, gravity: Gravity, file: str) -> MechanismElement:
    """Mechanism of a ball on its wall.

    A restitution that is left out is 0: the ball stays where it lands.

    Raises:
        InputError: no body has such a wall or law of contact, or the ball cannot start so.
    """
    ball, contact = placed.ball, placed.contact
    x, y, z = gravity.vector.tolist()
    try:
        wall, turning = _wall(placed)
        if not contact.mu_kinetic < contact.mu_static or contact.mu_kinetic:
            pair = _pair(placed, wall)
        else:
            advice = "what holds by friction slides with some: give a number above 0, or mu_static = 0"
            raise InputError("mu_kinetic", contact.mu_kinetic, advice).of(f"{file}: contacts.{placed.number}")
        free = _free_joint(placed, wall, turning)
        moving = _turning_wall(ball, wall, turning, free)
        mechanism = Mechanism(
            bodies=(Body(ball.name, ball.mass, inertia=_isotropic(ball.inertia)), *(body for body, _ in moving)),
            joints=(free, *(joint for _, joint in moving)),
            geometries=(Geometry(ball.name, ball.name, "sphere", radius=ball.radius), wall),
            pairs=(pair,),
            gravity=(x, y, z),
        )
        flies = bool(placed.start.gap) or contact.restitution is not None
        local = LocalStart(ball.name, placed.start.coordinates, flies)
        return MechanismElement(started(mechanism), local=local)
    except InputError as error:
        if error.field.startswith(file):
            raise
        table = f"contacts.{placed.number}" if error.field.startswith("pairs.") else "initial"
        raise error.within(f"{file}: {table}", ball.name) from None


def _wall(placed: PlacedBall) -> tuple[Geometry, float]:
    """Shape of a surface, and the rate at which it turns about its axis [rad/s]."""
    surface = placed.surface
    name = f"{surface.name}_wall" if surface.name == placed.ball.name else surface.name  # of a body and a shape
    if isinstance(surface, Declared):
        return declared_wall(name, surface), 0.0
    turning, tilt = float(getattr(surface, "turning", 0.0)), float(getattr(surface, "tilt", 0.0))
    body, axis = name if turning else WORLD, (math.sin(tilt), 0.0, math.cos(tilt))
    match surface.kind:
        case "plane":
            x, y, z = (surface.height * part for part in axis)
            return Geometry(name, body, "plane", position=(x, y, z), normal=axis), turning
        case "cylinder":
            return Geometry(name, body, "bore", radius=surface.radius, axis=axis), turning
        case "bowl":
            return Geometry(name, body, "bowl", radius=surface.radius), turning
        case "cone":
            return Geometry(name, body, "cone", slope=surface.slope, position=(0.0, 0.0, surface.tip)), turning
        case "torus":
            ring, wire = surface.ring_radius, surface.wire_radius
            return Geometry(name, body, "torus", ring_radius=ring, radius=wire), turning
    raise InputError("kind", surface.kind, "no wall of a body has this form")


def _turning_wall(ball: Ball, wall: Geometry, turning: float, free: Joint) -> list[tuple[Body, Joint]]:
    """Body of a wall that turns, and the joint that turns it; no motion or force depends on its mass or inertia.

    They are of the size of the ball's about the axis, for a body that is much lighter loses digits.
    """
    if not turning:
        return []
    axis = wall.normal if wall.kind == "plane" else wall.axis
    about_axis = ball.inertia + ball.mass * math.hypot(*free.q0[:3]) ** 2
    body = Body(wall.body, ball.mass, inertia=_isotropic(about_axis))
    motion = Formula(f"{turning!r}*t")
    return [(body, Joint(f"{wall.body}_turning", JointKind.REVOLUTE, WORLD, wall.body, axis=axis, motion=motion))]


def _free_joint(placed: PlacedBall, wall: Geometry, turning: float) -> Joint:
    """Joint of the ball's body, with its start."""
    ball, contact, start = placed.ball, placed.contact, placed.start
    shape = wall.solid
    assert isinstance(shape, HalfSpace | CurvedWall)  # by `_wall`
    on_wall = wall_coordinates(shape, ball.radius)
    p0, v0, w0, slip = _initial(on_wall, ball.radius, start, turning * on_wall.axis)
    if not np.all(np.isfinite([p0, v0, w0])):
        advice = "the surface has no normal there, as at an apex; start elsewhere"
        raise InputError("coordinates", list(start.coordinates), advice)
    if slip and not start.gap and math.isinf(contact.mu_static):
        advice = "a ball that starts slipping needs a number for mu_static, or leave its tangential_spin out"
        raise InputError("tangential_spin", start.tangential_spin, advice)
    q0, velocity = (*p0.tolist(), 1.0, 0.0, 0.0, 0.0), (*v0.tolist(), *w0.tolist())
    return Joint(f"{ball.name}_free", JointKind.FREE, WORLD, ball.name, q0=q0, v0=velocity)


def _initial(
    on_wall: WallCoordinates | Declared, radius: float, start: InitialMotion, rate: Array
) -> tuple[Array, Array, Array, bool]:
    """Centre, velocity and spin at the start [SI], and whether the ball slips on a wall that turns at a ``rate``."""
    u0 = np.asarray(start.coordinates, dtype=np.float64)
    frame, centre = on_wall.frame(u0), on_wall.position(u0)
    v0 = frame[:, 1:] @ np.asarray(start.velocity)
    carried = cross(rate, centre + radius * frame[:, 0])
    w0 = start.spin * frame[:, 0] - cross(frame[:, 0], v0 - carried) / radius
    p0 = centre - start.gap * frame[:, 0]
    if start.tangential_spin is None:
        return p0, v0, w0, False
    spin = frame @ (start.spin, *start.tangential_spin)
    slip = radius * float(np.linalg.norm(cross(spin - w0, frame[:, 0])))
    slips = slip > _ROUND_OFF * float(np.linalg.norm(v0))
    return p0, v0, spin if slips else w0, slips


def _pair(placed: PlacedBall, wall: Geometry) -> Pair:
    """Pair of the ball and its wall; what never slips has no kinetic friction."""
    ball, law = placed.ball, placed.contact
    friction = math.inf if math.isinf(law.mu_static) else law.mu_kinetic
    return Pair(
        name=f"{ball.name}_on_{wall.name}",
        geometries=(ball.name, wall.name),
        friction=friction,
        restitution=law.restitution or 0.0,
        static_friction=law.mu_static if friction < law.mu_static else None,
        tangential_restitution=law.tangential_restitution,
        rolling_resistance=law.rolling_resistance,
        against=law.against,
    )


def _isotropic(moment: float) -> tuple[Vector, Vector, Vector]:
    """Inertia with one moment about every axis [kg m²]."""
    return (moment, 0.0, 0.0), (0.0, moment, 0.0), (0.0, 0.0, moment)
