"""Laws of contact: surfaces, gaps, pull, friction of what sticks and slips, moments against rolling and spin."""

from typing import NamedTuple

import numpy as np

from proofroll.truth.check.laws.integrals import along, cross, dot, norm, turned, turned_back
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import SPREAD, Array, BodyPoses, Pieces
from proofroll.truth.check.laws.residuals import ROUND, LawResiduals
from proofroll.truth.check.laws.scene import LawScene, velocity_at
from proofroll.truth.check.laws.surfaces import PairContact, gap, lowest, near, seen_from

_KNOWN = 1e-3  # rad, error of the direction of a slip from which on its law says nothing
_DIRECTION = 3.0  # errors of that direction that are allowed
_LEAST = float(np.finfo(float).tiny)


class ClosedContact(NamedTuple):
    """A closed contact at the points of pieces: slide, its part in the surface, normal force, friction, sizes."""

    number: int
    contact: PairContact
    slide: Array
    slip: Array
    normal_force: Array
    friction: Array
    fast: Array


def gap_of(contact: PairContact, pieces: BodyPoses) -> Array:
    """Gap of a contact from poses alone [m]; of one of several places of two solids that of the solids."""
    A, B = ((pieces.p[..., body, :], pieces.R[..., body, :, :]) for body in (contact.a, contact.b))
    return gap(contact.shape_a, contact.shape_b, A, B)


def apart(scene: LawScene, contact: PairContact, pieces: BodyPoses, residuals: LawResiduals) -> None:
    """No body passes into another."""
    far = scene.length + np.abs(pieces.p[..., [contact.a, contact.b], :]).max((-1, -2))
    residuals.note("gap", contact.name, np.maximum(-gap_of(contact, pieces), 0), far, pieces.time)


def slide_of(contact: PairContact, pieces: BodyPoses, place: Array) -> Array:
    """Velocity of the first body against the second at places [m/s]."""
    return velocity_at(pieces, contact.a, place) - velocity_at(pieces, contact.b, place)


def slip_of(contact: PairContact, pieces: BodyPoses) -> Array:
    """Slip of a ball on another shape, or of a shape on a plane, by poses alone [m/s]."""
    shape, other, body, base = contact.shape_a, contact.shape_b, contact.a, contact.b
    if shape.kind == "plane" or (other.kind != "plane" and shape.kind != "sphere"):
        shape, other, body, base = other, shape, base, body
    pose, (p, R) = (
        (pieces.p[..., base, :], pieces.R[..., base, :, :]),
        (pieces.p[..., body, :], pieces.R[..., body, :, :]),
    )
    normal = turned(pose[1], near(other, seen_from(pose, p + turned(R, shape.centre)))[1])
    slide = slide_of(contact, pieces, p + turned(R, lowest(shape, turned_back(R, normal))))
    return np.asarray(slide - dot(slide, normal)[..., None] * normal)


def contact_laws(scene: LawScene, pieces: Pieces, residuals: LawResiduals, loads: BodyLoads) -> None:
    """Checks all contacts, and adds their forces and moments to the loads."""
    if not scene.contacts:
        return
    largest = np.nan_to_num(norm(pieces.force)).max(-1) + scene.faint
    passed = set[str]()
    for k, contact in enumerate(scene.contacts):
        if contact.alone or contact.pair.name not in passed:
            passed.add(contact.pair.name)
            apart(scene, contact, pieces, residuals)
        if pieces.modes.contacts[k] == "open":
            residuals.note("pull", contact.name, norm(pieces.force[..., k, :]), largest, pieces.time)
            continue
        if pieces.modes.contacts[k] == SPREAD:
            loads.works(np.full(pieces.time.shape, np.nan), np.zeros(pieces.time.shape))
            continue
        touch = _touch(scene, pieces, k, contact)
        force, place = pieces.force[..., k, :], pieces.place[..., k, :]
        loads.between(contact.a, contact.b, place, force)
        loads.works(dot(force, touch.slide), norm(force) * scene.speed)
        _surfaces(scene, pieces, residuals, touch)
        _slips(pieces, residuals, touch, largest)
        _presses(pieces, residuals, touch, largest)
        _turning(scene, pieces, residuals, loads, (touch, largest))


def _touch(scene: LawScene, pieces: Pieces, k: int, contact: PairContact) -> ClosedContact:
    normal, force = pieces.normal[..., k, :], pieces.force[..., k, :]
    slide, pressed = slide_of(contact, pieces, pieces.place[..., k, :]), along(force, normal)
    ends = contact.a, contact.b
    fast = scene.speed + sum(norm(pieces.v[..., body, :]) for body in ends)
    fast = fast + sum(norm(pieces.w[..., body, :]) for body in ends) * scene.length
    return ClosedContact(
        number=k,
        contact=contact,
        slide=slide,
        slip=slide - dot(normal, slide)[..., None] * normal,
        normal_force=pressed,
        friction=force - pressed[..., None] * normal,
        fast=np.asarray(fast),
    )


