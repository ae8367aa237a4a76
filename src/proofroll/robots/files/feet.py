"""Shapes of a robot file that touch, its floor and their pairs, as tables of a scene.

MuJoCo's own search finds the pairs, and says with which coefficients it combines two shapes: so all that a file can say
of who touches whom needs no rules of ours. Of a URDF the pairs with a floor count, as it says nothing of others.
"""

from __future__ import annotations

import itertools
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import fromstring, tostring

import numpy as np

from proofroll.core.errors import InputError, require_known
from proofroll.core.limits import TIME_LIMIT
from proofroll.core.number_format import counted
from proofroll.elements.mechanism import WORLD
from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.elements.mechanism.scene.rotations import frame_of_axis, to_quaternion, to_rpy
from proofroll.files.json_data import plain
from proofroll.robots.files import reading
from proofroll.robots.files.meaning import by_definer, opened
from proofroll.robots.files.mjcf.compiler import near_shapes
from proofroll.robots.files.mjcf.parse import NO_SHAPE
from proofroll.robots.files.robot_file import RobotFile, read_xml
from proofroll.robots.files.urdf import BASE_JOINT
from proofroll.robots.model import NO_BODY, Array, Robot
from proofroll.robots.protocol import OVERLAP, WATCHED
from proofroll.robots.states import RobotStates

# What a robot stands on: the number of each in the parameter ``ground`` of a scene.
NO_GROUND, OF_FILE, ON_A_PLANE = "none", "file", "plane"
GROUNDS = (NO_GROUND, OF_FILE, ON_A_PLANE)
FLOOR, NO_FLOOR = "floor", "no floor"
_NAMED = 4  # links or shapes in a clause
_FRICTION = 1.0  # of shapes of a URDF, which has none
_ANOTHER_WAY = "give [ground] feet = {LINK = radius}, or take --ground none"
# Pairs of shapes that have a rule of contact in a scene.
_RULED = {frozenset(("plane", kind)) for kind in ("sphere", "capsule", "box", "cylinder", "ellipsoid", "mesh")} | {
    frozenset(("sphere", "capsule")),
    frozenset(("sphere", "box")),
    frozenset(("sphere", "cylinder")),
    frozenset(("capsule", "box")),
    *(frozenset((kind,)) for kind in ("sphere", "capsule", "box")),
}
# Shapes without a rule on a box that have one on its face, as on a plane; a box that overlaps it is lifted over this.
_ON_FACES = ("cylinder", "ellipsoid", "mesh")
_ROUND = ("sphere", "capsule", "mesh")  # a margin around these, or around the corners of a mesh, is a larger radius
_MOST_CORNERS = 64  # of the convex hull of a mesh; each is a contact
_THIN = 1e-3  # m: margin around other shapes that is left out
_REBOUNDS = 0.5  # damping ratio of a soft contact below which it visibly rebounds
_SLIDES, _SPINS, _ROLLS = 1, 4, 6  # dimensions of MuJoCo's contacts without friction, and with more than sticking


class GroundTables(NamedTuple):
    """Tables of what a robot touches.

    Attributes:
        geometries, pairs: tables of a scene.
        about: clause on what stands on what, for people.
        left_out: clauses on shapes that collide in the file and not here.
    """

    geometries: list[dict[str, Any]]
    pairs: list[dict[str, Any]]
    about: str
    left_out: list[str]


@dataclass(frozen=True)
class StandingRobot:
    """A robot at its start, with what holds its joints.

    Attributes:
        file, robot: the file and its robot.
        bodies: link that moves -> its body in the scene.
        start: its state.
        servos: joint -> gains kp and kd of its servo, and its targets at equal intervals of a second.
        drop: height of its lowest shape over the floor [m]; None: as in the file.
    """

    file: RobotFile
    robot: Robot
    bodies: Mapping[str, str]
    start: RobotStates
    servos: Mapping[str, tuple[float, float, list[float]]]
    drop: float | None = None

    def armature(self, joint: str) -> float:
        """Inertia that is added to a joint's own coordinate."""
        return next(item.armature for item in self.robot.moving if item.name == joint)

    def place(self, link: str) -> tuple[str, Array, Array]:
        """Body of the scene that carries a link, with the place [m] and axes of the link in it."""
        carrier, p, R = self.robot.carried(link)
        return (self.bodies[carrier] if carrier != NO_BODY else WORLD), p, R


