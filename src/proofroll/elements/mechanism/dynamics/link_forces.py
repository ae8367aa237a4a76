"""Forces of springs and bushings along a motion, and work of drives: results that follow from the state of the bodies.

The harness evaluates them for truth and engines alike, at the motion that each of them has.
"""

from collections.abc import Callable, Iterator

import numpy as np

from proofroll.core.arrays import FloatArray
from proofroll.core.columns import SAMPLED_BAR
from proofroll.core.observable import Observable, Role
from proofroll.elements.mechanism.dynamics.named_forces import NamedForce, named_forces
from proofroll.elements.mechanism.dynamics.placed import Placed
from proofroll.elements.mechanism.scene.bushing import Bushing
from proofroll.elements.mechanism.scene.model import Mechanism
from proofroll.elements.mechanism.scene.parts import Spring

WORKING = ("effort", "drive")  # fields of named forces whose work is a result
_BUSHINGS = (("bushing_forces", "N", "forces"), ("bushing_torques", "N m", "moments"))


def length_and_rate(placed: Placed, spring: Spring) -> tuple[FloatArray, FloatArray]:
    """Length of a spring [m] and its rate [m/s], shape (time,) each."""
    apart = placed.point(spring.body_b, spring.position_b) - placed.point(spring.body_a, spring.position_a)
    slide = placed.velocity(spring.body_b, spring.position_b) - placed.velocity(spring.body_a, spring.position_a)
    length = np.linalg.norm(apart, axis=-1)
    return length, np.sum(apart * slide, axis=-1) / length


def pull_of(placed: Placed, spring: Spring) -> FloatArray:
    """Pull of a spring by its law, positive if it draws its ends together [N], shape (time,)."""
    length, rate = length_and_rate(placed, spring)
    return np.asarray(spring.pull(length, rate) + np.zeros(len(length)))


def load_of(placed: Placed, bushing: Bushing) -> FloatArray:
    """Force [N] and moment [N m] of a bushing on body_b, at the origin of B, world axes, shape (time, 6)."""
    a, b = (placed.mechanism.body_index[name] for name in (bushing.body_a, bushing.body_b))
    apart = placed.point(bushing.body_b, bushing.position_b) - placed.point(bushing.body_a, bushing.position_a)
    slide = placed.velocity(bushing.body_b, bushing.position_b) - placed.velocity(bushing.body_a, bushing.position_a)
    states = (
        placed.R_WB[:, a],
        placed.R_WB[:, b],
        apart,
        slide,
        placed.spin(bushing.body_a),
        placed.spin(bushing.body_b),
    )
    return np.array([np.concatenate(bushing.load(*state)) for state in zip(*states, strict=True)])


def link_values(placed: Placed) -> FloatArray:
    """Pulls of all springs, then loads of all bushings [N, N m], shape (time, springs + 6 bushings)."""
    pulls = [pull_of(placed, spring)[:, None] for spring in placed.mechanism.springs]
    loads = [load_of(placed, bushing) for bushing in placed.mechanism.bushings]
    return np.concatenate([np.zeros((len(placed.time), 0)), *pulls, *loads], axis=1)


def working(mechanism: Mechanism) -> list[tuple[int, NamedForce]]:
    """Named forces whose work is a result, with their indices."""
    return [(number, item) for number, item in enumerate(named_forces(mechanism)) if item.field in WORKING]


def working_joints(mechanism: Mechanism) -> list[str]:
    """Names of the joints of :func:`working`."""
    joints = {f"effort.{item.name}": item.joint for item in mechanism.actuators}
    return [joints.get(item.name, item.name.removeprefix("drive.")) for _, item in working(mechanism)]


def powers(placed: Placed, named: FloatArray) -> FloatArray:
    """Power of each of :func:`working` [W], shape (time, drives); ``named``: all named forces, shape (time, forces)."""
    drives, rates = working(placed.mechanism), placed.coordinates()
    values = [
        named[:, number] * rates[name][1]
        for (number, _), name in zip(drives, working_joints(placed.mechanism), strict=True)
    ]
    return np.stack(values, axis=1) if values else np.zeros((len(placed.time), 0))


