"""Mistakes of bookkeeping between two programs that run one robot under one controller, as changes of its law."""

import itertools
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from proofroll.core.diagnosis.fitting import least_squares_parameter
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.robots.control.bookkeeping.law import SCALED, TERMS, ControlLaw

# Layers of a record, each computed from the ones before; a record shows a mistake at one of them.
LAYERS = {
    "state": "velocities against the rates of places",
    "instants": "times at which the controller acts, from its rate",
    "observation": "from the state",
    "action": "from the observation, by the policy",
    "target": "from the action",
    "effort": "from the target and the state",
    "acceleration": "from the effort, in the air",
    "motion": "from the start, by motions under the controller, in the air",
}


# Two causes that no motion at one step tells apart: (M + h kd) dv is the same either way.
IMPLICIT = (
    "kd acts at the velocity after the step, or explicit kd has an armature of h kd more at each joint: the same "
    "motion at this step h; a second step tells them apart, for an armature stays and h kd does not"
)
_NOTHING = 1e-6  # size that is 0
_ARMATURES = (1e-4, 1e-3, 1e-2, 0.1)  # kg m², where the right one is 0
_STANDARD = 9.81  # m/s², by which an observed direction is no unit vector
_TOLD = 1e-3  # least part of the largest offset of a pose that is told


SEARCH_TIME = 8.0  # processor seconds after which searches end; what was begun takes one or two more


LawChange = Callable[[ControlLaw, float], ControlLaw]  # law, size -> law with a mistake


class SearchTime:
    """Processor time of a search."""

    def __init__(self, seconds: float = math.inf) -> None:
        self._end = time.process_time() + seconds

    @property
    def over(self) -> bool:
        """True if the search has to end."""
        return time.process_time() > self._end


@dataclass(frozen=True)
class Mistake:
    """A mistake of bookkeeping.

    Attributes:
        id: name of its kind, equal for all sizes.
        words: clause that names it, perhaps with ``{size}``.
        layer: of :data:`LAYERS`, where a record shows it; where a record lacks that, the next one that it has.
        changed: law with the mistake, for a size.
        sized: True if its size is a number to be fitted.
        starts: sizes from which a fit begins; a screen of mistakes tries them too.
        numbers: count of further fitted numbers.
        none: size with which nothing is wrong.
        absent: clause that names it where its size is 0; empty: ``words`` do.
        later: True if a record may show it at the next layer, as where it lacks a part of an observation, or has an
            action before it is clipped.
        at_least: clause that names it where any larger size explains as much; empty: none does.
        opposite: clause that names it where its size is -1; empty: its size is not negative.
    """

    id: str
    words: str
    layer: str
    changed: LawChange
    sized: bool = False
    starts: tuple[float, ...] = (0.95,)
    numbers: int = 0
    none: float = 1.0
    absent: str = ""
    later: bool = False
    at_least: str = ""
    opposite: str = ""

    @property
    def least(self) -> float:
        """Smallest size."""
        return -math.inf if self.opposite else 0.0

    def sentence(self, size: float, *, larger: bool = False) -> str:
        """The mistake with its size; ``larger``: any larger one explains as much."""
        if self.absent and abs(size) < _NOTHING:
            return self.absent
        if self.opposite and abs(size + 1) < _NOTHING:
            return self.opposite
        words = self.at_least if larger else self.words
        size = 0.0 if self.none and abs(size) < _NOTHING else size  # an armature beside none may be as small
        return words.format(size=f"{round(size, 12):.5g}")


def mistakes(law: ControlLaw) -> list[Mistake]:
    """All mistakes that change a law, in the order of layers."""
    return sorted(_mistakes(law), key=lambda item: list(LAYERS).index(item.layer))