def ground_tables(
    standing: StandingRobot, ground: str, feet: str | Mapping[str, float], friction: float | None
) -> GroundTables:
    """Shapes and pairs of a robot on a ground.

    Args:
        standing: the robot.
        ground: one of :data:`GROUNDS` but the first.
        feet: link -> radius of a ball at its origin [m]; or a word: the shapes of the file.
        friction: coefficient of all pairs with a floor; None: that of the file, or 1 where it has none.

    Raises:
        InputError: shapes touch that no scene has, or none touches.
    """
    if not isinstance(feet, str):
        return _balls(standing, feet, _FRICTION if friction is None else friction)
    file = standing.file
    of_urdf = file.kind == "urdf"
    content, lost = _with_contacts(file)
    asked = {
        "start": _coordinates(standing.start),
        "servos": {name: [*gains, standing.armature(name)] for name, gains in standing.servos.items()},
        "base_joint": BASE_JOINT if of_urdf and file.base == "free" else "",
        "floor": of_urdf or ground == ON_A_PLANE,
        "drop": standing.drop,
    }
    with tempfile.TemporaryDirectory() as folder:
        copy = reading.write(RobotFile(file.path, file.kind, fromstring(content)), Path(folder))
        limits = (dict(plain(asked)), TIME_LIMIT)
        rows, _ = by_definer("mjcf", file.path, None, lambda worker: near_shapes(worker, file.path, copy, *limits))
    shapes = [_shape(standing, row) for row in rows["shapes"]]
    pairs = [_NearPair(**row | {"shapes": tuple(shapes[k] for k in row["shapes"])}) for row in rows["pairs"]]
    pairs = [pair for pair in pairs if pair.moves and (pair.on_floor or not of_urdf)]
    lifted = any(joint.kind == JointKind.FREE for joint in standing.robot.moving)
    return _tables(file, pairs, friction, lost, lifted=lifted and any(pair.on_plane for pair in pairs))


class _Shape(NamedTuple):
    """A shape of the file.

    Attributes:
        name: unique.
        body, link: body of the scene, and link.
        kind, size: MuJoCo's.
        p, R: pose in the body.
        corners: of a mesh, in its axes [m].
    """

    name: str
    body: str
    link: str
    kind: str
    size: Sequence[float]
    p: Array
    R: Array
    corners: Sequence[Sequence[float]] = ()

    def face(self, axis: int, side: int) -> _Shape:
        """Plane in which a face of a box lies."""
        normal = side * self.R[:, axis]
        name = f"{self.name} face {'-+'[side > 0]}{'xyz'[axis]}"
        return self._replace(name=name, kind="plane", p=self.p + self.size[axis] * normal, R=frame_of_axis(normal))

    def tables(self, margin: float) -> list[dict[str, Any]]:
        """Tables of the geometry, of each corner of a mesh, with a margin added around it."""
        if self.kind != "mesh":
            return [self.table(margin)]
        places = self.p + np.array(self.corners) @ self.R.T
        points = (
            self._replace(name=f"{self.name} corner {number}", kind="sphere", size=(0.0,), p=place)
            for number, place in enumerate(places, 1)
        )
        return [point.table(margin) for point in points]

    def table(self, margin: float) -> dict[str, Any]:
        """Table of the geometry, which is no mesh, with a margin added around it."""
        grown = f"{self.name} and {margin:g} m" if margin else self.name
        row: dict[str, Any] = {"name": grown, "body": self.body, "kind": self.kind, "position": self.p.tolist()}
        size, axis = list(self.size), self.R[:, 2].tolist()
        if self.kind == "plane":
            return row | {"position": (self.p + margin * self.R[:, 2]).tolist(), "normal": axis}
        if self.kind == "sphere":
            return row | {"radius": size[0] + margin}
        if self.kind in {"capsule", "cylinder"}:
            return row | {"radius": size[0] + margin, "length": 2 * size[1], "axis": axis}
        turned = {"orientation": list(to_rpy(self.R))}
        return row | turned | ({"size": [2 * half for half in size]} if self.kind == "box" else {"axes": size})


