"""Cylinders that land or stand on an end: the end is held at four points of its rim, as a box at its corners.

While an end stays flat its motion and the sum of its forces are those of any points that surround the load. One corner
lies where the end slides to, or where gravity pulls it, so that the load leaves the square where it leaves the rim.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from proofroll.core.errors import NotUnique
from proofroll.elements.mechanism import Mechanism, Tree
from proofroll.elements.mechanism.contact.modes import ContactMode, closed_in, slip_velocity
from proofroll.elements.mechanism.contact.start import TOUCHING, natural_scale, touches
from proofroll.elements.mechanism.contact.touching import Touching
from proofroll.elements.mechanism.scene.rotations import Array, cross, to_rpy
from proofroll.elements.mechanism.scene.shapes.geometry import Geometry, Pair, contact_sums, shared_pairs, turned_bodies
from proofroll.truth.error_bars import TwoRouteMotion

_CORNERS = 8  # of a box; those of one end are every other one


@dataclass(frozen=True)
class Face:
    """Contacts at the rim of one end of a cylinder, and the name of its pair."""

    contacts: tuple[int, ...]
    pair: str


class RollingLanding(Exception):  # noqa: N818 -- no error: the cylinder is followed by its rims then
    """A cylinder lands on its rim, not on its whole end: corners do not stand for it."""


@dataclass(frozen=True)
class StandingEnds:
    """Mechanism whose cylinders touch planes by corners, and the contacts that these stand for.

    Attributes:
        mechanism: with a box in place of each such cylinder, for its planes alone.
        faces: contacts of each end.
        parts: numbers of the contacts that replace each contact of the mechanism with cylinders.
        names: of those contacts, and of what they replace.
    """

    mechanism: Mechanism
    faces: tuple[Face, ...]
    parts: tuple[tuple[int, ...], ...]
    names: dict[str, str]

    def folded(self, motion: TwoRouteMotion) -> TwoRouteMotion:
        """Motion with the contacts of the mechanism with cylinders: forces of an end are the sum over its corners."""
        assert motion.pressed is not None  # of a mechanism with contacts
        assert motion.sums is not None
        bars = dict(motion.bars)
        bars["pressed"] = bars["sums"] + _CORNERS / 2 * bars["pressed"]
        pressed, sums = self._of_ends(motion.pressed, motion.sums)
        between = motion.between
        if between is not None and between.pressed is not None and between.sums is not None:
            borne, summed = self._of_ends(between.pressed, between.sums)
            between = between._replace(pressed=borne, sums=summed)
        return replace(
            motion,
            bars=bars,
            tiles=None if motion.tiles is None else motion.tiles.of_contacts(self.parts),
            between=between,
            pressed=pressed,
            sums=sums,
            events=self._once(motion.events),
            bounces=self._once(motion.bounces),
            reason=self._told(motion.reason),
            ended=self._told(motion.ended),
        )

    def _of_ends(self, pressed: Array, sums: Array) -> tuple[Array, Array]:
        """Forces and moments of contacts, and sums of the forces, with those of ends for those of corners."""
        contacts, of_ends = self.mechanism.contacts, list[Array]()
        order, count = list(shared_pairs(contacts)), len(contact_sums(contacts))
        for part in self.parts:
            borne = pressed[:, list(part)].sum(axis=1)
            if len(part) > 1:
                pair = contacts[part[0]].pair
                others = [k for k in shared_pairs(contacts)[pair] if k not in part]
                rest = sums[:, order.index(pair)] - pressed[:, others, :3].sum(axis=1)
                borne[:, :3] = np.where(np.isnan(borne[:, :3]), rest, borne[:, :3])
            of_ends.append(borne)
        corners = [contacts[k] for part in self.parts if len(part) > 1 for k in part]
        stands = {body for contact in corners for body in (contact.body_a, contact.body_b)}
        kept = [count + k for k, body in enumerate(turned_bodies(contacts)) if body not in stands]
        return np.stack(of_ends, axis=1), sums[:, [*range(count), *kept]]

    def _once(self, items: Sequence[Any]) -> tuple[Any, ...]:
        """Events or bounces by the names of ends, one of those of all corners of an end."""
        items_by_key: dict[tuple[Any, ...], Any] = {}
        for item in items:
            name = self.names.get(item.name, item.name)
            items_by_key.setdefault((getattr(item, "kind", ""), name, item.time), replace(item, name=name))
        return tuple(items_by_key.values())

    def _told(self, text: str) -> str:
        """Sentence with the names of ends, each once in a list."""
        name = "(?:" + "|".join(map(re.escape, self.names)) + r")(?!\d)"

        def ends(listed: re.Match[str]) -> str:
            return " and ".join(dict.fromkeys(self.names[ball] for ball in re.findall(name, listed[0])))

        return re.sub(rf"{name}(?:(?:, | and ){name})*", ends, text)


def standing_ends(mechanism: Mechanism) -> StandingEnds | None:
    """Mechanism with corners for cylinders that start parallel to a plane and do not tilt; None: it has none."""
    shapes = {geometry.name: geometry for geometry in mechanism.geometries}
    kinds = [{shapes[name].kind for name in pair.geometries} for pair in mechanism.pairs]
    if {"cylinder", "plane"} not in kinds:
        return None
    motion = Tree(mechanism).at(*mechanism.start())
    touching, index, least_speed = (
        touches(mechanism, motion),
        mechanism.body_index,
        TOUCHING * natural_scale(mechanism).rate,
    )
    added, pairs, cornered = list[Geometry](), list[Pair](), set[str]()
    for pair, kind in zip(mechanism.pairs, kinds, strict=True):
        pairs.append(pair)
        if kind != {"cylinder", "plane"}:
            continue
        solid, plane = sorted((shapes[name] for name in pair.geometries), key=lambda shape: shape.kind)
        body = index[solid.body]
        touches_of_pair = [
            touch for touch, contact in zip(touching, mechanism.contacts, strict=True) if contact.pair == pair.name
        ]
        turning = cross(motion.w_WB[body] - motion.w_WB[index[plane.body]], touches_of_pair[0].normal)
        if not all(touch.flat for touch in touches_of_pair) or np.abs(turning).max() > least_speed:
            continue
        slip = slip_velocity(touches_of_pair[0])
        pull = slip if np.linalg.norm(slip) > least_speed else np.array(mechanism.gravity)
        box = _box(solid, motion.R_WB[body].T @ pull, {*shapes, *(touch.name for touch in added)})
        added.append(box)
        name_a, name_b = (box.name if name == solid.name else name for name in pair.geometries)
        pairs[-1] = replace(pair, geometries=(name_a, name_b))
        cornered.add(pair.name)
    if not cornered:
        return None
    with_corners = replace(mechanism, geometries=(*mechanism.geometries, *added), pairs=tuple(pairs))
    parts, names, faces, place = list[tuple[int, ...]](), dict[str, str](), list[Face](), 0
    for contact in mechanism.contacts:
        if contact.pair not in cornered:
            parts.append((place,))
            place += 1
            continue
        second = contact.name.endswith(".2")
        number = place - _CORNERS if second else place
        parts.append(tuple(range(number + second, number + _CORNERS, 2)))
        names |= {with_corners.contacts[k].name: contact.name for k in parts[-1]}
        faces.append(Face(parts[-1], contact.pair))
        place = number + _CORNERS
    return StandingEnds(with_corners, tuple(faces), tuple(parts), names)


def _box(solid: Geometry, pull: Array, names: set[str]) -> Geometry:
    """Box with its corners on both rims of a cylinder, one of them in the direction of a pull in the body's frame."""
    name = f"{solid.name}_ends"
    while name in names:
        name += "_"
    across = solid.frame[:, :2].T @ pull
    angle = float(np.arctan2(across[1], across[0])) - np.pi / 4
    c, s = np.cos(angle), np.sin(angle)
    frame = solid.frame @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    side = np.sqrt(2) * (solid.radius or 0.0)
    return Geometry(
        name=name,
        body=solid.body,
        kind="box",
        position=solid.position,
        orientation=to_rpy(frame),
        size=(side, side, solid.length or 0.0),
    )


