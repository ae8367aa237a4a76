"""Bodies of a tree in scalars, and the loads of springs and applied forces on its velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from proofroll.elements.mechanism import Mechanism
from proofroll.truth.mechanism.bushing_scalars import bushing_load
from proofroll.truth.mechanism.contact_symbols import Vector
from proofroll.truth.mechanism.maximal_bodies import clean
from proofroll.truth.scalars import Scalar, add, cross, dot, minus, mul, plus, scaled, sub, turned, turned_back

NONE = (0.0, 0.0, 0.0)


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
            pull = add(pull, spring.force.pull(length, dot(minus(fast, slow), d) / length, functions) / length)
        for (body, arm, _, _), sign in zip(ends, (1.0, -1.0), strict=True):
            force = turned_back(body.R, scaled(sign, scaled(pull, d)))
            _add(load, body.at(arm)[0], force)
    for bushing in mechanism.bushings:
        ends = []
        for name, position in ((bushing.body_a, bushing.position_a), (bushing.body_b, bushing.position_b)):
            body, arm = bodies[index[name]], clean(position)
            speed = turned(body.R, plus(body.v, cross(body.w, arm)))
            ends.append((body, arm, plus(body.p, turned(body.R, arm)), speed))
        (first, _, from_a, slow), (second, _, to_b, fast) = ends
        w_a, w_b = turned(first.R, first.w), turned(second.R, second.w)
        motion = (minus(to_b, from_a), minus(fast, slow), minus(w_b, w_a), w_a)
        push, moment = bushing_load(bushing, first.R, second.R, motion, functions)
        for body, sign in ((second, 1.0), (first, -1.0)):
            arm = turned_back(body.R, minus(to_b, body.p))
            _add(load, body.at(arm)[0], turned_back(body.R, scaled(sign, push)))
            _add(load, body.turn, turned_back(body.R, scaled(sign, moment)))
    for applied in mechanism.forces:
        first, second = bodies[index[applied.body]], bodies[index[applied.reaction]]
        size = applied.at(time, functions)
        size = turned(first.R, size) if applied.frame == "body" else size
        place = plus(first.p, turned(first.R, clean(applied.position)))
        for body, sign in ((first, 1.0), (second, -1.0)):
            acts = turned_back(body.R, scaled(sign, size))
            at_place = body.at(turned_back(body.R, minus(place, body.p)))[0] if applied.kind == "force" else body.turn
            _add(load, at_place, acts)


def _add(load: list[Scalar], ways: dict[int, Vector], force: Sequence[Scalar]) -> None:
    for n, way in ways.items():
        load[n] = add(load[n], dot(way, force))