@dataclass(frozen=True)
class _NearPair:
    """Two shapes that come near each other, the one of the world last, with MuJoCo's laws of their contact.

    Attributes:
        dim: its dimension; 1: without friction.
        friction: coefficients along two directions [1], of spin [m], of rolling about two axes [m].
        softness: time constant [s] and damping ratio, or two negative numbers.
        margin: distance from which it presses [m].
        distance, start: the least one that was seen, and that at the start [m].
        face: axis and side of the face of a box of the world within whose borders they met; empty: there is none.
    """

    shapes: tuple[_Shape, ...]
    dim: int
    friction: Sequence[float]
    softness: Sequence[float]
    margin: float
    distance: float
    start: float
    face: Sequence[int]

    def __post_init__(self) -> None:
        moving, partner = sorted(self.shapes, key=lambda shape: shape.body == WORLD)
        of_face = moving.kind in _ON_FACES or (moving.kind == "box" and self.margin - self.start > OVERLAP)
        if self.face and self.touches and partner.kind == "box" and of_face:
            partner = partner.face(*self.face)
        object.__setattr__(self, "shapes", (moving, partner))

    @property
    def touches(self) -> bool:
        """True if they pressed each other."""
        return self.distance <= max(self.margin, 0.0)

    @property
    def moves(self) -> bool:
        """True if the shapes are of two bodies."""
        return self.shapes[0].body != self.shapes[1].body

    @property
    def on_plane(self) -> bool:
        """True if one shape is a plane of the world, a floor or a face of a box."""
        return self.shapes[1].kind == "plane" and self.shapes[1].body == WORLD

    @property
    def on_floor(self) -> bool:
        """True if one shape is a plane of the world, and no face of a box."""
        return self.on_plane and not self.face

    @property
    def on_face(self) -> bool:
        """True if one shape is the plane of a box's face."""
        return self.on_plane and bool(self.face)

    @property
    def grown(self) -> tuple[float, float]:
        """Margins around both shapes [m], if one is round; MuJoCo presses in the middle between them."""
        rounds = [shape.kind in _ROUND for shape in self.shapes]
        takes = [item or shape.kind == "plane" for item, shape in zip(rounds, self.shapes, strict=True)]
        share = self.margin / sum(takes) if self.margin > 0 and any(rounds) else 0.0
        return share * takes[0], share * takes[1]

    def reasons(self, *, lifted: bool) -> Iterator[str]:
        """Reasons that a scene has no such pair; ``lifted``: the robot is lifted out of what stands below it."""
        kinds = [shape.kind for shape in self.shapes]
        if frozenset(kinds) not in _RULED:
            yield " on ".join(kinds)
        if self.dim > _SLIDES and self.friction[0] != self.friction[1]:
            yield "friction of another size along another direction"
        if self.dim >= _ROLLS and self.friction[3] != self.friction[4]:
            yield "rolling friction of another size about another axis"
        most = max(len(shape.corners) for shape in self.shapes)
        if most > _MOST_CORNERS:
            yield f"a mesh whose convex hull has {most} corners; at most {_MOST_CORNERS} are taken"
        if self.margin > _THIN and not any(self.grown):
            yield f"a margin of {self.margin:g} m around {kinds[0]}"
        if self.softness[0] > 0 and self.softness[1] < _REBOUNDS:
            yield "a contact that rebounds by its softness"
        faces_down = self.on_plane and self.shapes[1].R[2, 2] <= 0
        if self.margin - self.start > OVERLAP and not (lifted and self.shapes[1].body == WORLD and not faces_down):
            by = f"they overlap by {1e3 * (self.margin - self.start):.3g} mm at the start"
            yield f"{by}: begin elsewhere by [start], or exclude the pair in the file"

    def table(self, friction: float | None) -> dict[str, Any]:
        """Table of the pair's laws; ``friction``: in place of the file's."""
        coefficient = friction if friction is not None and self.on_floor else self.friction[0]
        rows: dict[str, Any] = {"friction": float(coefficient) if self.dim > _SLIDES else 0.0}
        if self.dim >= _SPINS and coefficient:
            rows |= {"spinning_friction": float(self.friction[2]), "cone": "shared"}
        if self.dim >= _ROLLS and coefficient:
            rows["rolling_resistance"] = float(self.friction[3])
        return rows


def _tables(
    file: RobotFile, pairs: Sequence[_NearPair], friction: float | None, lost: list[str], *, lifted: bool
) -> GroundTables:
    """Tables of pairs that a scene has; those that do not touch are left out where it has not.

    Raises:
        InputError: shapes touch that no scene has, or none comes near another.
    """
    geometries: dict[str, dict[str, Any]] = {}
    rows, left_out, wrong = list[dict[str, Any]](), list(lost), list[str]()
    stands, others, endless = list[tuple[str, float]](), 0, dict[str, list[str]]()
    for pair in pairs:
        names = " and ".join(shape.name for shape in pair.shapes)
        if reasons := list(pair.reasons(lifted=lifted)):
            if pair.touches:
                wrong.append(f"{names} ({reasons[0]})")
            else:
                left_out.append(f"contact of {names}, {1e3 * pair.distance:.0f} mm apart ({reasons[0]})")
            continue
        if pair.on_face:
            endless.setdefault(pair.shapes[1].name, []).append(pair.shapes[0].name)
        laws = pair.table(friction)
        stands += [(pair.shapes[0].name, laws["friction"])] if pair.on_floor else []
        others += not pair.on_floor
        ends = [shape.tables(margin) for shape, margin in zip(pair.shapes, pair.grown, strict=True)]
        for end, other in itertools.product(*ends):
            geometries |= {end["name"]: end, other["name"]: other}
            both = [end["name"], other["name"]]
            rows.append({"name": " on ".join(both), "geometries": both} | laws)
    if wrong:
        more = f" and {counted(len(wrong) - 1, 'other pairs')}" if len(wrong) > 1 else ""
        raise InputError("ground", file.path, f"a scene has no contact of {wrong[0]}{more}; {_ANOTHER_WAY}")
    if not rows:
        near = "no shape of it comes near a floor or another shape within a second"
        if pairs:
            near = f"no shapes that come near each other within a second have a rule or touch: {left_out[-1]}"
        advice = "give [ground] feet = {LINK = radius}, or take --ground plane or none"
        raise InputError("ground", file.path, f"{near}; {advice}")
    left_out += [f"edges of {face}, which is endless for {_listed(shapes)}" for face, shapes in endless.items()]
    left_out.append(f"pairs of shapes that come near only after {WATCHED:g} s, or in another motion")
    return GroundTables(list(geometries.values()), rows, _about(stands, others), left_out)