def _mistakes(law: ControlLaw) -> Iterator[Mistake]:
    for steps, words in ((1, "longer"), (-1, "shorter")):
        sentence = f"the time between two instants of the controller is one step {words}"
        yield _fixed("decimation", sentence, "instants", extra_steps=steps)
    for factor, words in ((0.5, "half"), (0.25, "a quarter of"), (2.0, "twice"), (4.0, "four times")):
        sentence = f"the controller acts at {factor * law.rate:.4g} Hz, {words} its rate"
        yield _fixed("rate", sentence, "instants", rate=factor * law.rate)
    if law.policy is not None:
        yield from _of_observations(law)
        yield from _of_actions(law)
    else:
        for words, order in orders(law.joints):
            sentence = f"targets are for joints in another order ({words})"
            yield _fixed("joint_order", sentence, "target", targets=tuple(law.targets[k] for k in np.argsort(order)))
    if law.policy is None and any(law.pose):
        yield _fixed("pose_missing", "the default pose is missing", "target", targets=(0.0,) * len(law.joints))
    for instants, words in ((1, "one instant"), (2, "two instants")):
        yield _fixed("late", f"targets act {words} late", "target", delay=law.delay + instants)
    if law.delay:
        yield _fixed("early", "targets act at once, without their delay", "target", delay=0)
    for k, joint in enumerate(law.joints):
        signs = law.signs.copy()
        signs[k] *= -1
        yield _fixed("joint_sign", f"the target of {joint} has the other sign", "target", signs=signs)
    yield from _of_servos(law)
    if law.armature.any():
        yield _sized("armature", "the armature is {size} of the right one", "acceleration", "armature", (0.9, 0.2))
    else:
        words = "there is an armature of {size} kg m²"
        yield _sized("armature", words, "acceleration", _armed, _ARMATURES, none=0.0)
    yield _signed("gravity", "gravity", "acceleration", "gravity")


def _of_servos(law: ControlLaw) -> Iterator[Mistake]:
    """Mistakes between targets and efforts."""
    for gain, words in (("kp", "kp"), ("kd", "kd")):
        if getattr(law, gain).any():
            yield _signed(gain, words, "effort", gain)
            yield _fixed(f"{gain}_sign", f"{words} has the other sign", "effort", **{gain: -getattr(law, gain)})
    if np.isfinite(law.limit).any():
        yield _fixed("clamp_missing", "efforts have no limit", "effort", limit=np.full(len(law.joints), np.inf))
        words = "the limit of efforts is {size} of the right one"
        at_least = f"{words.replace('{', 'at least {')}, for no effort is larger"
        yield _sized("clamp", words, "effort", "limit", (0.8, 0.5, 1.2), at_least=at_least)
    if np.any(law.reductions != 1):
        words = "efforts are those of motors, divided by the reductions of the robot's file"
        yield _fixed("reduction", words, "effort", effort_factor=law.effort_factor / law.reductions)
    yield _fixed("state_before", "servos see the state of the step before", "effort", lag=law.lag + 1)
    words = "efforts follow the state in every step" if law.hold_effort else "efforts hold between instants"
    yield _fixed("held_effort", words, "effort", hold_effort=not law.hold_effort)


