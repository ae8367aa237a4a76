"""Truths of random mechanisms, balls and contacts held against the referee: every error in parts of its own bar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from proofroll.core.errors import ProofrollError
from proofroll.core.events import JUMPS, events_of
from proofroll.core.scene import Scene
from proofroll.core.truth import truth
from proofroll.elements.balls.reader import PlacedBall
from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.contact.start import check_contacts
from proofroll.elements.mechanism.dynamics.record import Record
from proofroll.elements.mechanism.reading.assembly import check_start
from proofroll.elements.mechanism.scene.rotations import Array
from proofroll.papers.blajer_2006.ball.kind import ball_element
from proofroll.truth.error_bars import TwoRouteMotion
from proofroll.truth.smooth.smooth_truth import find_truth
from proofroll.truth.truth_of_mechanism import truth_of

from .balls import BallReferee
from .contacts import ContactReferee, Told
from .linear_algebra import long
from .random_balls import RandomBall, random_ball
from .random_contacts import random_contacts
from .random_mechanisms import random_mechanism
from .solver import Referee

UNTIL, UNTIL_OF_BALLS = 0.2, 0.5  # s
_ALIKE = {"rest": "stick", "settle": "impact"}  # the truth's words for what the referee calls otherwise
_BEYOND = 1e-3  # s after what ends the referee's account, so that the truth has its event


@dataclass(frozen=True)
class Held:
    """One mechanism, ball or scene of contacts.

    Attributes:
        seed, style: choice of the random scene.
        kinds: of its joints, then of its loops; of a ball or of contacts the events.
        refused: why there is no truth, or the truth's own word where it is ill-posed; empty if it is well-posed.
        worst: largest error of each quantity, in parts of its bar.
        determinate: number of components of reactions that were compared.
    """

    seed: int
    style: str
    kinds: str
    refused: str
    worst: dict[str, float]
    determinate: int

    @property
    def sound(self) -> bool:
        """True if there is a truth, and no error beyond its bar."""
        return not self.refused and all(value <= 1 for value in self.worst.values())

    @property
    def text(self) -> str:
        """One line for a person."""
        largest = max(self.worst, key=lambda name: self.worst[name], default="")
        found = self.refused or f"largest error {self.worst.get(largest, 0.0):.2g} of its bar, {largest}"
        return f"{self.seed} {self.style} ({self.kinds}): {found}"


def hold(seed: int, until: float = UNTIL) -> Held:
    """The truth of a random mechanism against the referee's at three times from 0 until one [s]."""
    style, mechanism = random_mechanism(seed)
    kinds = " ".join(c.kind for c in mechanism.connections)
    times = np.array([0.0, until / 2, until])
    try:
        check_start(mechanism)
        found = find_truth(mechanism, times)
    except ProofrollError as error:
        return Held(seed, style, kinds, str(error), {}, 0)
    worst = {}
    for name, size in errors(mechanism, found.record, found.determinate).items():
        beyond = size > 0
        worst[name] = float((size[beyond] / found.bars[name][beyond]).max(initial=0))
    return Held(seed, style, kinds, "", worst, int(found.determinate.sum()))


def hold_ball(seed: int, until: float = UNTIL_OF_BALLS) -> Held:
    """The truth of a random ball as a body against the referee's, as far as that goes; events too, within brackets."""
    style, element = random_ball(seed)
    times = np.linspace(0, until, 6)
    told = BallReferee(element).run(times.astype(np.longdouble))
    does = " ".join([*(kind for kind, _ in told.events), *["bounce"] * len(told.bounces), told.why])
    known = len(told.seen)
    times = np.append(times[:known], [told.end + _BEYOND] if told.end < until else [])
    try:
        found = truth(as_body(element), times)
    except ProofrollError as error:
        return Held(seed, style, does, str(error), {}, 0)
    worst = {}
    known = min(known, found.sizes["time"])
    for name in ("p_WB", "v_WB", "w_WB", "q_WB", "N", "gap") if known else ():
        values, right = found[name].to_numpy()[:known], long([one[name] for one in told.seen[:known]])
        values = values[:, 0] if values.ndim > 1 else values  # the ball is the first body
        apart = np.abs(values - right)
        if name == "q_WB":  # of either sign
            apart = np.minimum(apart.max(axis=1), np.abs(values + right).max(axis=1))
        bar, largest = found[name].attrs["error_bar"], float(np.max(apart))
        worst[name] = largest / bar if bar else (np.inf if largest else 0.0)
    events = [event for event in events_of(found) if event.time > 0]
    # what a ball does from an impact on is its mode, no event of its own
    left = [(kind, time) for kind, time in told.events if time > 0 and time not in told.bounces]
    for event in events:
        wide = max(event.time_high - event.time, np.finfo(float).eps * max(event.time, 1e-3))
        if event.time > told.end + wide:
            break
        if event.kind in JUMPS:
            off = min((abs(time - event.time) for time in told.bounces), default=np.inf)
        else:
            kind, time = left.pop(0) if left else ("nothing", np.inf)
            off = abs(time - event.time) if kind == _ALIKE.get(event.kind, event.kind) else np.inf
        worst["event"] = max(worst.get("event", 0.0), off / wide)
    said = str(found.attrs.get("ill_posed") or found.attrs.get("ended") or "")
    if left and not said:
        worst["event"] = np.inf
    return Held(seed, style, does, said, worst, 0)