def check_faces(faces: Sequence[Face], old_mode: ContactMode, new_mode: ContactMode, time: float) -> None:
    """Refuses what an end of a cylinder does when only some of its corners are closed; ``old_mode``: the last mode.

    Raises:
        NotUnique: the cylinder begins to tip.
        RollingLanding: the cylinder lands on its rim.
    """
    was_closed, closed_mask = closed_in(old_mode), closed_in(new_mode)
    for face in faces:
        shut = [closed_mask[k] for k in face.contacts]
        if not any(shut) or all(shut):
            continue
        if not any(was_closed[k] for k in face.contacts):
            raise RollingLanding(f"a cylinder of {face.pair} lands on its rim at t = {time:.6g} s")
        raise NotUnique(
            f"a cylinder of {face.pair} does not stand on its whole end from t = {time:.6g} s on: it tips, or its load "
            "lies within 0.3 radii of its rim, which is not followed; end before"
        )


def check_spin(
    faces: Sequence[Face],
    closed_mask: Sequence[bool],
    touching: Sequence[Touching],
    friction: Sequence[float],
    time: float,
) -> None:
    """Refuses an end that spins on its plane with friction, whose moment depends on where along it the load acts.

    Args:
        faces: ends of cylinders.
        closed_mask: True for each contact that is closed, or hit.
        touching: contacts at that instant.
        friction: coefficients of all contacts.
        time: for messages [s].

    Raises:
        NotUnique: friction resists the spin of an end.
    """
    for face in faces:
        contact = face.contacts[0]
        slips = np.array([slip_velocity(touching[k]) for k in face.contacts])
        if closed_mask[contact] and friction[contact] and np.ptp(slips, axis=0).max() > TOUCHING:
            raise NotUnique(
                f"a cylinder of {face.pair} spins on its end at t = {time:.6g} s: the moment of its friction depends "
                "on where along the end the load acts, which is not determinate; end before"
            )