def _balls(standing: StandingRobot, feet: Mapping[str, float], friction: float) -> GroundTables:
    """Balls at the origins of links, on the plane z = 0."""
    geometries: dict[str, dict[str, Any]] = {}
    for link, radius in feet.items():
        require_known(
            "ground.feet", link, filter(None, standing.robot.welded), "the robot has no such link; choose from"
        )
        body, p, R = standing.place(link)
        if body == WORLD:
            raise InputError("ground.feet", link, "this link does not move; name one that does")
        shape = _Shape(name=link, body=body, link=link, kind="sphere", size=(radius,), p=p, R=R)
        geometries[link] = shape.table(0.0)
    rows = [{"name": link, "geometries": [link, FLOOR], "friction": friction} for link in geometries]
    about = _about([(link, friction) for link in geometries], 0)
    geometries[FLOOR] = {"name": FLOOR, "body": WORLD, "kind": "plane"}
    return GroundTables(list(geometries.values()), rows, about, ["shapes of the file"])


def _about(stands: Sequence[tuple[str, float]], others: int) -> str:
    """Clause on what stands on what: shapes and frictions of the pairs with a floor, and the number of other pairs."""
    feet = {name for name, _ in stands}
    least, *_, most = sorted(f"{friction:g}" for _, friction in stands) * 2 or [""] * 2
    rough = f"friction {least}" if least == most else f"friction {least} to {most}"
    words = f"{counted(len(feet), 'shapes')} on a floor, {rough}" if stands else NO_FLOOR
    return f"{words}; {counted(others, 'other pairs')}" if others else words


def _shape(standing: StandingRobot, row: Mapping[str, Any]) -> _Shape:
    """A shape that MuJoCo's process described."""
    body, p, R = standing.place(row["body"])
    name = row["name"] or f"{row['body'] or WORLD} shape {row['number']}"
    return _Shape(
        name=name.translate(dict.fromkeys(map(ord, "./\\"), "_")),
        body=body,
        link=row["body"],
        kind=row["kind"],
        size=row["size"],
        p=p + R @ np.array(row["position"]),
        R=R @ np.array(row["rotation"]),
        corners=row["corners"],
    )


def _coordinates(start: RobotStates) -> dict[str, list[float]]:
    """Joint -> coordinates of a start, as :func:`proofroll.robots.importers.mujoco_model.near_shapes` takes them."""
    rows: dict[str, list[float]] = {name: values[:1].tolist() for name, values in start.angle.items()}
    for name, matrices in start.rotation.items():
        turned = to_quaternion(matrices[0]).tolist()
        rows[name] = [*start.position[name][0].tolist(), *turned] if name in start.position else turned
    return rows


def _with_contacts(file: RobotFile) -> tuple[bytes, list[str]]:
    """Text of the copy of a file that keeps its contacts, and clauses on shapes that it lacks."""
    if file.kind == "urdf":
        links = [link for link in read_xml(file.path).iter("link") if link.find("collision//mesh") is not None]
        return tostring(file.root, "utf-8"), _meshes([link.get("name", "") for link in links])
    copy = opened(file.path, file.base, contacts=True)
    lost = dict.fromkeys(remark.where for remark in copy.remarks if remark.what == NO_SHAPE)
    meshes = [where.removeprefix("mesh of ") for where in lost if where.startswith("mesh of ")]
    return tostring(copy.root, "utf-8"), [
        *_meshes(meshes),
        *(where for where in lost if not where.startswith("mesh of ")),
    ]


def _meshes(links: Sequence[str]) -> list[str]:
    """Clause on the meshes of links that collide in a file."""
    return [f"collision meshes of {_listed(links)}"] if links else []


def _listed(names: Sequence[str]) -> str:
    """The first names, and the number of the others."""
    others = counted(len(names) - _NAMED, "others")
    return ", ".join(names[:_NAMED]) + (f" and {others}" if names[_NAMED:] else "")