def as_body(element: RandomBall) -> Scene:
    """Scene of a ball as a body with a sphere that touches a wall."""
    placed = PlacedBall(element.ball, element.surface, element.contact, element.start)
    return Scene("random_ball", "", (ball_element(placed, element.gravity, "random"),))


def hold_contacts(seed: int) -> Held:
    """The truth of random bodies that touch against the referee's, as far as that goes; events too."""
    style, mechanism, until = random_contacts(seed)
    times = np.linspace(0, until, 3)
    told = ContactReferee(mechanism).follow(list(times))
    does = ", ".join([*(f"{kind} {name}" for kind, name, _ in told.events), *([told.why] if told.why else [])])
    if not told.seen:
        return Held(seed, style, does, f"the referee cannot say: {told.why}", {}, 0)
    try:
        check_contacts(mechanism)
        # a truth needs a time after the start
        found = truth_of(mechanism, times[: max(2, len(told.seen))])
    except ProofrollError as error:
        return Held(seed, style, does, str(error), {}, 0)
    known = int(np.sum(times[: len(told.seen)] < found.horizon))
    worst: dict[str, float] = {}
    record, seen = found.record, told.seen[:known]
    pairs: dict[str, tuple[Any, Any]] = {
        "p_WB": (record.p_WB, [one["p_WB"] for one in seen]),
        "v_WB": (record.v_WB, [one["v_WB"] for one in seen]),
        "w_WB": (record.w_WB, [one["w_WB"] for one in seen]),
        "q_WB": (record.placed(mechanism).R_WB[:, :-1] / 4, [one["R_WB"] / 4 for one in seen]),
        "pressed": ([] if found.pressed is None else found.pressed[..., :3], [one["pressed"] for one in seen]),
        "wrench": (record.wrench, [one["wrench"] for one in seen]),
    }
    for name, (given, true) in pairs.items():
        for value, other, bar in zip(given, true, found.bars[name], strict=False):  # the truth may go on
            apart = float(np.nanmax(np.abs(value - other), initial=0))  # not a number: undetermined
            worst[name] = max(worst.get(name, 0.0), float(apart / bar) if bar else np.inf if apart else 0.0)
    worst["event"] = _event_error(told, found)
    return Held(seed, style, does, "", worst, 0)


def _event_error(told: Told, found: TwoRouteMotion) -> float:
    """Largest distance of an event in parts of its bracket; infinite if one has no counterpart."""
    last = min(told.end, found.horizon)
    left = [event for event in told.events if event[2] < last]
    worst = 0.0
    for event in found.events:
        if event.time >= last:
            continue
        same = [each for each in left if each[0] == _ALIKE.get(event.kind, event.kind) and each[1] == event.name]
        if not same:
            return np.inf
        nearest = min(same, key=lambda each: abs(each[2] - event.time))
        left.remove(nearest)
        wide = max(event.time_high - event.time, event.time - event.time_low, float(np.spacing(event.time)))
        worst = max(worst, float(abs(nearest[2] - event.time)) / wide)
    return np.inf if left else worst


def errors(mechanism: Mechanism, record: Record, determinate: NDArray[np.bool_]) -> dict[str, Array]:
    """Largest difference of each quantity of a record from the referee's at each time."""
    seen = Referee(mechanism).run(record.time)
    placed = record.placed(mechanism)
    slices = zip(mechanism.joints, mechanism.q_slices, strict=True)
    angles = [at.start + n for j, at in slices if j.kind in {"revolute", "universal"} for n in range(j.nq)]
    wrench = [[np.where(determinate, value, 0) for value in values]
              for values in (record.wrench, (one["wrench"] for one in seen))]  # fmt: skip
    # a rotation matrix differs by up to four times as much as its quaternion
    pairs: dict[str, tuple[Any, Any]] = {
        "p_WB": (record.p_WB, [one["p_WB"] for one in seen]),
        "v_WB": (record.v_WB, [one["v_WB"] for one in seen]),
        "w_WB": (record.w_WB, [one["w_WB"] for one in seen]),
        "q_WB": (placed.R_WB[:, :-1] / 4, [one["R_WB"] / 4 for one in seen]),
        "energy": (placed.energy(), [one["energy"] for one in seen]),
        "q": (record.q[:, angles], [one["angles"] for one in seen]),
        "wrench": (wrench[0], wrench[1]),
    }
    return {
        name: np.array([float(np.abs(a - b).max(initial=0)) for a, b in zip(given, true, strict=True)])
        for name, (given, true) in pairs.items()
    }
