"""Sides of the kinks of laws on which a motion goes on from a state."""

from collections.abc import Callable, Sequence

import numpy as np

from proofroll.core.arrays import uneven
from proofroll.core.errors import Refused
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.scene.kinks import held_sides
from proofroll.elements.mechanism.scene.prescribed import moved
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.elements.mechanism.scene.signal import FUNCTIONS, Formula
from proofroll.truth.followed_paths import TOLERANCES

# Steps [natural time] in which the way away from a kink is looked for: the shortest that is no round-off decides.
_AHEAD = (1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2)
# Growth of an argument when the step doubles, of one that grows as a power from 1 to 6 of the time, and the largest
# ratio of two such growths.
_LEAST, _MOST, _ALIKE = 1.5, 80.0, 2.0
_TRIALS = 8
_JOLT = 1e-9  # jump of a prescribed rate that is no round-off of the time of its kink, in natural units
_DIGITS = 10 * TOLERANCES[1]  # change of a state by the error of a step, relative to the size of the mechanism


def sides_ahead(
    state: Array, kinks: Callable[[Array], Array], rates: Callable[[Array, tuple[int, ...]], Array]
) -> tuple[int, ...]:
    """Side of each kink, 1 or -1, on which a motion goes on from a state; 1 of a kink that it does not leave.

    Args:
        state: at or apart from kinks.
        kinks: state -> arguments of the kinks.
        rates: state and sides -> rates with these sides, in natural units.

    Raises:
        Refused: with each side the motion leads to the other one.
    """
    start = kinks(state)
    sides = tuple(np.where(start < 0, -1, 1).tolist())
    for _ in range(_TRIALS):
        decided = tuple(_decided(state, start, sides, kinks, rates))
        if decided == sides:
            return sides
        sides = decided
    raise Refused(
        f"a law jumps against the motion on both sides of its kink at t = {state[-1]:.6g} s and would have to hold, as "
        "dry friction does; give a joint the friction"
    )


def refuse_jolts(mechanism: Mechanism, time: float, sides_before: Sequence[int], sides_after: Sequence[int]) -> None:
    """Refuses a motion whose prescribed rate jumps at a time [s], where kinks change their sides.

    Raises:
        Refused: the rate jumps by more than round-off.
    """
    for joint, _, _ in mechanism.prescribed:
        if isinstance(joint.motion, Formula) and joint.motion.kinks:
            rates = [
                float(moved(joint.motion, time, held_sides(mechanism.kinks, sides, FUNCTIONS)).rate)
                for sides in (sides_before, sides_after)
            ]
            if abs(rates[1] - rates[0]) > _JOLT * max(1.0, *map(abs, rates)):
                raise Refused(
                    f"joints.{joint.name}.motion {joint.motion} jumps in its rate at t = {time:.6g} s, which takes an "
                    "infinite force"
                )


def _decided(
    state: Array,
    start: Array,
    sides: tuple[int, ...],
    kinks: Callable[[Array], Array],
    rates: Callable[[Array, tuple[int, ...]], Array],
) -> list[int]:
    """Sides to which a motion with some sides leads."""
    decided = list(sides)
    near = list(range(len(sides)))
    for step in _AHEAD:
        after_one = kinks(_stepped(state, step, sides, rates)) - start
        if step == _AHEAD[0]:
            near = [k for k in near if not abs(after_one[k]) <= abs(start[k]) / 2 or start[k] == 0.0]
        if not near:
            break
        after_two, after_four = (kinks(_stepped(state, times * step, sides, rates)) - start for times in (2, 4))
        left = [k for k in near if _grows(after_one[k], after_two[k], after_four[k])]
        for k in left:
            decided[k] = int(np.sign(after_four[k]))
        near = [k for k in near if k not in left]
    return decided


def _grows(step_1: float, step_2: float, step_4: float) -> bool:
    """True if values after a step, two and four grow as a power does, which round-off does not."""
    if not step_1 or not step_2:
        return False
    growths = sorted((step_2 / step_1, step_4 / step_2))
    return growths[0] >= _LEAST and growths[1] <= min(_MOST, _ALIKE * growths[0])


def noise_at_start(state: Array, sides: Array, kinks: Callable[[Array], Array], size: float) -> Array:
    """Noise of the guards of kinks in a stretch from a state: of those that it leaves the error of a step, else none.

    Args:
        state: at the start, where a kink has a side by what follows, whatever its own last digits are.
        sides: of the kinks.
        kinks: state -> arguments of the kinks.
        size: largest distance of a body from the origin, in natural units.
    """
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (3, len(state)))
    ways = signs * uneven(len(state)) * np.maximum(np.abs(state), size)
    start = kinks(state)
    noise = np.abs([kinks(state + _DIGITS * way) - start for way in ways]).max(axis=0)
    return np.asarray(np.where(np.abs(start) <= noise, noise, 0.0) + 2 * np.maximum(-sides * start, 0.0))


def _stepped(
    state: Array, step: float, sides: tuple[int, ...], rates: Callable[[Array, tuple[int, ...]], Array]
) -> Array:
    """State after a step of Runge-Kutta 4."""
    k1 = rates(state, sides)
    k2 = rates(state + step / 2 * k1, sides)
    k3 = rates(state + step / 2 * k2, sides)
    k4 = rates(state + step * k3, sides)
    return np.asarray(state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
