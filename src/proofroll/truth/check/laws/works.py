"""Laws of published works: of an effort the integral of its law, and of all drives together the balance of energy."""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism.scene.joint_kinds import JointKind
from proofroll.truth.check.laws.integrals import integral
from proofroll.truth.check.laws.joint_forces import law_of, target_of
from proofroll.truth.check.laws.loads import BodyLoads
from proofroll.truth.check.laws.record import SPREAD, Array, PublishedValues
from proofroll.truth.check.laws.residuals import STRUCK, LawResiduals
from proofroll.truth.check.laws.samples import kinetic_energy
from proofroll.truth.check.laws.scene import LawScene
from proofroll.truth.check.laws.signals import value_of
from proofroll.truth.check.laws.tiled import Turns, changed_velocity
from proofroll.truth.check.laws.tiles import Places, Tiles


def works_follow(
    scene: LawScene, tiles: Tiles, turns: Turns, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Checks works of drives at samples, whose places in tiles are given."""
    names = [name for name in published.values if name.startswith("work.")]
    if not names:
        return
    control, bars = scene.mechanism.control, published.bars
    natural = scene.mass.sum() * scene.speed**2
    for data in scene.mechanism.actuators:
        if control is not None and data.name in control.actuators:
            continue
        number = scene.mechanism.joint_index[data.joint]
        rate = scene.free(number, tiles)[0].rate
        force = law_of(data, value_of(data.target, tiles.time), turns[number, 0], rate)
        work, size = (_summed(values, tiles) for values in (force * rate, np.abs(force * rate)))
        name = f"work.effort.{data.name}"
        _note(
            name, (published.values[name], places.at(work), natural + places.at(size)), published, residuals, bars[name]
        )
    if any({"slip", SPREAD} & {*mode.contacts, *mode.rolling, *mode.spinning} for mode in tiles.modes):
        return
    if (changed_velocity(scene, tiles) > STRUCK).any():
        return
    energy, parts = kinetic_energy(scene, tiles)
    loads = BodyLoads(scene, tiles)
    power, size = loads.power + 0.0, loads.power_size + 0.0
    for number in range(len(scene.mechanism.joints)):
        joint_power = _passive_power(scene, tiles, turns, number)
        power, size = power + joint_power, size + np.abs(joint_power)
    work = energy - energy[0, 0] - _summed(power, tiles)
    sizes = natural + places.at(_summed(size, tiles) + parts) + float(parts[0, 0])
    value = np.sum([published.values[name] for name in names], axis=0)
    _note("all drives", (value, places.at(work), sizes), published, residuals, sum(bars[name] for name in names))


def held_efforts(
    scene: LawScene, tiles: Tiles, turns: Turns, places: Places, published: PublishedValues, residuals: LawResiduals
) -> None:
    """Checks efforts that a controller holds: they follow from the state at the instant at which it sets them."""
    control, natural = scene.mechanism.control, scene.force * scene.length
    if control is None or control.held != "effort" or control.policy is not None:
        return
    first = np.searchsorted(tiles.stretch, tiles.stretch[places.tile])  # tile with which the stretch begins
    for k, data in enumerate(scene.mechanism.actuators):
        if data.name not in control.actuators:
            continue
        number = scene.mechanism.joint_index[data.joint]
        begun, effort = turns[number, 0][first, :1], published.pieces.effort[..., k]
        rates = scene.free(number, tiles)[0].rate[first, :1]
        law = law_of(data, target_of(control, data, published.pieces.time), begun, rates)
        residuals.note("effort", data.name, effort - law, np.abs(effort) + natural, published.pieces.time)


def _note(
    name: str, values: tuple[Array, Array, Array], published: PublishedValues, residuals: LawResiduals, bar: float
) -> None:
    """Takes a published work, that of the laws, and its size [J]."""
    value, work, size = values
    residuals.note("work", name, (value - work)[:, None], size[:, None], published.pieces.time, bar)


def _summed(values: Array, tiles: Tiles) -> Array:
    """Integral since the start at the points of tiles."""
    parts = integral(values, tiles.pace)
    ends = np.concatenate([[0.0], np.cumsum(parts[:, -1])[:-1]])
    return np.asarray(parts + ends[:, None])


def _passive_power(scene: LawScene, tiles: Tiles, turns: Turns, number: int) -> Array:
    """Power of the spring, the damper, the torque and the dry friction of a joint."""
    joint, total = scene.mechanism.joints[number], np.zeros(tiles.time.shape)
    if joint.kind == JointKind.FREE:
        return total
    for k, (_, rate, _) in enumerate(scene.free(number, tiles)):
        force = -joint.damping * rate
        if joint.nq in {1, 2}:
            force = force - joint.stiffness * (turns[number, k] - joint.rest)
        if joint.nq == 1:
            force = force + value_of(joint.torque, tiles.time) - joint.friction * np.sign(rate)
        total = total + force * rate
    return total