def _surfaces(scene: LawScene, pieces: Pieces, residuals: LawResiduals, touch: ClosedContact) -> None:
    """The force acts on both surfaces, the normal is theirs, and they neither part nor approach."""
    k, contact, time = touch.number, touch.contact, pieces.time
    place, normal = pieces.place[..., k, :], pieces.normal[..., k, :]
    far = scene.length + norm(place)
    for shape, solid, body, sign in (
        (contact.shape_a, contact.solid_a, contact.a, -1.0),
        (contact.shape_b, contact.solid_b, contact.b, 1.0),
    ):
        pose = pieces.p[..., body, :], pieces.R[..., body, :, :]
        seen = seen_from(pose, place)
        distance, gradient = near(shape, seen)
        residuals.note("surface", contact.name, distance, far, time)
        if shape is not solid:
            residuals.note("surface", contact.name, near(solid, seen)[0], far, time)
        apart = norm(gradient - sign * seen_from((0 * place, pose[1]), normal))
        digits = ROUND * residuals.coarse * far * shape.bend
        residuals.note("normal", contact.name, np.where(np.isnan(apart), 0.0, apart), 1.0, time, digits)
    residuals.note("gap rate", contact.name, dot(normal, touch.slide), touch.fast, time)


def _slips(pieces: Pieces, residuals: LawResiduals, touch: ClosedContact, largest: Array) -> None:
    """A contact that sticks does not slip; friction of a slip opposes it with mu N."""
    speed, contact, time = norm(touch.slip), touch.contact, pieces.time
    if pieces.modes.contacts[touch.number] == "stick":
        residuals.note("stick", contact.name, speed, touch.fast, time)
        return
    friction = contact.pair.friction
    if not np.isfinite(friction):
        residuals.note("slip", contact.name, speed, touch.fast, time)
        return
    direction = touch.slip / np.maximum(speed, _LEAST)[..., None]
    noise = ROUND * residuals.coarse * touch.fast
    error = noise / np.maximum(speed, noise + _LEAST)  # of the direction [rad], at most 1
    left = norm(touch.friction + (friction * touch.normal_force)[..., None] * direction)
    size = norm(touch.friction) - friction * touch.normal_force  # without a direction its size is left
    residuals.note(
        "slip",
        contact.name,
        np.where(error < _KNOWN, left, size),
        largest,
        time,
        _DIRECTION * error * friction * largest,
    )


def _presses(pieces: Pieces, residuals: LawResiduals, touch: ClosedContact, largest: Array) -> None:
    """A contact presses, and one that sticks has its friction within the bound."""
    contact, pressed = touch.contact, np.maximum(touch.normal_force, 0)
    residuals.note("pull", contact.name, np.maximum(-touch.normal_force, 0), largest, pieces.time)
    if pieces.modes.contacts[touch.number] == "stick" and np.isfinite(contact.pair.static):
        excess = np.maximum(norm(touch.friction) - contact.pair.static * pressed, 0)
        residuals.note("cone", contact.name, excess, largest, pieces.time)


def rolling_of(contact: PairContact, pieces: Pieces, k: int, relative: Array) -> Array:
    """Rolling that resistance opposes [rad/s]: of the ``relative`` angular velocity, or as a ball's centre moves."""
    normal = pieces.normal[..., k, :]
    if contact.pair.against == "turning":
        return relative - dot(normal, relative)[..., None] * normal
    a_is_ball = contact.solid_a.kind == "sphere"
    ball, body = (contact.solid_a, contact.a) if a_is_ball else (contact.solid_b, contact.b)
    centre = pieces.p[..., body, :] + turned(pieces.R[..., body, :, :], ball.centre)
    sign = 1.0 if a_is_ball else -1.0
    return np.asarray(cross(normal, slide_of(contact, pieces, centre)) * (sign / ball.radius))


def _turning(
    scene: LawScene, pieces: Pieces, residuals: LawResiduals, loads: BodyLoads, closed: tuple[ClosedContact, Array]
) -> None:
    """Moments against rolling and spin of a closed contact: within coefficient times N, or opposed to what turns."""
    touch, largest = closed
    k, contact, time = touch.number, touch.contact, pieces.time
    a, b = contact.a, contact.b
    normal, relative = pieces.normal[..., k, :], pieces.w[..., a, :] - pieces.w[..., b, :]
    spin = dot(normal, relative)[..., None] * normal
    quick = scene.rate + norm(pieces.w[..., a, :]) + norm(pieces.w[..., b, :])
    rolling = rolling_of(contact, pieces, k, relative)
    for size, part, moments, modes in (
        (contact.pair.rolling_resistance, rolling, pieces.rolling, pieces.modes.rolling),
        (contact.pair.spinning_friction, spin, pieces.spinning, pieces.modes.spinning),
    ):
        if not size:
            continue
        moment, rate, bound = moments[..., k, :], norm(part), size * largest
        pressed = size * np.maximum(touch.normal_force, 0)
        loads.between(a, b, pieces.place[..., k, :], 0 * moment, moment)
        loads.works(dot(moment, relative), norm(moment) * scene.rate)
        if modes[k] != "slip":  # open: joints exclude the turn
            most = pressed if modes[k] == "stick" else 0 * pressed
            residuals.note("turning", contact.name, np.maximum(norm(moment) - most, 0), bound, time)
            residuals.note("stick", contact.name, rate, quick, time)
            continue
        noise = ROUND * residuals.coarse * quick
        error = noise / np.maximum(rate, noise + _LEAST)
        direction = part / np.maximum(rate, _LEAST)[..., None]
        left = np.where(error < _KNOWN, norm(moment + pressed[..., None] * direction), norm(moment) - pressed)
        residuals.note("turning", contact.name, left, bound, time, _DIRECTION * error * bound)