def _of_observations(law: ControlLaw) -> Iterator[Mistake]:
    """Mistakes of what a policy observes."""
    for words, order in orders(law.joints):
        yield _seen("observed_order", f"joints are observed in another order ({words})", observed_order=order)
    read = "the quaternion of the base is read as"
    for last, read_order in ((1, "w, x, y, z, and is x, y, z, w"), (-1, "x, y, z, w, and is w, x, y, z")):
        yield _seen("quaternion", f"{read} {read_order}", scalar_last=last)
        sentence = f"{read} {read_order}, and used as the inverse rotation"
        yield _seen("quaternion", sentence, scalar_last=last, turned_back=True)
        sentence = f"{read} {read_order}, of the inverse rotation"
        yield _seen("quaternion", sentence, scalar_last=last, conjugated=True)
    yield _seen("rotation", "the rotation of the base is used the other way around", turned_back=True)
    yield _seen("gravity_sign", "the observed gravity has the other sign", gravity_sign=-law.gravity_sign)
    absent, starts = "gravity is not observed", (0.95, _STANDARD)
    yield _observed("observed_gravity", "gravity is", "gravity_sign", starts, absent)
    yield _seen("observed_before", "the policy sees the state of the step before", observed_lag=1)
    velocity, spin = "the velocity of the base is", "the angular velocity of the base is"
    yield _seen("velocity_frame", f"{velocity} observed in the base's axes", velocity_turns=1)
    yield _seen(
        "velocity_frame", f"{velocity} observed turned from the base's axes to the world's twice", velocity_turns=-1
    )
    yield _seen("spin_frame", f"{spin} observed in the world's axes", spin_turns=0)
    yield _seen("spin_frame", f"{spin} observed turned from the world's axes to the base's twice", spin_turns=2)
    if law.centre.any():
        point = f"{velocity} observed at its centre of mass"
        yield _seen("velocity_point", point, at_centre=True)
        yield _seen("velocity_point", f"{point}, in the base's axes", at_centre=True, velocity_turns=1)
    words, periods = "the clock of the policy is off by {size} s", (1 / law.rate, -1 / law.rate)
    yield _sized("clock", words, "observation", _clocked, periods, none=0.0, later=True)
    for part, words in ((-1.0, "relative to the default pose"), (1.0, "with the default pose added")):
        if law.pose.any():
            yield _seen("observed_pose", f"coordinates are observed {words}", pose_observed=part)
    for pair in itertools.chain.from_iterable(itertools.combinations(terms, 2) for terms in TERMS):
        yield _seen(
            "observed_terms", f"{pair[0]} and {pair[1]} have each other's place in observations", exchanged=pair
        )
    names = ("the coordinates are", "the rates of the joints are", velocity, spin)
    for k, name in enumerate((*names, "the last action is")):
        # a policy that saturates leads from either to the scales near it alone
        yield _observed(f"observed_{SCALED[k]}", name, partial(_with_factor, k), (0.95, 0.1), f"{name} not observed")


def _of_actions(law: ControlLaw) -> Iterator[Mistake]:
    """Mistakes of what an action means."""
    words, clips = "actions are clipped to ±{size}", (0.05, 0.1, 0.3, 1.0, 3.0)
    yield _sized("action_clip", words, "action", _clipped, clips, none=math.inf, later=True)
    for words, order in orders(law.joints):
        yield _fixed("joint_order", f"actions are for joints in another order ({words})", "target", action_order=order)
    yield _fixed("pose_missing", "the default pose is missing", "target", pose=np.zeros(len(law.joints)))
    yield _signed("scale", "the scale of actions", "target", "scale", (0.95, 1.9, -0.5))
    words = "actions pass a filter, of which {size} is new at each instant"
    yield _sized("smoothing", words, "target", "smoothing", (0.8, 0.3))


def _seen(name: str, words: str, **changes: object) -> Mistake:
    return _fixed(name, words, "observation", later=True, **changes)


def _fixed(name: str, words: str, layer: str, *, later: bool = False, **changes: object) -> Mistake:
    return Mistake(name, words, layer, lambda law, _: law.change(**changes), later=later)


def _sized(
    name: str, words: str, layer: str, changed: str | LawChange, starts: tuple[float, ...] = (0.95,), **attributes: Any
) -> Mistake:
    """Mistake of a number, which multiplies an attribute of the law or changes it otherwise."""
    change = partial(_scaled, changed) if isinstance(changed, str) else changed
    return Mistake(id=name, words=words, layer=layer, changed=change, sized=True, starts=starts, **attributes)


def _observed(name: str, what: str, changed: str | LawChange, starts: tuple[float, ...], absent: str) -> Mistake:
    """Mistake of the size of a part of an observation."""
    words = f"{what} observed at {{size}} of the right size"
    return _sized(name, words, "observation", changed, starts, absent=absent, later=True)


def _signed(name: str, what: str, layer: str, attribute: str, starts: tuple[float, ...] = (0.95, -0.5)) -> Mistake:
    """Mistake of a number that may have the other sign, too."""
    words = f"{what} is {{size}} of the right one"
    return _sized(name, words, layer, attribute, starts, opposite=f"{what} has the other sign")


