"""Random bodies that touch: spheres, sleds, rods, discs, ellipsoids, arms and pins, on planes, in bores, each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.drives import Actuator
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.elements.mechanism.scene.signal import Formula

_G = (0.0, 0.0, -9.81)  # m/s²
_APART = 0.005  # m between the tip of an arm and its floor at the start, at least

Made = tuple[tuple[Body, ...], tuple[Joint, ...], tuple[Geometry, ...], tuple[Pair, ...]]


def random_contacts(seed: int) -> tuple[str, Mechanism, float]:
    """A style, a mechanism of it that is the same for the same number, and how long to follow it [s]."""
    rng = np.random.default_rng([290, seed])
    style = TURNS[seed % len(TURNS)]
    friction = float(rng.uniform(0.05, 0.6)) if rng.random() < 0.9 else 0.0
    make, until = STYLES[style]
    bodies, joints, geometries, pairs = make(rng, friction, style)
    gravity = _floats(rng.normal(size=3) * 3) if style == "spheres" else _G
    motors = (_motor(rng, joints[0]),) if style in {"plate", "arm", "pin"} and rng.random() < 0.5 else ()
    mechanism = Mechanism(bodies, joints, geometries=geometries, pairs=pairs, gravity=gravity, actuators=motors)
    return style, mechanism, until


def _sphere(rng: np.random.Generator, friction: float, style: str) -> Made:
    """A sphere that rolls or bounces, or the vertex of a body that falls, on a tilted plane."""
    radius = 0.0 if style == "vertex" else float(rng.uniform(0.03, 0.1))
    n = _tilted(rng, 0.4)
    off_centre = {"sphere": 0.01, "bounce": 0.005, "vertex": 0.03}[style]
    body = _body(rng, "b", size=max(radius, 0.05), off_centre=off_centre)
    turn = _turn(rng)
    at = rng.uniform(-0.02, 0.02, 3) if style == "vertex" else np.zeros(3)
    low, high = {"sphere": (0.0, 0.0), "bounce": (0.005, 0.04), "vertex": (0.002, 0.01)}[style]
    gap = float(rng.uniform(low, high)) if high else 0.0
    w, v = rng.normal(size=3) * 8, rng.normal(size=3) * 0.7
    if style == "sphere":
        v = v - n * (n @ v)
    restitution = float(rng.uniform(0.4, 0.9)) if style == "bounce" else 0.0
    joint = _free("j", "b", n * (radius + gap) - turn.apply(at), turn, v, w)
    return (
        (body,),
        (joint,),
        (Geometry("s", "b", "sphere", position=_floats(at), radius=radius), _plane(n)),
        (Pair("c", ("s", "f"), friction, restitution),),
    )


def _sled(rng: np.random.Generator, friction: float, _: str) -> Made:
    """A body that slides and turns on three feet."""
    n, height = _tilted(rng, 0.15), 0.1
    x = np.cross(n, _unit(rng))
    x /= np.linalg.norm(x)
    turn = Rotation.from_matrix(np.array([x, np.cross(n, x), n]).T)
    body = _body(rng, "b", mass=2, size=0.15)
    radius = float(rng.choice([0, 0.02]))
    angles = rng.uniform(0, 0.6) + np.array([0, 2.1, 4.2]) + rng.uniform(-0.3, 0.3, 3)
    reach = rng.uniform(0.12, 0.22, 3)
    feet = np.array([reach * np.cos(angles), reach * np.sin(angles), np.full(3, radius - height)]).T
    v = (*_floats(rng.normal(size=2) * 0.3), 0.0, 0.0, 0.0, float(rng.normal() * 3))
    joint = Joint("j", JointKind.FREE, "world", "b", q0=(*_floats(n * height), *_quaternion(turn)), v0=v)
    pairs = tuple(Pair(f"c{k}", (f"s{k}", "f"), friction * (1 + 0.1 * k)) for k in range(3))
    return (body,), (joint,), (_plane(n), *_feet(feet, radius)), pairs


def _rod(rng: np.random.Generator, friction: float, style: str) -> Made:
    """A rod with round ends, or a block with edges, in a plane; one foot touches or falls."""
    about_y = float(rng.uniform(0.01, 0.08))
    body = Body("b", 1.0, (0.0, 0.0, 0.0), ((0.06, 0.0, 0.0), (0.0, about_y, 0.0), (0.0, 0.0, 0.06)))
    angle = float(rng.uniform(0.1, 0.5))
    radius = 0.02 if style == "rod" else 0.0
    feet = np.array([(0, 0, -0.4), (0, 0, 0.4)] if style == "rod" else [(-0.1, 0, -0.25), (0.1, 0, -0.25)])
    placed = Rotation.from_rotvec([0, angle, 0]).apply(feet)
    low = placed[int(np.argmin(placed[:, 2]))]
    gap = float(rng.choice([0, 0.005, 0.01]))
    along, spin = float(rng.normal() * 0.5), float(rng.normal() * 1.5)
    rises = 0.0 if gap else spin * float(low[0])  # so that a foot that touches has no speed along the normal
    joint = Joint(
        "j", JointKind.PLANAR, "world", "b", axis=(0, 1, 0), second_axis=(1, 0, 0),
        q0=(0.0, -(radius - float(low[2]) + gap), angle), v0=(along, -rises, spin),
    )  # fmt: skip
    restitution = float(rng.choice([0, 0, 0.5]))
    pairs = tuple(Pair(f"c{k}", (f"s{k}", "f"), friction, restitution) for k in range(2))
    return (body,), (joint,), (Geometry("f", "world", "plane"), *_feet(feet, radius)), pairs


def _spheres(rng: np.random.Generator, friction: float, _: str) -> Made:
    """Two free spheres that meet."""
    a, b = _body(rng, "a", size=0.05), _body(rng, "b", size=0.05)
    u = _unit(rng)
    speed, aside = rng.uniform(0.3, 1), rng.normal(size=3) * 0.2
    still = Rotation.identity()
    joint_a = _free("ja", "a", np.zeros(3), still, u * speed + aside, rng.normal(size=3) * 10)
    turn = _turn(rng)
    joint_b = _free("jb", "b", u * 0.14, turn, np.zeros(3), turn.apply(rng.normal(size=3) * 10))
    geometries = Geometry("sa", "a", "sphere", radius=0.05), Geometry("sb", "b", "sphere", radius=0.06)
    pair = Pair("c", ("sa", "sb"), friction, float(rng.uniform(0, 1)))
    return (a, b), (joint_a, joint_b), geometries, (pair,)


def _rounded(rng: np.random.Generator, friction: float, style: str) -> Made:
    """An ellipsoid or the edge of a disc that rolls, slips or falls on a plane."""
    n, turn = _tilted(rng, 0.2), _turn(rng)
    body = _body(rng, "b", size=0.1, off_centre=0.01)
    down = turn.inv().apply(-n)
    if style == "ellipsoid":
        axes = np.array([0.1, 0.07, 0.05])
        lowest = axes**2 * down / np.sqrt((axes**2 * down) @ down)
        shape = Geometry("s", "b", "ellipsoid", axes=_floats(axes))
    else:
        edge = down * [1, 1, 0]
        lowest = 0.1 * edge / np.linalg.norm(edge)
        shape = Geometry("s", "b", "circle", radius=0.1, normal=(0, 0, 1))
    gap = float(rng.choice([0, 0.003]))
    arm, w, rolls = turn.apply(lowest), rng.normal(size=3) * 4, rng.random() < 0.5
    turning = np.cross(w, arm)
    if rolls:
        v = -turning
    else:
        v = rng.normal(size=3) * 0.3
        v = v - n * (n @ (v + turning))
    joint = _free("j", "b", n * gap - arm, turn, v, w)
    return (body,), (joint,), (shape, _plane(n)), (Pair("c", ("s", "f"), 2.0 if rolls else friction),)


def _plate(rng: np.random.Generator, friction: float, _: str) -> Made:
    """A sphere on a plate that swings about a hinge."""
    axis = _unit(rng) * [1, 1, 0.2]
    axis /= np.linalg.norm(axis)
    plate, ball = _body(rng, "p", mass=3, size=0.3), _body(rng, "b", size=0.05)
    hinge = Joint(
        "h", JointKind.REVOLUTE, "world", "p", axis=_floats(axis), q0=(float(rng.uniform(-0.2, 0.2)),),
        v0=(float(rng.normal()),), stiffness=float(rng.uniform(5, 40)), damping=0.3,
        armature=float(rng.choice([0, 0.02])),
    )  # fmt: skip
    turn = Rotation.from_rotvec(axis * hinge.q0[0])
    n, at = turn.apply([0, 0, 1]), turn.apply([0.1, 0.05, 0.02])
    gap, radius = float(rng.choice([0, 0.003])), 0.05
    w, slides = rng.normal(size=3) * 5, rng.normal(size=3) * 0.3
    v = np.cross(axis * hinge.v0[0], at) + slides - n * (n @ slides)
    joint = _free("j", "b", at + n * (radius + gap), Rotation.identity(), v, w)
    geometries = Geometry("s", "b", "sphere", radius=radius), Geometry("f", "p", "plane", position=(0, 0, 0.02))
    pair = Pair("c", ("s", "f"), friction, float(rng.choice([0, 0.6])) if gap else 0.0)
    return (plate, ball), (hinge, joint), geometries, (pair,)


def _arm(rng: np.random.Generator, friction: float, _: str) -> Made:
    """A double arm whose tip falls on a floor."""
    upper = Body("l1", 0.5, (0.0, 0.0, -0.15), ((0.004, 0.0, 0.0), (0.0, 0.004, 0.0), (0.0, 0.0, 0.001)))
    lower = Body("l2", 0.3, (0.0, 0.0, -0.1), ((0.002, 0.0, 0.0), (0.0, 0.002, 0.0), (0.0, 0.0, 0.0005)))
    first, rate, torque = float(rng.uniform(-0.6, 0.6)), float(rng.normal()), float(rng.normal())
    kind: Any = str(rng.choice(["revolute", "universal"]))
    q: tuple[float, ...] = (float(rng.uniform(0.3, 1)), float(rng.uniform(-0.5, 0.5)))
    v: tuple[float, ...] = (float(rng.normal() * 2), float(rng.normal()))
    shoulder = Joint(
        "j1",
        JointKind.REVOLUTE,
        "world",
        "l1",
        axis=(0, 1, 0),
        position=(0, 0, 0.5),
        q0=(first,),
        v0=(rate,),
        torque=torque,
    )
    if kind == "revolute":
        q, v, second_axis = q[:1], v[:1], None
    else:
        second_axis = (1.0, 0.0, 0.0)
    elbow = Joint(
        "j2", kind, "l1", "l2", axis=(0, 1, 0), position=(0, 0, -0.3), q0=q, v0=v, damping=0.05,
        second_axis=second_axis,
    )  # fmt: skip
    radius, tip = 0.02, 0.5 - 0.3 * np.cos(first) - 0.2 * np.cos(first + q[0]) * np.cos(q[1] if q[1:] else 0.0)
    floor = min(0.03, float(tip) - radius - _APART)
    geometries = (
        Geometry("s", "l2", "sphere", position=(0, 0, -0.2), radius=radius),
        Geometry("f", "world", "plane", position=(0, 0, floor)),
    )
    return (
        (upper, lower),
        (shoulder, elbow),
        geometries,
        (Pair("c", ("s", "f"), friction, float(rng.choice([0, 0.5]))),),
    )


def _pin(rng: np.random.Generator, friction: float, _: str) -> Made:
    """A tip that rubs on a disc that turns: of an arm on a hinge, or of a second disc beside, pressed on the first."""
    clutch, spin, height = rng.random() < 0.5, float(rng.normal() * 6), float(rng.uniform(0.02, 0.1))
    upright = np.array([0.0, 0.0, 1.0])
    axis = upright if clutch else _tilted(rng, 0.1)
    disc, other = _body(rng, "d", mass=1, size=0.2), _body(rng, "a", size=0.1)
    hinge = Joint(
        "h", JointKind.REVOLUTE, "world", "d", axis=_floats(axis), v0=(spin,), damping=float(rng.choice([0, 0.02]))
    )
    place = np.array([*rng.uniform(-0.15, 0.15, 2), height])
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    if clutch:
        tip = np.array([*rng.uniform(0.05, 0.2, 2), -height])
        hub = _body(rng, "hub", size=0.05)
        press = float(rng.uniform(2, 20))
        guide = Joint("g", JointKind.PRISMATIC, "world", "hub", _floats(place), axis=(0, 0, 1), torque=-press)
        shaft = Joint("s", JointKind.REVOLUTE, "hub", "a", axis=(0, 0, 1), v0=(float(rng.normal() * 6),))
        bodies, joints = (disc, hub, other), (hinge, guide, shaft)
    else:
        across = np.cross(upright, _unit(rng))
        across /= np.linalg.norm(across)
        tip = 0.25 * np.cross(upright, across) - height * upright + 0.05 * across
        rate = spin * float(upright @ np.cross(axis, place + tip)) / 0.25  # the tip stays on the disc
        arm = Joint("s", JointKind.REVOLUTE, "world", "a", _floats(place), axis=_floats(across), v0=(rate,))
        bodies, joints = (disc, replace(other, com=_floats(tip / 2))), (hinge, arm)
    geometries = Geometry("s", "a", "sphere", position=_floats(tip), radius=0.0), Geometry("f", "d", "plane")
    return bodies, joints, geometries, (Pair("c", ("s", "f"), friction),)


def _bore(rng: np.random.Generator, friction: float, _: str) -> Made:
    """A sphere in a bore of the world or of a free body."""
    body, k, radius = _body(rng, "b", size=0.03, off_centre=0.002), _unit(rng), 0.03
    wide, centre = float(rng.uniform(0.05, 0.3)), rng.normal(size=3) * 0.1
    u = np.cross(k, _unit(rng))
    u /= np.linalg.norm(u)
    gap = min(float(rng.choice([0, 0.003])), wide - radius - 0.001)
    place = centre + u * (wide - radius - gap) + k * rng.normal()
    w = rng.normal(size=3) * 10
    v = np.cross(k, u) * rng.normal() * 1.5 + k * rng.normal() * 0.5
    carried = rng.random() < 0.5
    ball = _free("j", "b", place, _turn(rng), v, w)
    pairs = (Pair("c", ("s", "w"), friction, float(rng.choice([0, 0.6])) if gap else 0.0),)
    shape = Geometry("s", "b", "sphere", radius=radius)
    if not carried:
        bore = Geometry("w", "world", "bore", position=_floats(centre), axis=_floats(k), radius=wide)
        return (body,), (ball,), (shape, bore), pairs
    tube = _body(rng, "t", mass=2, size=0.3, off_centre=0.02)
    turn, origin = _turn(rng), rng.normal(size=3) * 0.1
    back = turn.inv()
    bore = Geometry(
        "w", "t", "bore", position=_floats(back.apply(centre - origin)), axis=_floats(back.apply(k)), radius=wide
    )
    joint = _free("t", "t", origin, turn, np.zeros(3), np.zeros(3))
    return (tube, body), (joint, ball), (shape, bore), pairs


STYLES: dict[str, tuple[Callable[[np.random.Generator, float, str], Made], float]] = {
    "sphere": (_sphere, 0.08),
    "bounce": (_sphere, 0.15),
    "sled": (_sled, 0.07),
    "rod": (_rod, 0.12),
    "spheres": (_spheres, 0.1),
    "ellipsoid": (_rounded, 0.04),
    "plate": (_plate, 0.07),
    "arm": (_arm, 0.12),
    "bore": (_bore, 0.06),
    "block": (_rod, 0.15),
    "disc": (_rounded, 0.04),
    "vertex": (_sphere, 0.08),
    "pin": (_pin, 0.1),
}
_OTHERS = tuple(style for style in STYLES if style != "pin")
# Every second arm is a pin, so that all other numbers have the scenes that they had before there were any.
TURNS = (*_OTHERS, *("pin" if style == "arm" else style for style in _OTHERS))


def _floats(values: Any) -> Any:
    return tuple(float(value) for value in values)


def _motor(rng: np.random.Generator, joint: Joint) -> Actuator:
    """A servo, or a torque, that changes in time; half of them meet their limit."""
    kind: Any = str(rng.choice(["torque", "velocity", "position"]))
    size, rate, start = rng.uniform(0.5, 2), rng.uniform(5, 40), rng.uniform(0, 6)
    target = Formula(f"{size}*cos({rate}*t + {start})")
    limit = float(rng.uniform(0.2, 1)) if rng.random() < 0.5 else None
    gains = {"torque": {}, "velocity": {"kd": 0.3}, "position": {"kp": 3.0, "kd": 0.05}}[kind]
    return Actuator("m", joint.name, kind, target, gear=float(rng.choice([1, -2])), limit=limit, **gains)


def _unit(rng: np.random.Generator) -> Any:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def _turn(rng: np.random.Generator) -> Any:
    return Rotation.random(random_state=int(rng.integers(1 << 30)))


def _quaternion(turn: Any) -> Any:
    x, y, z, w = turn.as_quat()
    return _floats((w, x, y, z))


def _body(rng: np.random.Generator, name: str, mass: float = 0.0, size: float = 0.1, off_centre: float = 0.0) -> Body:
    """A body with random axes of inertia, of a random mass where none is given."""
    mass = mass or float(rng.uniform(0.2, 2))
    axes = _turn(rng).as_matrix()
    inertia = axes @ np.diag(np.sort(rng.uniform(0.5, 1, 3))) @ axes.T * 0.4 * mass * size**2
    rows: Any = tuple(map(_floats, (inertia + inertia.T) / 2))
    return Body(name, mass, _floats(rng.normal(size=3) * off_centre), rows)


def _tilted(rng: np.random.Generator, most: float) -> Any:
    """Normal of a plane tilted by at most an angle [rad]."""
    around, tilt = rng.uniform(0, 2 * np.pi), rng.uniform(0, most)
    return np.array([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.cos(tilt)])


def _plane(normal: Any) -> Geometry:
    return Geometry("f", "world", "plane", normal=_floats(normal))


def _feet(places: Any, radius: float) -> list[Geometry]:
    return [Geometry(f"s{k}", "b", "sphere", position=_floats(at), radius=radius) for k, at in enumerate(places)]


def _free(name: str, body: str, place: Any, turn: Any, v: Any, w: Any) -> Joint:
    """A free joint from place, rotation, velocity and angular velocity in world axes."""
    back = turn.inv()
    q0, v0 = (*_floats(place), *_quaternion(turn)), (*_floats(back.apply(v)), *_floats(back.apply(w)))
    return Joint(name, JointKind.FREE, "world", body, q0=q0, v0=v0)
