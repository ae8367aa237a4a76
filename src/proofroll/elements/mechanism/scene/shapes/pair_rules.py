"""Pairs of geometries that have a rule of contact."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from proofroll.core.errors import InputError

if TYPE_CHECKING:
    from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, GeometryKind, Pair

# Walls that a sphere alone touches; all but a bowl have an axis.
CURVED = ("bore", "shaft", "bowl", "cone", "torus", "declared")
# Bodies of finite size with faces, edges, sides or ends, of which the nearest touches.
_SOLID = frozenset({"box", "capsule", "cylinder"})
# Room of a sphere in a wall, relative to the wall's radius, that counts as none: digits of a file.
_ROOM = 1e-9
_RULES = (
    "only a plane with a sphere, ellipsoid, circle, box, capsule or cylinder, a sphere with a sphere, box, capsule, "
    "cylinder or curved wall (bore, shaft, bowl, cone, torus), two capsules, two boxes, and a box with a capsule have "
    "a rule; choose one of these pairs"
)


def require_rule(key: str, pair: Pair, a: Geometry, b: Geometry) -> None:
    """Raises InputError if no rule says how two geometries touch."""
    kinds: set[GeometryKind] = {a.kind, b.kind}
    wall = next((geometry for geometry in (a, b) if geometry.kind in CURVED), None)
    if wall is not None:
        ruled = kinds == {wall.kind, "sphere"}
        _require_room(key, pair, wall, b if wall is a else a)
    elif "plane" in kinds:
        ruled = kinds != {"plane"}
    else:
        ruled = kinds <= {"capsule", "box"} or ("sphere" in kinds and kinds <= {"sphere", *_SOLID})
    if not ruled:
        raise InputError(key, pair.geometries, _RULES)
    balls = [geometry for geometry in (a, b) if geometry.kind == "sphere"]
    if len(balls) == 2 and not any(ball.radius for ball in balls):
        raise InputError(key, pair.geometries, "two points have no direction between them; give one a radius")
    if kinds & {"box", "cylinder"} and any(not ball.radius for ball in balls):
        raise InputError(key, pair.geometries, "a point has no direction from an edge; give the sphere a radius")
    _require_one_place(pair, kinds)
    if pair.against == "motion" and not (kinds & {"plane", *CURVED} and any(ball.radius for ball in balls)):
        advice = "only a sphere moves over a plane or a curved wall with its centre; leave it out, or give turning"
        raise InputError(f"pairs.{pair.name}.against", pair.against, advice)


def check_shared(where: str, pair: Pair) -> None:
    """Raises InputError for laws of a pair that a shared cone has not."""
    for key in ("friction", "spinning_friction"):
        if not 0 < getattr(pair, key) < math.inf:
            advice = "a shared cone needs one above 0, and finite; give it, or leave cone out"
            raise InputError(f"{where}.{key}", getattr(pair, key), advice)
    for key, default in (("static_friction", None), ("against", "turning"), ("tangential_restitution", 0.0)):
        if getattr(pair, key) != default:
            raise InputError(f"{where}.{key}", getattr(pair, key), "a shared cone has none; leave it out")


def _require_one_place(pair: Pair, kinds: set[GeometryKind]) -> None:
    """Raises InputError for friction against turning at both ends of a capsule or cylinder, or between boxes."""
    long_body = next(iter(kinds & {"capsule", "cylinder"}), None) if "plane" in kinds else None
    several = "boxes and capsules touch at several places" if "box" in kinds <= {"capsule", "box"} else ""
    several = f"a {long_body} touches at two ends" if long_body else several
    for key in ("rolling_resistance", "spinning_friction"):
        if several and getattr(pair, key) and pair.cone != "shared":
            advice = f'{several}, whose moments are not followed together; leave it out, or give cone = "shared"'
            raise InputError(f"pairs.{pair.name}.{key}", getattr(pair, key), advice)


def _require_room(key: str, pair: Pair, wall: Geometry, ball: Geometry) -> None:
    """Raises InputError if a sphere has no room in a curved wall."""
    inner = {"bore": wall.radius, "bowl": wall.radius, "torus": (wall.ring_radius or 0.0) - (wall.radius or 0.0)}
    room = inner.get(wall.kind)
    if room is not None and (ball.radius or 0.0) >= (1 - _ROOM) * room:
        size = f"a sphere of radius {ball.radius:g} m has no room in a {wall.kind} of {room:g} m"
        raise InputError(key, pair.geometries, f"{size}; make it smaller")
