"""Bodies of a tree in scalars, and the loads of springs and applied forces on its velocities."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.joint_kinds import AXES, SLIDING, WITH_QUATERNION, JointKind
from proofroll.truth.numerics.scalars import (
    Scalar,
    add,
    clean,
    cross,
    dot,
    minus,
    mul,
    of_quaternion,
    plus,
    product,
    quaternion_rate,
    scaled,
    sub,
    turned,
    turned_back,
)
from proofroll.truth.switching.bushing_scalars import bushing_load
from proofroll.truth.switching.contact_symbols import Vector

NONE = (0.0, 0.0, 0.0)
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_Matrix = Sequence[Vector]


@dataclass
class MovingBody:
    """A body: place of its frame and rotation in the world; the rest in its own axes, of its frame's origin.

    Attributes:
        p, R: place and rotation by rows.
        v, w: velocity and angular velocity.
        a, turning: their rates where v̇ = 0, without gravity.
        move, turn: derivative of velocity and angular velocity by each velocity of the tree that moves the body.
    """

    p: Vector
    R: Sequence[Vector]
    v: Vector
    w: Vector
    a: Vector
    turning: Vector
    move: dict[int, Vector]
    turn: dict[int, Vector]

    def at(self, arm: Vector) -> tuple[dict[int, Vector], Vector]:
        """Derivative of the velocity, and acceleration at v̇ = 0, of the material at an arm, in the body's axes."""
        move: dict[int, Vector] = {
            n: plus(self.move.get(n, NONE), cross(self.turn.get(n, NONE), arm)) for n in self.move | self.turn
        }
        return move, plus(self.a, cross(self.turning, arm), cross(self.w, cross(self.w, arm)))


def add_point_loads(
    mechanism: Mechanism, bodies: Sequence[MovingBody], load: list[Scalar], time: Scalar, functions: Any
) -> None:
    """Adds springs, bushings and applied forces to the loads along the velocities; the world is the last body."""
    index = mechanism.body_index
    for spring in mechanism.springs:
        ends = []
        for name, position in ((spring.body_a, spring.position_a), (spring.body_b, spring.position_b)):
            body, arm = bodies[index[name]], clean(position)
            speed = turned(body.R, plus(body.v, cross(body.w, arm)))
            ends.append((body, arm, plus(body.p, turned(body.R, arm)), speed))
        (_, _, from_a, slow), (_, _, to_b, fast) = ends
        d = minus(to_b, from_a)
        length = functions["sqrt"](dot(d, d))
        pull = mul(float(spring.stiffness), sub(1.0, float(spring.length) / length))
        if spring.damping:
            pull = add(pull, mul(float(spring.damping), dot(minus(fast, slow), d) / (length * length)))
        if spring.force is not None:
            rate = dot(minus(fast, slow), d) / length
            pull = add(pull, spring.force.pull(length, rate, functions, spring.name) / length)
        for (body, arm, _, _), sign in zip(ends, (1.0, -1.0), strict=True):
            force = turned_back(body.R, scaled(sign, scaled(pull, d)))
            _add(load, body.at(arm)[0], force)
    for bushing in mechanism.bushings:
        ends = []
        for name, position in ((bushing.body_a, bushing.position_a), (bushing.body_b, bushing.position_b)):
            body, arm = bodies[index[name]], clean(position)
            speed = turned(body.R, plus(body.v, cross(body.w, arm)))
            ends.append((body, arm, plus(body.p, turned(body.R, arm)), speed))
        (body_a, _, from_a, slow), (body_b, _, to_b, fast) = ends
        w_a, w_b = turned(body_a.R, body_a.w), turned(body_b.R, body_b.w)
        motion = (minus(to_b, from_a), minus(fast, slow), minus(w_b, w_a), w_a)
        push, moment = bushing_load(bushing, body_a.R, body_b.R, motion, functions)
        for body, sign in ((body_b, 1.0), (body_a, -1.0)):
            arm = turned_back(body.R, minus(to_b, body.p))
            _add(load, body.at(arm)[0], turned_back(body.R, scaled(sign, push)))
            _add(load, body.turn, turned_back(body.R, scaled(sign, moment)))
    for applied in mechanism.forces:
        body_a, body_b = bodies[index[applied.body]], bodies[index[applied.reaction]]
        size = applied.at(time, functions)
        size = turned(body_a.R, size) if applied.frame == "body" else size
        place = plus(body_a.p, turned(body_a.R, clean(applied.position)))
        for body, sign in ((body_a, 1.0), (body_b, -1.0)):
            acts = turned_back(body.R, scaled(sign, size))
            at_place = body.at(turned_back(body.R, minus(place, body.p)))[0] if applied.kind == "force" else body.turn
            _add(load, at_place, acts)


