"""Replay of a mechanism: bodies as rods, joints, springs, tracked points, and forces of joints and contacts."""

import dataclasses
import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray, hermite
from proofroll.core.errors import Refused
from proofroll.core.scene import Scene
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.report.drawing import direction
from proofroll.elements.mechanism.run.contacts.observables import SLIDES
from proofroll.elements.mechanism.run.element import MechanismElement, the_mechanism
from proofroll.elements.mechanism.scene.checks import WORLD, ZERO, Vector
from proofroll.elements.mechanism.scene.joint_kinds import SLIDING, JointKind
from proofroll.elements.mechanism.scene.rotations import (
    quaternion_of_vector,
    quaternion_product,
    to_quaternion,
    vector_of_quaternion,
)
from proofroll.elements.mechanism.scene.shapes.geometry import BodyContact, DeclaredGeometry, Geometry
from proofroll.elements.mechanism.scene.shapes.shapes import SphereShape, Wall
from proofroll.files.json_data import plain
from proofroll.report.replay.records import SPEEDS, PackedNumbers, Replayed, present
from proofroll.report.replay.replay import frame_times, in_sight

# Thickness of lines, and largest invisible error, relative to the mechanism's length.
_SCALE, _SEEN = 0.035, 1e-3
# Distance from the true mechanism, in lengths, beyond which a run has left the picture.
_FAR = 20.0
_PATCH, _FLAT = 0.6, 0.02  # half of a plane's patch over its reach; half thickness of a disc over its radius
_TURN = 2.0**-14  # rounding of quaternions
_ROUNDED = 2.0**-17  # rounding of lengths, relative to the mechanism's, and of forces, relative to the largest
_LASTS = 4.0  # least duration of a replay [s]
_TAIL = 0.15  # part of the motion over which a path is drawn
_ASIDE = (0.3, 0.25)  # angles of the camera beside the drawing's view, to show depth [rad]
_STEEPEST = 1.3  # of the camera above the horizon [rad]
_MOTION = ("time", "p_WB", "v_WB", "w_WB", "q_WB")


def seen(scene: Scene) -> float:
    """Largest invisible error of a body's place [m]."""
    return _SEEN * the_mechanism(scene).length


def draw_mechanism(replayed: Replayed) -> tuple[dict[str, Any], list[int], PackedNumbers]:
    """Drawing of a mechanism in the replay: see :data:`proofroll.report.replay.records.Drawer`.

    Raises:
        Refused: the true motion is not known.
    """
    element = the_mechanism(replayed.scene)
    mechanism, length = element.mechanism, element.length
    bodies, rods = [*element.bodies, WORLD], _rods(element)
    joints = [
        (connection.name, connection.b, connection.position_b)
        for connection in mechanism.connections
        if connection.kind != JointKind.FREE
    ]
    # The force of a contact is drawn at the middle of the sphere, or of what is no wall, unless it is not determinate.
    touching = [_touching(contact) for contact in mechanism.contacts]
    joints += [
        (contact.name, body, middle) for contact, (body, middle, _) in zip(mechanism.contacts, touching, strict=True)
    ]
    signs = np.repeat([1.0] * (len(joints) - len(touching)) + [sign for *_, sign in touching], 3)
    names = [f"force.{name}.{axis}" for name, *_ in joints for axis in "xyz"]
    slips = [f"slip.{contact.name}" for contact in mechanism.contacts]
    true = present(replayed.true, [*_MOTION, *names, *slips])
    if not np.isfinite(true["p_WB"]).all():
        raise Refused("no true motion is known, so there is none to draw")
    fastest = float(np.linalg.norm(true["w_WB"], axis=-1).max())
    times = frame_times(float(true["time"][-1]), fastest)
    placed = _placed(element, true, times)
    ghosts = [
        _reachable(_placed(element, present(ghost.motion, _MOTION), times), placed, length) for ghost in replayed.ghosts
    ]
    least = 2.0 ** math.floor(math.log2(length * _ROUNDED))
    numbers = PackedNumbers()
    coms = {body.name: body.com for body in mechanism.bodies}
    com = np.stack([placed.point(*place) for place in coms.items()], axis=1)
    reached = np.concatenate(
        [placed.point(body, position) for body, places in mechanism.fastened.items() for position in places]
        + [_outline(contact, placed) for contact in mechanism.contacts]
        + [com.reshape(-1, 3)]
    )
    numbers.put("middle", -1, com.mean(axis=1), least)
    numbers.put("extent", 0, np.stack([reached.min(axis=0), reached.max(axis=0)]), least)
    force = _columns(true, names, times) * signs
    largest = float(np.abs(force).max(initial=0.0))
    numbers.put("force", 0, force if largest else None, _ROUNDED * largest)
    numbers.put("slip", 0, _columns(true, slips, times) if slips else None, _ROUNDED * element.speed)
    for run, motion in enumerate([placed, *ghosts]):
        numbers.put("p", run, motion.p_WB, least)
        numbers.put("q", run, motion.q_WB, _TURN)
        numbers.put("points", run, motion.points, least)
    index = {name: number for number, name in enumerate(bodies)}
    until = float(times[-1])
    case = {
        "until": until,
        "frames": times.size,
        "speed": max((speed for speed in SPEEDS if until / speed >= _LASTS), default=SPEEDS[0]),
        "from": _camera(element),
        "tail": _TAIL * until,
        "least": 10.0 ** math.floor(math.log10(1e3 * _SEEN * length)),
        "off": "largest distance of a tracked point from the true one",
        "scale": _SCALE * length,
        "events": [],
        "bodies": [{"com": coms.get(name), "rods": rods.get(name, [])} for name in bodies],
        "joints": [{"body": index[body], "at": position} for _, body, position in joints],
        "contacts": len(touching),
        "slips": SLIDES * element.speed,
        "shapes": [_shape(geometry, index[geometry.body], element, com) for geometry in mechanism.geometries
                   if not isinstance(geometry, DeclaredGeometry)],
        "springs": [[index[s.body_a], s.position_a, index[s.body_b], s.position_b] for s in mechanism.links]
                   + [[index[j.parent], j.position, index[j.child], j.child_position]
                      for j in mechanism.joints if j.kind in {*SLIDING, JointKind.PLANAR}],
        "falls": any(joint.kind == JointKind.FREE for joint in mechanism.joints),
    }  # fmt: skip
    return dict(plain(case)), [motion.time.size for motion in ghosts], numbers


