"""Drawing of a mechanism at its start: bodies, joints with their laws, loops, springs, points; of a ball, its wall."""

import itertools
import math
from typing import Protocol

import numpy as np
import numpy.typing as npt

from proofroll.core.arrays import FloatArray
from proofroll.elements.mechanism.contact.start import TOUCHING, touches
from proofroll.elements.mechanism.dynamics.kinematics import Tree
from proofroll.elements.mechanism.run.element import MechanismElement
from proofroll.elements.mechanism.scene.checks import WORLD
from proofroll.elements.mechanism.scene.joint_kinds import DISTANCE, SLIDING, JointKind
from proofroll.elements.mechanism.scene.rotations import frame_of_axis, from_rotation_vector, scaled
from proofroll.elements.mechanism.scene.shapes.shapes import HalfSpace, Shape, SphereShape, Wall
from proofroll.elements.mechanism.scene.shapes.walls import BowlWall, ConeWall, CurvedWall, DeclaredWall, TorusWall
from proofroll.elements.mechanism.scene.shapes.walls.charts import wall_coordinates
from proofroll.report.labels import symbol
from proofroll.report.pen import Drawing, View, across, circle, unit

_SIZE = 240.0  # size of the mechanism in the picture [px]
_JOINT, _MASS, _POINT = 4.0, 2.5, 3.0  # radii of the marks [px]
_NEAR = 44.0  # distance of two names that would cover each other [px]
_LINE = 15.0  # height of a line of names [px]
_MOST_NAMES = 12  # of joints and loops: more would cover the drawing
_OBLIQUE = (0.45, -0.85, 0.35)  # direction towards the viewer for spatial mechanisms, world axes with z up
_STROKE = 10.0  # half of the stroke that marks a stop [px]
_FARTHEST = 10.0  # farthest stop that is drawn, relative to the mechanism's length, or its angle [rad]
_TEETH = 8  # of the zigzag of a spring
_BLOCK = 9.0 * np.array([(1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1)])  # outline of a bushing [px]
_OUTLINE, _PATCH = 97, 0.6  # points of a shape's outline; half of a plane's patch, over the mechanism's length

# Pairs of corners of a box whose edges are 2 long.
_CORNERS = list(itertools.product((-1.0, 1.0), repeat=3))
_BOX_EDGES = [pair for pair in itertools.combinations(_CORNERS, 2) if np.abs(np.subtract(*pair)).sum() == 2.0]


def mechanism_drawing(element: MechanismElement) -> Drawing:
    """Drawing of a mechanism: lines from centres of mass to the fastenings of bodies, and marks of joints and parts.

    A ball on a curved wall, which is described in its local frame, is drawn on a net.
    """
    if (on_net := ball_on_net(element)) is not None:
        return on_net
    mechanism, start, picture = element.mechanism, element.start, Drawing()
    view = View(*direction(element), _SIZE / _reach(element))

    def place(body: str, position: tuple[float, ...]) -> FloatArray:
        return np.asarray(start.point(body, position)[0])

    _shapes(picture, view, element)
    for spring in mechanism.springs:
        ends = place(spring.body_a, spring.position_a), place(spring.body_b, spring.position_b)
        picture.path(_zigzag(view(np.stack(ends))), "thin")
    for bushing in mechanism.bushings:
        middle = view(place(bushing.body_a, bushing.position_a))
        both = np.stack([middle, view(place(bushing.body_b, bushing.position_b))])
        picture.path(_zigzag(both) if np.linalg.norm(both[1] - both[0]) > _NEAR else middle + _BLOCK, "thin")
        _name(picture, middle, bushing.name, "letter", (0.0, 24.0))
    ends_of = mechanism.fastened
    for body in mechanism.bodies:
        com = place(body.name, body.com)
        for end in ends_of[body.name]:
            picture.path(view(np.stack([com, place(body.name, end)])), "line")
        picture.disc(view(com).tolist(), _MASS, "ball")
    named: dict[tuple[int, ...], list[str]] = {}
    for number, connection in enumerate(mechanism.connections):
        if connection.kind == JointKind.FREE:
            continue
        here, there = place(connection.a, connection.position_a), place(connection.b, connection.position_b)
        if connection.kind in SLIDING:  # the line on which the child slides
            way = there - here if np.linalg.norm(there - here) else 0.2 * element.length * _axis(element, number)
            picture.path(view(np.stack([here - 0.3 * way, there + 0.3 * way])), "axis")
        if connection.kind == DISTANCE:
            picture.path(view(np.stack([here, there])), "line")
        picture.disc(view(there).tolist(), _JOINT, "ghost" if number >= len(mechanism.joints) else "wall")
        named.setdefault(tuple(np.round(view(there)).astype(int).tolist()), []).append(connection.name)
    for (x, y), names in named.items() if len(mechanism.connections) <= _MOST_NAMES else ():
        _name(picture, np.array([x, y]), ", ".join(names), "letter", (0.0, -9.0))
    for point in mechanism.points:
        here = view(place(point.body, point.position))
        picture.disc(here.tolist(), _POINT, "motion")
        _name(picture, here, point.name, "motion-letter", (0.0, 16.0))
    _laws(picture, view, element)
    left, top, width, _ = picture.box
    picture.gravity(view, np.array(mechanism.gravity), [left + width + 14.0, top + 10.0])
    return picture


