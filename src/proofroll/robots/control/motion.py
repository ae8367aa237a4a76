"""Layer of a record that has states alone: is its motion that of the robot under its controller, or of a mistake?"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from proofroll.core.number_format import error
from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.air_fit import AirFit
from proofroll.robots.control.air_rows import states_of
from proofroll.robots.control.bookkeeping.air import AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw, RobotState
from proofroll.robots.control.bookkeeping.mistakes import IMPLICIT, SEARCH_TIME, SearchTime, mistakes
from proofroll.robots.control.bookkeeping.screen import SHOWN, WHOLE, SeenMotion
from proofroll.robots.control.bookkeeping.search import MotionSearch
from proofroll.robots.control.record import ControlRecord, Layer

_STEPS, _LEAST_STEP = (1, 2, 5, 10), 4.9e-4  # steps between rows that are tried, and the shortest [s]
# What no motion under a law has, and the fit of forces tells; damping moves the robot as more of kd does.
_ONLY_FORCES = ("damping", "friction", "payload")
_ON_INSTANT, _FEWEST = 1e-5, 4  # part of the time between instants that is round-off, and least rows of a motion


def _begun(record: ControlRecord, law: ControlLaw) -> tuple[int, ControlLaw] | str:
    """First row at which a motion can begin, and the law that begins there; or the reason why there is none.

    That is the controller's first instant, or a later one, if nothing of what was before it counts or it is recorded.
    """
    if abs(record.time[0]) * law.rate <= WHOLE:
        return 0, law
    rest = record.time * law.rate - np.round(record.time * law.rate)
    rows = np.flatnonzero(np.abs(rest) < _ON_INSTANT).tolist()
    if not rows:
        return "no row lies at an instant of the controller, a multiple of the time between instants"
    needed = max(law.delay, int(_looks_back(law)))
    if not needed:
        return rows[0], law.change(begins=float(record.time[rows[0]]))
    actions = record.stacked("action", law.joints)
    if actions is None or len(rows) <= needed:
        what = "targets that come late" if law.delay else "a policy that observes its last action"
        return f"the record begins at {record.time[0]:.6g} s, after the controller; {what} needs what was before"
    earlier = tuple(actions[row] for row in rows[:needed])
    return rows[needed], law.change(begins=float(record.time[rows[needed]]), earlier=earlier)


def _looks_back(law: ControlLaw) -> bool:
    """True if the policy of a law answers differently where its last action was another."""
    count = len(law.joints)
    rest = RobotState(time=0.0, q=law.pose, v=np.zeros(count))
    answers = []
    for last in (np.zeros(count), np.full(count, 0.1)):
        if (answer := law.answer()) is None:
            return False
        answers.append(answer(law.observed(rest, last)))
    return bool(np.any(answers[0] != answers[1]))


def motion_layer(
    record: ControlRecord,
    law: ControlLaw,
    mechanism: Mechanism,
    forces: Callable[[ControlRecord], AirFit | str],
    time: SearchTime,
) -> Layer:
    """Layer of a record that lacks others: its states are those of a motion under the law, or under a known mistake.

    Args:
        record: of a run under the law.
        law: the law as it should be.
        mechanism: the robot.
        forces: fit of the record's accelerations under efforts of the law.
        time: of the search.
    """
    robot = AirRobot(mechanism, law)
    motion = states_of(record, robot)
    if isinstance(motion, str):
        return Layer("motion", reason=motion)
    if isinstance(begun := _begun(record, law), str):
        return Layer("motion", reason=begun)
    start, law = begun
    q, v = (np.array(part) for part in zip(*motion[start:], strict=True))
    if len(q) < _FEWEST:
        return Layer("motion", reason="too few rows follow the first instant of the controller")
    every = float(np.diff(record.time).mean())
    names = [name for name in record.rounding if name.startswith(("q.", "v.", "p_WB.", "q_WB."))]
    rounding = max(float(record.rounding[name].max()) for name in names)
    seen = SeenMotion(np.array([every * k for k in range(len(q))]), q, v, rounding).until(SHOWN)
    divided = [n for n in _STEPS if n == 1 or every / n >= _LEAST_STEP]
    divided = [n for n in divided if abs(n / every / law.rate % 1 - 0.5) >= 0.5 - WHOLE]
    if not divided:
        return Layer("motion", reason="no step divides both the interval of rows and the time between instants")
    search = MotionSearch(mechanism, law, seen, [every / n for n in divided], time)
    least = search.before
    fit = "" if search.right else forces(record)
    fitted = [] if isinstance(fit, str) else [cause for cause in fit.causes if cause.id in _ONLY_FORCES]
    layer = Layer(
        name="motion",
        residual=least,
        bar=min(seen.bar, 0.5 * least),
        column="the state",
        time=float(seen.time[-1]),
        causes=tuple(fitted),
    )
    if any(cause.id != "damping" for cause in fitted):
        return layer
    causes = (*(item.cause for item in search.explanations), *fitted)
    bar = min([item.after for item in search.explanations] or [seen.bar]) if causes else max(search.spread, seen.bar)
    reason, tried = IMPLICIT if search.imitated else "", len(search.tried)
    layer = replace(layer, bar=bar, reason=reason, causes=causes, tried=tried, known=len(mistakes(law)))
    ended = f"none of {layer.known} known mistakes explains it"
    if time.over:
        ended = f"the search ended after {SEARCH_TIME:.0f} s of processor time without a mistake that explains it"
    open_layer = Layer("motion", reason=f"not decided: off by {error(least)}, and {ended}", undecided=True)
    return layer if search.right or causes else open_layer
