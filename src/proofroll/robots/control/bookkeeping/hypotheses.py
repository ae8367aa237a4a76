"""Hypotheses of mistakes in the bookkeeping of a controller: orders, poses, gains, limits, delays, frames, signs."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from proofroll.core.diagnosis import Cause, Difference, Evidence, hypothesis
from proofroll.core.diagnosis.samples import run_and_truth
from proofroll.core.errors import InputError
from proofroll.elements.mechanism.diagnosis.equations import is_motion, of_start, placed_of
from proofroll.elements.mechanism.diagnosis.residuals import MOTION
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import IMPLICIT, LAYERS
from proofroll.robots.control.bookkeeping.screen import SHOWN, WHOLE, SeenMotion
from proofroll.robots.control.bookkeeping.search import MistakeExplanation, MotionSearch, explained_start

# Names of hypotheses that look at the same number by other means.
_SAME: Mapping[str, str] = {
    "kp": "actuators: kp", "kd": "actuators: kd", "clamp": "actuators: the limits", "clamp_missing": "actuators: limit",
}  # fmt: skip
_COVERS = (*MOTION, "effort")


@hypothesis(
    "bookkeeping",
    "a motion from the true start under the scene's controller with that mistake, at the engine's step and with one of "
    "the usual treatments of gains, is the motion of the run; without the mistake none is",
)
def of_bookkeeping(evidence: Evidence) -> Iterator[Cause]:
    """Hypotheses: mistakes between a policy and the efforts of its servos, in a robot in the air."""
    if (asked := evidence.asked) is None or asked.mechanism.control is None or not asked.mechanism.control.actuators:
        return
    mechanism = asked.mechanism
    others = (mechanism.loops, mechanism.springs, mechanism.contacts, mechanism.forces, mechanism.bushings)
    if any(others) or any(joint.motion is not None for joint in mechanism.joints):  # more than joints and gravity act
        return
    try:
        law = ControlLaw.of(asked.mechanism)
        if evidence.run is None:
            if (start := of_start(evidence)) is not None:
                difference, explanations = explained_start(asked.mechanism, law, start.v_rates[0])
                causes = (_cause(item, difference, of_run=False) for item in explanations[:2])
                # one effort of each servo acts on the accelerations
                yield from (replace(cause, explains=len(law.joints)) for cause in causes)
        elif (search := _of_run(evidence, law)) is not None:
            yield from (_cause(item, search.before, of_run=True) for item in search.explanations[:2])
            if search.imitated:
                remedy = "run it at a second step, and look at its armatures and at its integrator"
                off = Difference("motion", "rad or m", search.explicit, _COVERS)
                yield off.cause("bookkeeping: implicit kd", IMPLICIT, search.before, remedy)
    except InputError:  # motors with gears
        return


def _of_run(evidence: Evidence, law: ControlLaw) -> MotionSearch | None:
    """Search for mistakes that explain a run; None: no motion of steps can be held against it."""
    pair = run_and_truth(evidence)
    if pair is None or evidence.by_step or not is_motion(pair[0]):
        return None
    mechanism, time = evidence.asked.mechanism, pair[0]["time"].to_numpy()
    every = float(time[1] - time[0])
    step = evidence.step or every
    whole = all(abs(x / step - round(x / step)) < WHOLE for x in (every, 1 / law.rate))
    if not whole or float(np.ptp(np.diff(time))) > WHOLE * every:
        return None
    q, v = placed_of(mechanism, pair[0]).of_tree()
    return MotionSearch(mechanism, law, SeenMotion(time, q, v).until(SHOWN), [step])


def _cause(item: MistakeExplanation, before: float, *, of_run: bool) -> Cause:
    mistake = item.mistake
    what = ("motion", "rad or m") if of_run else ("accelerations at time 0", "1/s^2")
    name, says = _SAME.get(mistake.id, f"bookkeeping: {mistake.id}"), f"it moves as if {item.sentence}"
    remedy = f"look at the {mistake.layer} ({LAYERS[mistake.layer]}) in the program around the engine"
    change = abs(item.size - 1) if mistake.sized else np.inf
    return Difference(*what, before, _COVERS).cause(name, says, item.after, remedy, item.fitted, change=change)