def _reach(element: MechanismElement) -> float:
    """Length of the mechanism, of its longest shape, or half of the widest gap if that is longer [m]."""
    mechanism = element.mechanism
    gaps = [0.5 * touch.gap for touch in touches(mechanism, Tree(mechanism).at(*mechanism.start()))]
    shapes = [shape for contact in mechanism.contacts for shape in (contact.shape_a, contact.shape_b)]
    sizes = [
        float(np.linalg.norm(np.subtract(shape.support(axis)[0], shape.support(scaled(-1.0, axis))[0])))
        for shape in shapes
        if not isinstance(shape, Wall)
        for axis in np.eye(3).tolist()
    ]
    return max([element.length, *sizes, *gaps])


def _shapes(picture: Drawing, view: View, element: MechanismElement) -> None:
    """Draws outlines of shapes that may touch and of their bodies, a patch of each plane, names of closed contacts."""
    mechanism = element.mechanism
    motion = Tree(mechanism).at(*mechanism.start())
    touching, index = touches(mechanism, motion), mechanism.body_index
    upright = np.cross(direction(element)[0], view.right)
    rim = circle(np.zeros(3), view.right, upright, np.linspace(0.0, 2 * np.pi, _OUTLINE))
    drawn_already: set[bytes] = set()
    outlines: dict[str, list[FloatArray]] = {}
    for contact, touch in zip(mechanism.contacts, touching, strict=True):
        for body, shape in ((contact.body_a, contact.shape_a), (contact.body_b, contact.shape_b)):
            p, R = motion.p_WB[index[body]], motion.R_WB[index[body]]
            if isinstance(shape, HalfSpace):
                n = R @ shape.normal
                x, y = frame_of_axis(n)[:, 0], frame_of_axis(n)[:, 1]
                middle = np.mean([corner.place for corner in touching], axis=0)
                middle = middle - n * (n @ (middle - p - R @ shape.point))
                outline = middle + _PATCH * _reach(element) * np.array([x + y, y - x, -x - y, x - y, x + y])
            elif isinstance(shape, BowlWall) and _is_vertex(contact.shape_a, contact.shape_b):  # a cable
                outline = np.stack([p + R @ shape.point, touch.place])
            elif isinstance(shape, CurvedWall):  # the circle about its axis through the contact
                axis, foot = R @ shape.axis, p + R @ shape.point
                middle = foot + axis * (axis @ (touch.place - foot))
                x, y = frame_of_axis(axis)[:, :2].T * float(np.linalg.norm(touch.place - middle))
                outline = circle(middle, x, y, np.linspace(0.0, 2 * np.pi, _OUTLINE))
            else:
                outline = np.array([p + R @ shape.support(R.T @ d)[0] for d in rim])
            path = np.asarray(view(outline))
            if path.round(3).tobytes() not in drawn_already:
                picture.path(path, "hidden" if isinstance(shape, Wall) else "thin")
                drawn_already.add(path.round(3).tobytes())
                if not isinstance(shape, Wall) and body != WORLD:
                    outlines.setdefault(body, []).append(path)
        if touch.gap <= TOUCHING * element.length and len(touching) <= _MOST_NAMES:
            _name(picture, np.asarray(view(touch.place)), contact.name, "letter", (0.0, 14.0))
    _boxes(picture, view, element)
    for body, paths in outlines.items():
        com = view(motion.p_WB[index[body]] + motion.R_WB[index[body]] @ mechanism.bodies[index[body]].com)
        hull = _hull(np.array([com, *np.concatenate(paths)]))
        if len(paths) > 1 or np.any(np.all(hull == com, axis=1)):  # else the body is drawn by its only shape
            picture.path(hull, "line")