def _rods(element: MechanismElement) -> dict[str, list[list[Vector]]]:
    """Ends of the rods of each body [m]: from its centre of mass to its fastenings, and between its vertices."""
    mechanism = element.mechanism
    rods = {body.name: [[body.com, place] for place in mechanism.fastened[body.name]] for body in mechanism.bodies}
    for body in mechanism.bodies:
        spheres = [item for item in mechanism.geometries if item.body == body.name and item.kind == "sphere"]
        vertices = [item.position for item in spheres if item.position != body.com] if len(spheres) > 1 else []
        rods[body.name] += [[body.com, place] for place in vertices]
        rods[body.name] += [list(ends) for ends in itertools.combinations(vertices, 2)]
    return rods


def _outline(contact: BodyContact, placed: Placed) -> FloatArray:
    """Outermost points along the world's axes of a contact's shape that is no wall, at all frames, shape (n, 3)."""
    body, _, sign = _touching(contact)
    shape = contact.shape_a if sign > 0 else contact.shape_b
    assert not isinstance(shape, Wall)
    origin, turned = placed.point(body, ZERO), placed.R_WB[:, placed.mechanism.body_index[body]]
    ways = np.concatenate([np.eye(3), -np.eye(3)])
    return np.array([p + R @ shape.support(way @ R)[0] for p, R in zip(origin, turned, strict=True) for way in ways])


def _touching(contact: BodyContact) -> tuple[str, Vector, float]:
    """The contact's convex shape: its body, its centre there [m], and +1 if the force is the one on body a, else -1.

    Of a solid and a sphere it is the sphere.
    """
    body, shape, sign = contact.body_a, contact.shape_a, 1.0
    if isinstance(shape, Wall) or (contact.features is not None and isinstance(contact.shape_b, SphereShape)):
        body, shape, sign = contact.body_b, contact.shape_b, -1.0
    assert not isinstance(shape, Wall)  # two walls are no contact
    x, y, z = shape.centre.tolist()
    return body, (x, y, z), sign


def _shape(geometry: Geometry, body: int, element: MechanismElement, com: FloatArray) -> dict[str, Any]:
    """Numbers of a geometry: its frame in its body's frame, and half sizes [m]; a plane is drawn as a patch."""
    place, frame, half = (
        np.array(geometry.position),
        geometry.frame,
        np.array(geometry.axes or (geometry.radius or 0,) * 3),
    )
    if geometry.kind == "box":
        half = np.array(geometry.size) / 2
    if geometry.kind == "circle":
        half[2] = _FLAT * half[0]
    if geometry.kind == "cylinder":
        half[2] = (geometry.length or 0.0) / 2
    if geometry.kind in {"bore", "shaft"}:
        foot, axis = place, frame[:, 2]
        heights = (com - foot) @ axis if geometry.body == WORLD else np.zeros(1)
        place, half[2] = foot + heights.mean() * axis, np.ptp(heights) / 2 + half[0]
    if geometry.kind == "plane":
        if geometry.body == WORLD:  # centred below the moving bodies
            middle, n = com.mean(axis=(0, 1)), frame[:, 2]
            place, reach = middle - n * (n @ (middle - place)), element.length + float(np.ptp(com, axis=0).max())
        else:  # as large as the initial distance to the bodies that it may touch
            pairs = [pair.geometries for pair in element.mechanism.pairs if geometry.name in pair.geometries]
            owner = {
                geometry_of.name: element.mechanism.body_index[geometry_of.body]
                for geometry_of in element.mechanism.geometries
            }
            meets = [owner[name] for pair in pairs for name in pair if owner[name] not in {-1, body}]
            reach = float(np.max(np.linalg.norm(com[0, meets] - com[0, body], axis=-1), initial=0.0))
        half = np.array([_PATCH * reach, _PATCH * reach, 0.0])
    if geometry.kind == "cone":  # as long as the motion is high
        reach = float((np.linalg.norm(com - place, axis=-1) if geometry.body == WORLD else np.ones(1)).max())
        half = reach * np.array([math.cos(geometry.slope or 0.0)] * 2 + [math.sin(geometry.slope or 0.0)])
    if geometry.kind == "torus":
        half = np.full(3, geometry.ring_radius)
    turn = np.roll(to_quaternion(frame), -1)
    shape: dict[str, Any] = {
        "body": body,
        "kind": geometry.kind,
        "at": place.tolist(),
        "turn": turn.tolist(),
        "half": half.tolist(),
    }
    if geometry.kind == "capsule" and geometry.radius:
        shape["long"] = (geometry.length or 0.0) / geometry.radius
    return shape | {"wire": (geometry.radius or 0.0) / geometry.ring_radius} if geometry.ring_radius else shape