def _add(load: list[Scalar], ways: dict[int, Vector], force: Sequence[Scalar]) -> None:
    for n, way in ways.items():
        load[n] = add(load[n], dot(way, force))


def bodies_of_tree(
    m: Mechanism, q: Sequence[Scalar], v: Sequence[Scalar], functions: Any
) -> tuple[list[MovingBody], list[Scalar]]:
    """Bodies, the world last, and rates of the coordinates."""
    ground = MovingBody(p=NONE, R=_AXES, v=NONE, w=NONE, a=NONE, turning=NONE, move={}, turn={})
    bodies: list[MovingBody] = [ground] * (len(m.bodies) + 1)
    rates: list[Scalar] = []
    index = m.body_index
    for joint, at_q, at_v in zip(m.joints, m.q_slices, m.v_slices, strict=True):
        parent, coordinate = bodies[index[joint.parent]], q[at_q]
        d, S = _pose(joint.kind, coordinate, functions)
        frame = [clean(row) for row in joint.parent_frame]
        back = [clean(row) for row in joint.child_frame.T]
        across = product(product(frame, S), back)  # child's axes in the parent's, by rows
        to_joint = plus(clean(joint.position), turned(frame, d))
        from_joint = scaled(-1.0, clean(joint.child_position))
        in_child = {True: [clean(column) for column in joint.child_frame.T]}  # axes of B, then of A, in the child's
        in_child[False] = [turned_back(back, turned_back(S, axis)) for axis in _AXES]
        parent_move, a = parent.at(to_joint)
        w_parent, turning = turned_back(across, parent.w), turned_back(across, parent.turning)
        move: dict[int, Vector] = {n: turned_back(across, way) for n, way in parent_move.items()}
        turn: dict[int, Vector] = {n: turned_back(across, way) for n, way in parent.turn.items()}
        a = turned_back(across, a)
        velocity = turned_back(across, plus(parent.v, cross(parent.w, to_joint)))
        w, slide = list(w_parent), [0.0, 0.0, 0.0]
        axes = []
        for n, (of_child, axis, turns, by_child) in enumerate(AXES[joint.kind], at_v.start):
            way = in_child[of_child][axis]
            axes.append((n, way, turns, by_child))
            if turns:
                turn[n] = way
                w = plus(w, scaled(v[n], way))
            else:
                move[n] = way
                slide = plus(slide, scaled(v[n], way))
        a = plus(a, cross(w_parent, slide))
        for n, way, turns, by_child in axes:
            carried = scaled(v[n], cross(w if by_child else w_parent, way))
            if turns:
                turning = plus(turning, carried)
            else:
                a = plus(a, carried)
        velocity = plus(velocity, slide)
        place = plus(parent.p, turned(parent.R, to_joint))
        R = product(parent.R, across)
        at_joint = MovingBody(p=place, R=R, v=velocity, w=w, a=a, turning=turning, move=move, turn=turn)
        moved, a_origin = at_joint.at(from_joint)
        bodies[index[joint.child]] = MovingBody(
            p=plus(place, turned(R, from_joint)),
            R=R,
            v=plus(velocity, cross(w, from_joint)),
            w=w,
            a=a_origin,
            turning=turning,
            move=moved,
            turn=turn,
        )
        rates += _coordinate_rates(joint.kind, coordinate, v[at_v], S)
    return bodies, rates


def _pose(kind: str, q: Sequence[Scalar], functions: Any) -> tuple[Vector, _Matrix]:
    """Pose of frame B in frame A: origin, and rotation by rows."""
    if kind == JointKind.REVOLUTE:
        return NONE, _about_z(q[0], functions)
    if kind in SLIDING:
        return (0.0, 0.0, q[0]), _AXES if kind == JointKind.PRISMATIC else _about_z(q[1], functions)
    if kind == JointKind.UNIVERSAL:
        c, s = functions["cos"](q[1]), functions["sin"](q[1])
        return NONE, product(_about_z(q[0], functions), ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)))
    if kind == JointKind.PLANAR:
        return (q[0], q[1], 0.0), _about_z(q[2], functions)
    if kind == JointKind.FIXED:
        return NONE, _AXES
    return (q[:3] if kind == JointKind.FREE else NONE), of_quaternion(q[-4:])


def _about_z(angle: Scalar, functions: Any) -> _Matrix:
    c, s = functions["cos"](angle), functions["sin"](angle)
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def _coordinate_rates(kind: str, q: Sequence[Scalar], v: Sequence[Scalar], S: _Matrix) -> list[Scalar]:
    if kind not in WITH_QUATERNION:
        return list(v)
    turning = quaternion_rate(q[-4:], v[-3:])
    return [*turned(S, v[:3]), *turning] if kind == JointKind.FREE else turning
