"""Records written by hand, in closed form, and the law check that takes them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from proofroll.elements.mechanism import Body, Joint, Mechanism
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair
from proofroll.truth.check.laws.integrals import POINTS
from proofroll.truth.check.laws.motion import laws_of_pieces
from proofroll.truth.check.laws.record import Array, Modes, Passage, Pieces, stated
from proofroll.truth.check.laws.residuals import LawResiduals
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.transitions import transition

GRAVITY = 9.81


@dataclass(frozen=True)
class HandMade:
    """A record by hand: a mechanism, its pieces, and the transitions after some of them."""

    mechanism: Mechanism
    pieces: tuple[Pieces, ...]
    passages: tuple[Passage, ...] = ()

    def changed(self, **fields: Callable[[Array], Array]) -> HandMade:
        """The record with fields of its pieces changed."""

        def new(pieces: Pieces) -> Pieces:
            return replace(pieces, **{name: change(getattr(pieces, name)) for name, change in fields.items()})

        passages = (replace(item, before=new(item.before), after=new(item.after)) for item in self.passages)
        return HandMade(self.mechanism, tuple(map(new, self.pieces)), tuple(passages))

    def of(self, **parts: Any) -> HandMade:
        """The same record, of a mechanism with other parts."""
        return replace(self, mechanism=replace(self.mechanism, **parts))

    def residuals(self) -> LawResiduals:
        """Remainders of the laws."""
        scene, residuals, fastest = LawScene(self.mechanism, 1.0, 3.0), LawResiduals(rate=3.0), dict[str, float]()
        for number, pieces in enumerate(self.pieces):
            laws_of_pieces(scene, pieces, residuals)
            if number < len(self.passages):
                transition(scene, self.passages[number], residuals, fastest)
        return residuals

    def broken(self) -> tuple[str, str]:
        """Law and part of the first violation; empty texts: there is none."""
        violation = self.residuals().first
        return ("", "") if violation is None else (violation.law, violation.part)


def without_contacts(mechanism: Mechanism, time: Array, **known: Any) -> Pieces:
    """Pieces of a motion whose joints neither rub nor stop; what is not known is zero, and no contact is closed."""
    joints = len(mechanism.joints)
    modes = known.pop("modes", Modes((), (), (), ("open",) * joints, (("open", "open"),) * joints))
    return stated(mechanism, modes, time, **known)


def point(pieces: Pieces, number: int) -> Pieces:
    """First or last point as a piece of one point; ``number``: 0 or -1."""
    part = slice(number, number + 1 or None)
    arrays = {name: value[part, part] for name, value in vars(pieces).items() if isinstance(value, np.ndarray)}
    return replace(pieces, **arrays)


def times(start: float, end: float, count: int = 3) -> tuple[Array, Array]:
    """Times of the points of some pieces, and their paces [s]."""
    edges = np.linspace(start, end, count + 1)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    return middle + half * POINTS, np.broadcast_to(half, (count, len(POINTS))).copy()


def with_world(values: Any, still: Any = (0.0, 0.0, 0.0)) -> Array:
    """Values of one body, and those of the world, (pieces, points, 2, …)."""
    values = np.asarray(values, float)
    return np.stack([values, np.broadcast_to(np.asarray(still, float), values.shape)], 2)


def about(axis: int, angle: Array) -> Array:
    """Rotations about an axis of the world."""
    c, s, (i, j) = np.cos(angle), np.sin(angle), ((axis + 1) % 3, (axis + 2) % 3)
    R = np.zeros((*angle.shape, 3, 3))
    R[..., axis, axis] = 1.0
    R[..., i, i], R[..., j, j], R[..., i, j], R[..., j, i] = c, c, -s, s
    return R


def poses(p: Any, v: Any, R: Any, w: Any) -> dict[str, Array]:
    """Poses and velocities of one body and the world, by their names in a record."""
    return {"p": with_world(p), "v": with_world(v), "R": with_world(R, np.eye(3)), "w": with_world(w)}


def free_body() -> HandMade:
    """A body thrown upwards that turns about its third principal axis, its origin beside its centre of mass."""
    body = Body("stone", 2.0, com=(0.0, 0.0, 0.3), inertia=(0.1, 0.2, 0.25))
    time, pace = times(0.0, 0.3)
    height, speed = 1.0 + 4.0 * time - GRAVITY / 2 * time**2, 4.0 - GRAVITY * time
    p = np.stack([2.0 * time, 0 * time, height - 0.3], -1)
    v = np.stack([2.0 + 0 * time, 0 * time, speed], -1)
    w = np.stack([0 * time, 0 * time, 5.0 + 0 * time], -1)
    mechanism = Mechanism((body,), (Joint("flight", "free", "world", "stone"),))
    pieces = without_contacts(mechanism, time, pace=pace, **poses(p, v, about(2, 5.0 * time), w))
    return HandMade(mechanism, (pieces,))


def pendulum() -> HandMade:
    """A body on a revolute joint about y, driven by an actuator that cancels gravity: it turns at a constant rate."""
    from proofroll.elements.mechanism.scene.drives import Actuator
    from proofroll.elements.mechanism.scene.signal import Formula

    rate, mass, arm = 2.0, 1.5, 0.4
    body = Body("bob", mass, com=(0.0, 0.0, -arm), inertia=(0.02, 0.02, 0.01))
    torque = f"{mass * GRAVITY * arm} * sin({rate} * t)"
    motor = Actuator("motor", "pivot", "torque", target=Formula(torque))
    joint = Joint("pivot", "revolute", "world", "bob", axis=(0.0, 1.0, 0.0), position=(0.0, 0.0, 1.0), v0=(rate,))
    mechanism = Mechanism((body,), (joint,), actuators=(motor,))
    time, pace = times(0.0, 0.6)
    p, none = np.broadcast_to([0.0, 0.0, 1.0], (*time.shape, 3)), np.zeros((*time.shape, 3))
    w = none + np.array([0.0, rate, 0.0])
    effort = (mass * GRAVITY * arm * np.sin(rate * time))[..., None]
    pieces = without_contacts(mechanism, time, pace=pace, effort=effort, **poses(p, none, about(1, rate * time), w))
    return HandMade(mechanism, (pieces,))


def floor_under(kind: str, **pair: float) -> Mechanism:
    """A body of 2 kg, a ball of 0.1 m or a box on one corner's place, that moves above a floor."""
    body = Body("ball", 2.0, inertia=(0.05, 0.05, 0.05))
    geometries = Geometry("skin", "ball", "sphere", radius=0.1), Geometry("floor", "world", "plane")
    law = {"friction": 0.0} | pair
    return Mechanism(
        (body,),
        (Joint("flight", kind, "world", "ball"),),  # type: ignore[arg-type]  # a kind of joint
        geometries=geometries,
        pairs=(Pair("contact", ("skin", "floor"), **law),),
    )