def readings(scene: Scene) -> list[tuple[str, str]]:
    """Names and units of the coordinates listed beside the picture: of tracked points, then of joints."""
    element = the_mechanism(scene)
    points = [(f"{point.name}.{axis}", "m") for point in element.mechanism.points for axis in "xyz"]
    units = {JointKind.REVOLUTE: "rad", JointKind.PRISMATIC: "m"}
    joints = [(f"q.{joint.name}", units[joint.kind]) for joint in element.mechanism.joints if joint.kind in units]
    return points + joints


def _camera(element: MechanismElement) -> tuple[float, float]:
    """Angles of the camera about the vertical and above the horizon [rad]."""
    x, y, z = direction(element)[0]
    lift = math.asin(max(-1.0, min(1.0, z))) + (_ASIDE[1] if z < 0.5 else -_ASIDE[1])
    upright = math.hypot(x, y) < 1e-6  # the view is from above
    turn = -math.pi / 2 if upright else math.atan2(y, x)
    return turn + _ASIDE[0], max(-_STEEPEST, min(_STEEPEST, lift))


def _columns(sampled: dict[str, npt.NDArray[Any]], names: list[str], times: FloatArray) -> FloatArray:
    """Variables at the frames, 0 where they have no value, shape (frames, names)."""
    columns = [np.interp(times, sampled["time"], np.nan_to_num(sampled[name])) for name in names]
    return np.stack(columns, axis=1) if columns else np.zeros((times.size, 0))


def _placed(element: MechanismElement, sampled: dict[str, npt.NDArray[Any]], times: FloatArray) -> Placed:
    """Motion at the frames, interpolated from stored samples, up to the last sample."""
    grid = sampled["time"]
    if grid.size < 2:  # it ended before its first step
        return Placed(element.mechanism, times[:1], *(sampled[name][:1] for name in _MOTION[1:]))
    times = times[times <= grid[-1] * (1 + 1e-12)]
    p_WB = hermite(grid, sampled["p_WB"], sampled["v_WB"], times)
    v_WB, w_WB = (np.zeros_like(p_WB) for _ in range(2))  # not drawn
    q_WB = np.stack(
        [_orientations(grid, sampled["q_WB"][:, n], sampled["w_WB"][:, n], times) for n in range(p_WB.shape[1])], axis=1
    )
    return Placed(mechanism=element.mechanism, time=times, p_WB=p_WB, v_WB=v_WB, w_WB=w_WB, q_WB=q_WB)


def _orientations(grid: FloatArray, q: FloatArray, w: FloatArray, times: FloatArray) -> FloatArray:
    """Orientations between samples, with the whole turns that the spin implies, shape (frames, 4)."""
    turn = vector_of_quaternion(quaternion_product(q[1:], q[:-1] * [1, -1, -1, -1]))
    spun = (w[1:] + w[:-1]) / 2 * np.diff(grid)[:, None]
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    # Where the turn is a whole number of turns, its axis is that of the spin.
    axis = np.where(angle > 1e-9, turn, spun)
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
    whole = np.round((np.sum(spun * axis, axis=1, keepdims=True) - angle) / (2 * np.pi))
    turn = turn + 2 * np.pi * whole * axis
    index = np.clip(np.searchsorted(grid, times, side="right") - 1, 0, grid.size - 2)
    part = (times - grid[index]) / np.diff(grid)[index]
    return quaternion_product(quaternion_of_vector(part[:, None] * turn[index]), q[index])


def _reachable(motion: Placed, true: Placed, length: float) -> Placed:
    """Motion cut off where the mechanism leaves the picture for good, as a motion without bound does."""
    count = motion.time.size
    last = in_sight(np.linalg.norm(motion.p_WB - true.p_WB[:count], axis=-1).max(axis=-1) > _FAR * length)
    kept = {name: getattr(motion, name)[:last] for name in ("time", *_MOTION[1:])}
    return dataclasses.replace(motion, **kept)