def _scaled(attribute: str, law: ControlLaw, size: float) -> ControlLaw:
    return law.change(**{attribute: size * getattr(law, attribute)})


def _armed(law: ControlLaw, size: float) -> ControlLaw:
    return law.change(armature=law.armature + size)


def _clipped(law: ControlLaw, size: float) -> ControlLaw:
    return law.change(clip=size)


def _clocked(law: ControlLaw, size: float) -> ControlLaw:
    return law.change(clock=size)


def _with_factor(place: int, law: ControlLaw, size: float) -> ControlLaw:
    return law.change(factors=(*law.factors[:place], size * law.factors[place], *law.factors[place + 1 :]))


def orders(joints: tuple[str, ...]) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Orders in which programs list joints, other than the given one, and back from them, each with words.

    Names consist of parts, ``FL_HFE``: of a limb and of a place in it. Limbs are swapped, or places come first.
    """
    seen = {tuple(range(len(joints)))}
    for words, order in _orders(joints):
        back = tuple(np.argsort(order).tolist())
        for sentence, way in ((words, order), (f"{words}, the other way around", back)):
            if way not in seen:
                seen.add(way)
                yield sentence, way


def _orders(joints: tuple[str, ...]) -> Iterator[tuple[str, tuple[int, ...]]]:
    numbers = range(len(joints))
    parts = [joint.replace("-", "_").split("_") for joint in joints]
    limbs, places = [item[0] for item in parts], ["_".join(item[1:]) for item in parts]
    for words, keys in (("place by place", places), ("limb by limb", limbs)):
        ranks = {key: rank for rank, key in enumerate(dict.fromkeys(keys))}
        yield words, tuple(sorted(numbers, key=lambda k: ranks[keys[k]]))
    yield "by the alphabet", tuple(sorted(numbers, key=lambda k: joints[k]))
    yield "reversed", tuple(reversed(numbers))
    members = {limb: [k for k in numbers if limbs[k] == limb] for limb in dict.fromkeys(limbs)}
    names = list(members)
    for place, group in enumerate(names):
        for partner in names[place + 1 :]:
            if len(members[group]) == len(members[partner]):
                yield f"{group} and {partner} swapped", _swapped(joints, [(members[group], members[partner])])
    if len(names) > 3 and len(names) % 2 == 0 and len({len(item) for item in members.values()}) == 1:
        pairs = [(members[a], members[b]) for a, b in zip(names[::2], names[1::2], strict=True)]
        yield "neighbouring limbs swapped", _swapped(joints, pairs)


def _swapped(joints: tuple[str, ...], pairs: list[tuple[list[int], list[int]]]) -> tuple[int, ...]:
    order = list(range(len(joints)))
    for group, partner in pairs:
        for a, b in zip(group, partner, strict=True):
            order[a], order[b] = order[b], order[a]
    return tuple(order)


def offsets_told(joints: tuple[str, ...], offsets: Array, clamped: Sequence[int] = ()) -> str:
    """Words for a default pose that is off, with the joints whose part is not round-off.

    ``clamped``: indices of joints whose offset can be any beyond some size, for their efforts are at a limit.
    """
    large = np.abs(offsets) > _TOLD * np.abs(offsets).max()
    parts = []
    for k in np.flatnonzero(large).tolist():
        side = "above 0" if offsets[k] > 0 else "below 0"
        parts.append(f"{joints[k]} {side if k in clamped else f'{offsets[k]:+.4g}'}")
    return "the default pose is another: " + ", ".join(parts)


def fitted(residual: Callable[[float], Array], start: float) -> float:
    """Size, 0 or more, for which a vector of residuals is smallest; the start if it leads nowhere.

    ``residual``: of a size; NaN: it cannot be computed.
    """
    part = least_squares_parameter(lambda part: residual(start * max(part, 0.0)), 1.0, 1.0)
    return start * max(part, 0.0)