def _is_vertex(*shapes: Shape) -> bool:
    return any(isinstance(shape, SphereShape) and not shape.radius for shape in shapes)


def _boxes(picture: Drawing, view: View, element: MechanismElement) -> None:
    """Draws the edges of boxes that may touch."""
    mechanism = element.mechanism
    motion = Tree(mechanism).at(*mechanism.start())
    in_pairs = {name for pair in mechanism.pairs for name in pair.geometries}
    for box in mechanism.geometries:
        if box.kind != "box" or box.size is None or box.name not in in_pairs:
            continue
        number = mechanism.body_index[box.body]
        for corner, next_corner in _BOX_EDGES:
            ends = np.array([corner, next_corner]) * np.array(box.size) / 2
            places = motion.p_WB[number] + (np.array(box.position) + ends @ box.frame.T) @ motion.R_WB[number].T
            picture.path(np.asarray(view(places)), "line")


def _hull(places: FloatArray) -> FloatArray:
    """Closed outline around places of the picture, or the line through them; shapes (n, 2)."""
    _, sizes, axes = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)
    if sizes[-1] < 1.0:
        heights = places @ axes[0]
        return places[[heights.argmin(), heights.argmax()]]
    from scipy.spatial import ConvexHull  # which few pictures need

    corners = ConvexHull(places).vertices
    return places[[*corners, corners[0]]]


def _laws(picture: Drawing, view: View, element: MechanismElement) -> None:
    """Draws a ring and name for an actuator, a dashed line for a coupling, and a stroke where a stop is."""
    mechanism, start = element.mechanism, element.start

    def place(name: str) -> FloatArray:
        joint = mechanism.joints[mechanism.joint_index[name]]
        return np.asarray(start.point(joint.child, joint.child_position)[0])

    for actuator in mechanism.actuators:
        here = view(place(actuator.joint))
        picture.disc(here.tolist(), 2.0 * _JOINT, "force")
        _name(picture, here, actuator.name, "force-letter", (0.0, 2.0 * _JOINT + 12.0))
    for coupling in mechanism.couplings:
        ends = view(np.stack([place(name) for name, _ in coupling.terms]))
        picture.path(ends, "hidden")
        apart = np.linalg.norm(ends[1] - ends[0]) > _NEAR  # else below the names of joint and actuator
        _name(picture, ends.mean(axis=0), coupling.name, "letter", (0.0, -6.0 if apart else 36.0))
    for number, joint in enumerate(mechanism.joints):
        axis, here = _axis(element, number), place(joint.name)
        for limit in joint.limits or ():
            if abs(limit) * (element.length if joint.kind == JointKind.REVOLUTE else 1.0) > _FARTHEST * element.length:
                continue  # beyond the drawing
            if joint.kind == JointKind.PRISMATIC:
                there = view(here + (limit - joint.q0[0]) * axis)
                side = _STROKE * across(view(axis))
                picture.path(np.stack([there - side, there + side]), "line")
                continue
            com = mechanism.bodies[mechanism.body_index[joint.child]].com
            arm = np.asarray(start.point(joint.child, com)[0]) - here
            turned = from_rotation_vector((limit - joint.q0[0]) * axis) @ arm
            picture.path(view(np.stack([here, here + turned])), "faint")


