"""Laws of published impacts: energies beside them, restitution by gaps alone, heights that follow, works of drives."""

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from proofroll.truth.check.laws.contacts import gap_of
from proofroll.truth.check.laws.integrals import TO_SERIES
from proofroll.truth.check.laws.motion import Turns, changed_velocity
from proofroll.truth.check.laws.record import Array, PublishedEvent, PublishedValues
from proofroll.truth.check.laws.residuals import STRUCK, LawResiduals
from proofroll.truth.check.laws.samples import NOISE
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.tiles import Tiles
from proofroll.truth.check.laws.values import energy_of

_BESIDE = 1e-13  # time between an event and the border of its stretches, relative to it and to a second
_ROUND = 1e-11  # part of the natural energy and length by which a value beside an impact may be off
_BEGINS: Array = (-1.0) ** np.arange(len(TO_SERIES)) * -(np.arange(len(TO_SERIES)) ** 2) @ TO_SERIES
_ENDS: Array = np.arange(len(TO_SERIES)) ** 2 @ TO_SERIES  # weights of points for the slope at an end


def strikes_follow(
    scene: LawScene, tiles: Tiles, turns: Turns, published: PublishedValues, residuals: LawResiduals, last: float
) -> None:
    """Checks impacts before a ``last`` time [s]: energies, heights, and v+ = -e v- of one that strikes alone."""
    values, bars, changes = published.values, published.bars, published.changes
    events = [(number, item) for number, item in enumerate(changes) if item.strikes and 0 < item.time < last]
    borders = struck_borders(scene, tiles)
    if not (events and borders.size):
        return
    ends, times = tiles.time[borders, -1], np.array([item.time for _, item in events])
    near = np.abs(ends - times[:, None]) <= _BESIDE * (1 + times[:, None])
    events = [event for event, is_near in zip(events, near.any(1), strict=True) if is_near]
    near = near[near.any(1)]
    last_rows, first_rows = borders[near.argmax(1)], borders[near.shape[1] - 1 - near[:, ::-1].argmax(1)] + 1
    numbers = [number for number, _ in events]
    heights = values.get("event_height", np.full(len(changes), np.nan))[numbers]
    for name, chosen, point in (("event_energy_before", last_rows, -1), ("event_energy_after", first_rows, 0)):
        if scene.contacts and chosen.size and name not in values:
            residuals.note("strike", name, np.ones((1, 1)), 1.0, tiles.time[:1, :1])
        elif name in values and chosen.size:
            whole = np.zeros((len(chosen), 1, len(scene.mechanism.joints), 2))
            for (joint, k), coordinates in turns.items():
                whole[:, 0, joint, k] = coordinates[chosen, point]
            moving = tiles.at(np.ix_(chosen, [point]), whole)
            energy, size = energy_of(scene, moving)
            off = values[name][numbers][:, None] - energy
            residuals.note("strike", name, off, size + scene.mass.sum() * scene.speed**2, moving.time, bars[name])
    together = near.sum(0)
    for (_, item), row, sooner, later, height in zip(
        events, near, last_rows.tolist(), first_rows.tolist(), heights, strict=True
    ):
        settled = any(
            change.settles and abs(change.time - item.time) <= _BESIDE * (1 + item.time) for change in changes
        )
        if together[row].max() == 1 and later == sooner + 1 and not settled:
            _restitution(scene, tiles, (sooner, later), item, residuals)
        if np.isfinite(height):
            _height(scene, tiles, later, (item, float(height), bars["event_height"]), residuals)


def struck_borders(scene: LawScene, tiles: Tiles) -> NDArray[np.intp]:
    """Numbers of the tiles after which velocities jump."""
    return np.flatnonzero(changed_velocity(scene, tiles) > STRUCK)


def kicked(scene: LawScene, tiles: Tiles) -> Array:
    """Work of the impulses of driven joints up to each tile [J]; NaN from one on that is not determinate."""
    works = np.zeros(len(tiles.time))
    for time, pulses in tiles.impulses:
        later = int(np.searchsorted(tiles.time[:, 0], time * (1 - _BESIDE)))
        for number, pulse in pulses.items():
            sides = tiles.ordered(np.clip([later - 1, later], 0, len(works) - 1))
            rate = scene.free(number, sides)[0].rate
            mean = (rate[0, -1] + rate[1, 0]) / 2
            works[later:] += pulse * mean if mean else 0.0
    return works


def _restitution(
    scene: LawScene, tiles: Tiles, sides: tuple[int, int], item: PublishedEvent, residuals: LawResiduals
) -> None:
    """The rate of the gap of what struck alone, by the gap in both tiles, or that of its joint turns with its e."""
    beside = tiles.ordered(np.array(sides))
    contact = next((contact for contact in scene.contacts if contact.alone and contact.name == item.name), None)
    if contact is not None:
        distance, restitution = gap_of(contact, beside), contact.pair.restitution
        came, left = (distance[0] @ _ENDS / beside.pace[0, -1], distance[1] @ _BEGINS / beside.pace[1, 0])
        far = scene.length + float(np.abs(beside.p).max())
        residuals.note("event", item.name, distance[:1, -1:] / far, 1.0, beside.time[:1, -1:])
        noise, fast = NOISE * far / (np.ptp(beside.time, axis=1).min() / 2), scene.speed + float(np.abs(beside.v).max())
    elif item.name in scene.mechanism.joint_index:
        number = scene.mechanism.joint_index[item.name]
        axis, restitution = scene.free(number, beside)[0], scene.mechanism.joints[number].restitution
        came, left, noise = axis.rate[0, -1], axis.rate[1, 0], 0.0
        fast = scene.rate * (1.0 if axis.turns else scene.length)
    else:
        return
    residuals.note("rebound", item.name, np.array([[left + restitution * came]]), fast, beside.time[:1, -1:], noise)


def _height(
    scene: LawScene, tiles: Tiles, later: int, published: tuple[PublishedEvent, float, float], residuals: LawResiduals
) -> None:
    """The centre of mass of what bounced has its next apex at the published height above its place at the impact."""
    (item, height, bar), world = published, len(scene.mechanism.bodies)
    body = next(
        (contact.a if contact.a < world else contact.b for contact in scene.contacts if contact.name == item.name),
        world,
    )
    up = -np.array(scene.mechanism.gravity) / np.linalg.norm(scene.mechanism.gravity)
    start = None
    for number in range(later, len(tiles.time) if body < world else later):
        places, rates = (part[0, :, body] @ up for part in scene.centres(tiles.ordered(np.array([number]))))
        start = float(places[0]) if start is None else start
        if rates[0] > 0 >= rates[-1]:
            roots = chebyshev.chebroots(TO_SERIES @ rates)
            inside = np.real(roots[(np.abs(np.imag(roots)) < _ROUND) & (np.abs(np.real(roots)) <= 1 + _ROUND)])
            top = np.max(chebyshev.chebval(inside, TO_SERIES @ places), initial=places[-1])
            off, size = np.array([[top - start - height]]), scene.length + abs(start) + abs(height)
            residuals.note("strike", "event_height", off, size, tiles.time[[number], :1], bar)
            return