def sampled_works(time: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Work since the first sample [J], (time, drives), and its error by the quadrature, largest over time, (drives).

    Simpson's rule over the samples of an engine, which has nothing between them. The error is the change where every
    other sample is left out; it falls by sixteen where samples are twice as dense and nothing jumps.
    """
    work, change = _integral(time, power), np.zeros(power.shape[1])
    if len(time) > 2 and len(change):
        gap = np.abs(_integral(time[::2], power[::2]) - work[::2])
        change = np.where(np.isnan(gap), 0.0, gap).max(axis=0)
    return work, change


def _integral(time: FloatArray, values: FloatArray) -> FloatArray:
    """Integral since the first sample, as by scipy's ``cumulative_simpson``, whose import takes half a second."""
    steps = np.diff(time)[:, None]
    if len(time) < 3:
        parts = steps * (values[1:] + values[:-1]) / 2
    else:
        parts = np.empty((len(steps), values.shape[1]))
        ahead, back = _first_parts(steps, values), _first_parts(steps[::-1], values[::-1])[::-1]
        parts[:-1:2], parts[1::2], parts[-1] = ahead[::2], back[::2], back[-1]
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(parts, axis=0)])


def _first_parts(steps: FloatArray, values: FloatArray) -> FloatArray:
    """Integral over the first of each two intervals, of the parabola through their three samples."""
    first, second = steps[:-1], steps[1:]
    share = first / (first + second)
    bend = share * (first / second)
    return np.asarray(first / 6 * ((3 - share) * values[:-2] + (3 + bend + share) * values[1:-1] - bend * values[2:]))


def put_links(
    placed: Placed, named: FloatArray, put: Callable[..., None], unsaid: str, work: FloatArray | None = None
) -> None:
    """Puts forces of springs and bushings, and work of drives, among the variables of a run.

    Args:
        placed: motion of the bodies.
        named: named forces, shape (time, forces).
        put: takes a variable's name, values, unit, meaning and dimensions.
        unsaid: reason of work that has no value.
        work: of drives [J], shape (time, drives); None: integrated over the samples, with the error of that.
    """
    mechanism, values = placed.mechanism, link_values(placed)
    count = len(mechanism.springs)
    for spring, pull in zip(mechanism.springs, values.T, strict=False):
        put(f"force.{spring.name}", pull, "N", f"pull of {spring.name} by its law, at this motion")
    loads = values[:, count:].reshape(len(placed.time), -1, 2, 3)
    for number, bushing in enumerate(mechanism.bushings):
        for part, (kind, unit) in enumerate((("force", "N"), ("torque", "N m"))):
            for axis, letter in enumerate("xyz"):
                meaning = f"{kind} of {bushing.name} on {bushing.body_b} by its law, at this motion"
                put(f"{kind}.{bushing.name}.{letter}", loads[:, number, part, axis], unit, meaning)
    for part, (name, unit, what) in enumerate(_BUSHINGS if mechanism.bushings else ()):
        put(name, loads[:, :, part], unit, f"{what} of bushings by their laws", "bushing", "xyz")
    drives, errors = working(mechanism), np.zeros(0)
    if work is None:
        work, errors = sampled_works(placed.time, powers(placed, named))
    for k, (_, item) in enumerate(drives):
        absent = unsaid if np.isnan(work[-1, k]) else ""
        error = {SAMPLED_BAR: float(errors[k])} if len(errors) else {}
        put(f"work.{item.name}", work[:, k], "J", f"work of {item.name}", absent=absent, **error)


def link_observables(mechanism: Mechanism, floors: dict[str, float]) -> Iterator[Observable]:
    """Observables of forces of springs and bushings and of work of drives; ``floors``: of an observable, by unit."""
    for spring in mechanism.springs:
        yield Observable(f"force.{spring.name}", "N", f"pull of {spring.name}", Role.REACTION, floor=floors["N"])
    for name, unit, what in _BUSHINGS if mechanism.bushings else ():
        yield Observable(name, unit, f"{what} of bushings on their bodies b", Role.REACTION, floor=floors[unit])
    for _, item in working(mechanism):
        yield Observable(
            f"work.{item.name}", "J", f"work of {item.name}", Role.REACTION, floor=floors["J"], sums_samples=True
        )
