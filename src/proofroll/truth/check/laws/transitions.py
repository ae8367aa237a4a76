"""Laws of transitions: poses go on, a change of mode happens at the zero of its cause, impacts follow Newton's law."""

from collections.abc import Iterator

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.contacts import gap_of, rolling_of, slide_of
from proofroll.truth.check.laws.impacts import impact
from proofroll.truth.check.laws.integrals import dot, norm
from proofroll.truth.check.laws.motion import jump
from proofroll.truth.check.laws.record import Passage, Pieces
from proofroll.truth.check.laws.residuals import STRUCK, LawResiduals
from proofroll.truth.check.laws.scene import LawScene


def transition(
    scene: LawScene, passage: Passage, residuals: LawResiduals, fastest: dict[str, float]
) -> dict[int, float]:
    """Checks a transition; impulse along each driven joint, by its number, if velocities jump [N s, N m s].

    ``fastest``: largest speed of impact of each contact and stop so far, kept up to date.
    """
    pieces_before, pieces_after = passage.before, passage.after
    residuals.coarse, residuals.events = 1.0, residuals.events + 1
    apart = jump(scene, pieces_after, pieces_before, slice(None), slice(None), rates=False)
    residuals.note("joined", "", apart, 1.0, pieces_before.time[:, 0])
    is_struck = bool(jump(scene, pieces_after, pieces_before, slice(None), slice(None))[0] > STRUCK)
    if is_struck:
        return impact(scene, passage, residuals, fastest)
    if not passage.decided:
        return {}
    zeros = [*_of_contacts(scene, pieces_before, pieces_after), *_of_joints(scene, pieces_before, pieces_after)]
    if zeros:
        name, value = min(zeros, key=lambda item: item[1])
        residuals.note("event", name, np.array([[value]]), 1.0, pieces_before.time)
    return {}


def _of_contacts(scene: LawScene, pieces_before: Pieces, pieces_after: Pieces) -> Iterator[tuple[str, float]]:
    """Causes of changes of contacts, each relative to its natural size, just before them."""
    largest = norm(pieces_before.force).max(initial=0.0) + scene.faint
    fast = scene.speed + np.abs(pieces_before.v).max()
    for k, contact in enumerate(scene.contacts):
        mode, later = pieces_before.modes.contacts[k], pieces_after.modes.contacts[k]
        force, normal = pieces_before.force[0, 0, k], pieces_before.normal[0, 0, k]
        pressed = float(normal @ force)
        if mode != later and mode == "open":
            yield contact.name, abs(float(gap_of(contact, pieces_before)[0, 0])) / scene.length
        elif mode != later and later == "open":
            yield contact.name, abs(pressed) / largest
        elif mode != later and later == "stick":
            slide = slide_of(contact, pieces_before, pieces_before.place[..., k, :])[0, 0]
            yield contact.name, float(norm(slide - (normal @ slide) * normal)) / fast
        elif mode != later:
            yield contact.name, _beyond_bound(scene, pieces_before, k) / largest
        pair = contact.pair
        for law, old_mode, new_mode, moment, turning in (
            (
                "roll",
                pieces_before.modes.rolling[k],
                pieces_after.modes.rolling[k],
                pieces_before.rolling[0, 0, k],
                pair.rolling_resistance,
            ),
            (
                "spin",
                pieces_before.modes.spinning[k],
                pieces_after.modes.spinning[k],
                pieces_before.spinning[0, 0, k],
                pair.spinning_friction,
            ),
        ):
            if old_mode == new_mode or "open" in {old_mode, new_mode}:
                continue
            relative = pieces_before.w[..., contact.a, :] - pieces_before.w[..., contact.b, :]
            spin = (normal @ relative[0, 0]) * normal
            part = float(norm(spin if law == "spin" else rolling_of(contact, pieces_before, k, relative)[0, 0]))
            quick = scene.rate + float(np.abs(pieces_before.w).max())
            excess = abs(float(norm(moment)) - turning * pressed) / (turning * largest)
            yield contact.name, part / quick if new_mode == "stick" else excess


def _beyond_bound(scene: LawScene, pieces_before: Pieces, k: int) -> float:
    """Distance of friction from its bound where a contact begins to slip, alone or with all of the same bodies."""
    ends = scene.contacts[k].a, scene.contacts[k].b
    mates = [
        j
        for j, contact in enumerate(scene.contacts)
        if pieces_before.modes.contacts[j] == "stick" and (contact.a, contact.b) == ends
    ]
    force, normal = pieces_before.force[0, 0, mates], pieces_before.normal[0, 0, mates]
    pressed = dot(normal, force)
    friction = force - pressed[:, None] * normal
    bounds = np.array([scene.contacts[j].pair.static for j in mates]) * pressed
    alone = abs(float(norm(friction[mates.index(k)])) - float(bounds[mates.index(k)]))
    return min(alone, abs(float(norm(friction.sum(0))) - float(bounds.sum())))


def _of_joints(scene: LawScene, pieces_before: Pieces, pieces_after: Pieces) -> Iterator[tuple[str, float]]:
    """Causes of changes of stops and dry friction."""
    for number, joint in enumerate(scene.mechanism.joints):
        turns = joint.kind == JointKind.REVOLUTE
        natural = scene.force * (scene.length if turns else 1.0)
        for k, (mode, later) in enumerate(
            zip(pieces_before.modes.stops[number], pieces_after.modes.stops[number], strict=True)
        ):
            if mode != later and later == "open":
                yield joint.name, abs(float(pieces_before.stops[0, 0, number, k])) / natural
            elif mode != later:
                yield joint.name, 0.0  # a joint that closes on its stop without a jump is checked there
        mode, later = pieces_before.modes.friction[number], pieces_after.modes.friction[number]
        if mode == later or "open" in {mode, later}:
            continue
        push = abs(float(pieces_before.friction[0, 0, number]))
        if later == "stick":
            rate = float(scene.free(number, pieces_before)[0].rate[0, 0])
            yield joint.name, abs(rate) / (scene.rate * (1.0 if turns else scene.length))
        else:
            yield joint.name, abs(push - joint.friction) / joint.friction