def direction(element: MechanismElement) -> tuple[FloatArray, FloatArray]:
    """Unit vectors in the world: towards the viewer, and up in the picture.

    The viewer looks along the axes of the joints where all are parallel, else obliquely; gravity points down.
    """
    mechanism = element.mechanism
    axes = [_axis(element, n) for n, joint in enumerate(mechanism.joints) if joint.kind == JointKind.REVOLUTE]
    down = np.array(mechanism.gravity)
    up = -down / np.linalg.norm(down) if np.any(down) else np.array([0.0, 0.0, 1.0])
    viewer = _from_z_up(np.array(_OBLIQUE), up)
    plane = axes and all(np.linalg.norm(np.cross(axes[0], axis)) < 1e-6 for axis in axes)
    slides = any(
        joint.kind not in {JointKind.REVOLUTE, JointKind.PRISMATIC, JointKind.FIXED} for joint in mechanism.joints
    )
    if plane and not slides:
        viewer = axes[0] * (1.0 if float(axes[0] @ np.ones(3)) > 0 else -1.0)
        if np.linalg.norm(np.cross(viewer, up)) < 1e-6:
            up = np.array([0.0, 1.0, 0.0]) if abs(viewer[1]) < abs(viewer[2]) else np.array([0.0, 0.0, 1.0])
    return viewer / np.linalg.norm(viewer), up


def _from_z_up(direction: FloatArray, up: FloatArray) -> FloatArray:
    """A direction given for z up, turned along with z to another upward direction."""
    x_axis = np.eye(3)[int(np.argmin(np.abs(up)))]
    y_axis = unit(np.cross(up, x_axis))
    return np.asarray(np.stack([np.cross(y_axis, up), y_axis, up], axis=1) @ direction)


def _axis(element: MechanismElement, number: int) -> FloatArray:
    """Axis of a joint, or of a loop (numbered after the joints), in the world at the start; z of its frame."""
    connection = element.mechanism.connections[number]
    body = element.mechanism.body_index[connection.a]
    return np.asarray(element.start.R_WB[0, body] @ connection.frame_a[:, 2])


def _zigzag(ends: FloatArray) -> FloatArray:
    """Zigzag line of a spring between two places of the picture; ``ends`` has shape (2, 2)."""
    axis = ends[1] - ends[0]
    side = 5.0 * across(axis)
    inner = [ends[0] + (0.15 + 0.7 * (k + 0.5) / _TEETH) * axis + (1 if k % 2 else -1) * side for k in range(_TEETH)]
    return np.stack([ends[0], ends[0] + 0.15 * axis, *inner, ends[0] + 0.85 * axis, ends[1]])


def _name(picture: Drawing, place: FloatArray, name: str, look: str, beside: tuple[float, float]) -> None:
    """Writes a name with spaces for underscores, which the pen would turn into indices; clear of other names."""
    step = np.array([0.0, _LINE if beside[1] > 0 else -_LINE])
    shifts = (beside + k * step for k in range(_MOST_NAMES))
    clear = next((shift for shift in shifts if not picture.covers(place + shift, name)), np.array(beside))
    picture.text(place, name.replace("_", " "), look, (float(clear[0]), float(clear[1])))


_HALF_WIDTH = 128.0  # half the width of the drawn part of the wall [px]
_LINES, _FINE = 13, 61  # lines of the net along each coordinate, and points of each
_VIEWER = unit(np.array([math.cos(math.radians(-62)), math.sin(math.radians(-62)), math.tan(math.radians(32))]))
_WHOLE, _FAR = (-math.pi, math.pi), 1.6  # a turn; length of a wall without an end, over the way to the ball