def touching(mode: str, count: int = 1) -> Modes:
    """Modes of contacts of a body on one joint."""
    return Modes((mode,) * count, ("open",) * count, ("open",) * count, ("open",), (("open", "open"),))


def contact(time: Array, force: Any, place: Any, count: int = 1) -> dict[str, Any]:
    """Fields of contacts with a floor at one place."""
    none = np.zeros((*time.shape, count, 3))
    return {
        "force": none + np.asarray(force, float)[..., None, :],
        "place": none + np.asarray(place, float)[..., None, :],
        "normal": none + np.array([0.0, 0.0, 1.0]),
        "rolling": none.copy(),
        "spinning": none.copy(),
    }


def sliding(until: float = 0.2) -> HandMade:
    """A ball that slides on a floor with friction 0.2 from 2 m/s while friction makes it turn, and on as it reverses.

    It would roll from 0.728 s on.
    """
    mu, mass, radius, inertia = 0.2, 2.0, 0.1, 0.05
    mechanism = floor_under("free", friction=mu)
    time, pace = times(0.0, until)
    x, speed = 2.0 * time - mu * GRAVITY / 2 * time**2, 2.0 - mu * GRAVITY * time
    turning = mu * mass * GRAVITY * radius / inertia
    none, upright = 0 * time, radius + 0 * time
    p, v = np.stack([x, none, upright], -1), np.stack([speed, none, none], -1)
    R, w = about(1, turning / 2 * time**2), np.stack([none, turning * time, none], -1)
    rubbing = -mu * mass * GRAVITY * np.sign(speed - radius * turning * time)
    force = np.stack([rubbing, none, none + mass * GRAVITY], -1)
    fields = contact(time, force, np.stack([x, none, none], -1)) | poses(p, v, R, w)
    pieces = without_contacts(mechanism, time, pace=pace, **fields, modes=touching("slip"))
    return HandMade(mechanism, (pieces,))


def bounce(restitution: float = 0.5, speed: float = 0.0, kinetic: float = 0.2, count: int = 1) -> HandMade:
    """A ball that falls by 0.2 m on a floor and rises with half its speed; it may slide as it strikes.

    ``count``: of skins of the ball, which strike together.
    """
    mechanism, drop, radius = floor_under("free", friction=0.2, static_friction=0.5, restitution=0.5), 0.2, 0.1
    mass, inertia = mechanism.bodies[0].mass, mechanism.bodies[0].inertia[1][1]
    if count > 1:
        (skin, floor), (pair,) = mechanism.geometries, mechanism.pairs
        more = [replace(skin, name=f"skin{k}") for k in range(1, count)]
        pairs = [replace(pair, name=f"contact{k}", geometries=(f"skin{k}", "floor")) for k in range(1, count)]
        mechanism = replace(mechanism, geometries=(skin, floor, *more), pairs=(pair, *pairs))
    landing = np.sqrt(2 * drop / GRAVITY)
    impact = GRAVITY * landing
    lost = kinetic * (1 + restitution) * impact if speed else 0.0  # of the speed along the floor
    pieces = []
    for start, end in ((0.0, landing), (landing, landing + 0.05)):
        time, pace = times(start, end)
        past, none = time - start, 0 * time
        level, rises, slides, turns = (drop, 0.0, speed, 0.0)
        if start:
            level, rises, slides, turns = 0.0, restitution * impact, speed - lost, radius * mass * lost / inertia
        height, x = level + rises * past - GRAVITY / 2 * past**2 + radius, speed * start + slides * past
        p, v = np.stack([x, none, height], -1), np.stack([none + slides, none, rises - GRAVITY * past], -1)
        w = np.stack([none, none + turns, none], -1)
        fields = contact(time, 0 * p, np.stack([x, none, none], -1), count) | poses(p, v, about(1, turns * past), w)
        pieces.append(without_contacts(mechanism, time, pace=pace, **fields, modes=touching("open", count)))
    names = frozenset(each.name for each in mechanism.pairs)
    passage = Passage(point(pieces[0], -1), point(pieces[1], 0), impacts=names)
    return HandMade(mechanism, tuple(pieces), (passage,))