Domain = tuple[tuple[float, float], tuple[float, float]]


class Net(Protocol):
    """A surface with coordinates."""

    def position(self, u: npt.ArrayLike) -> FloatArray:
        """Its points [m], shape (..., 3)."""

    def normal(self, p_WB: npt.ArrayLike) -> FloatArray:
        """Unit normals out of the ball, shape (..., 3)."""


def ball_on_net(element: MechanismElement) -> Drawing | None:
    """Drawing of an element that is described in the local frame of a curved wall; None for any other."""
    body, mechanism = element.on_wall, element.mechanism
    if body is None:
        return None
    contact = mechanism.contacts[body.contact_index]
    carrier, wall = (contact.body_b, contact.shape_b) if body.sign > 0 else (contact.body_a, contact.shape_a)
    if not isinstance(wall, CurvedWall | DeclaredWall):
        return None
    motion, number = Tree(mechanism).at(*mechanism.start()), mechanism.body_index[carrier]
    frame = body.surface.frame(body.u0)
    p0 = motion.p_WB[body.index]
    foot = p0 + body.ball.radius * frame[:, 0]
    net: Net
    if isinstance(wall, DeclaredWall):
        net, domain = wall.surface, wall.surface.domain
    else:
        net = wall_coordinates(wall, 0.0, motion.R_WB[number], motion.p_WB[number])
        domain = _domain(wall, float(np.linalg.norm(foot - motion.p_WB[number] - motion.R_WB[number] @ wall.point)))
    (low, high), (lowest, highest) = domain
    grid = np.stack(np.meshgrid(np.linspace(low, high, _FINE), np.linspace(lowest, highest, _FINE)), axis=-1)
    middle = net.position(grid.reshape(-1, 2))
    size = 0.5 * float(np.max(np.ptp(middle, axis=0)))
    centre = (middle.min(axis=0) + middle.max(axis=0)) / 2
    picture, view = Drawing(), View(_VIEWER, (0, 0, 1), _HALF_WIDTH / size)

    def line(u1: FloatArray, u2: FloatArray) -> None:
        points = net.position(np.stack(np.broadcast_arrays(u1, u2), axis=-1))
        looks = np.where(view.towards(net.normal(points)) > 0, "hidden", "line")  # seen from behind
        cuts = [0, *(1 + np.flatnonzero(looks[1:] != looks[:-1])).tolist(), len(looks) - 1]
        for start, end in itertools.pairwise(cuts):
            if end > start:
                picture.path(view(points[start : end + 1] - centre), str(looks[start]))

    for value in np.linspace(low, high, _LINES):
        line(np.full(1, value), np.linspace(lowest, highest, _FINE))
    for value in np.linspace(lowest, highest, _LINES):
        line(np.linspace(low, high, _FINE), np.full(1, value))
    for name, tangent in zip(body.surface.coordinates, frame[:, 1:].T, strict=True):
        picture.vector(view([foot - centre, foot - centre + 0.45 * size * tangent]), "thin", symbol(name), by=14.0)
    speed = float(np.linalg.norm(body.v0))
    if speed:
        picture.vector(view([p0 - centre, p0 - centre + 0.4 * size * body.v0 / speed]), "motion", "v")
    picture.disc(view(p0 - centre).tolist(), body.ball.radius * view.scale, "ball")
    picture.gravity(view, body.gravity, view(-1.25 * size * view.right))
    return picture


def _domain(wall: CurvedWall, away: float) -> Domain:
    """Coordinates of the drawn part of a wall; ``away``: of the ball from its origin [m]."""
    match wall:
        case BowlWall():
            equator = 2 * wall.radius
            return (-equator, equator), (-equator, equator)
        case ConeWall():
            return _WHOLE, (0.05 * away, _FAR * away)
        case TorusWall():
            return _WHOLE, _WHOLE
    return _WHOLE, (-_FAR * away, _FAR * away)
