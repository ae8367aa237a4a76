"""Layer of a record that has states alone: is its motion that of the robot under its controller, or of a mistake?"""

from __future__ import annotations

import numpy as np

from proofroll.elements.mechanism import Mechanism
from proofroll.elements.mechanism.bookkeeping.air import AirRobot
from proofroll.elements.mechanism.bookkeeping.law import ControlLaw
from proofroll.elements.mechanism.bookkeeping.search import SHOWN, WHOLE, MistakeSearch, SeenMotion, explained
from proofroll.robots.air_fit import states_of
from proofroll.robots.control_record import ControlRecord
from proofroll.robots.record_layer import Layer, LayerCause

_STEPS, _LEAST_STEP = (1, 2, 5, 10), 4.9e-4  # steps between rows that are tried, and the shortest [s]


def motion_layer(record: ControlRecord, law: ControlLaw, mechanism: Mechanism) -> Layer:
    """Layer of a record that lacks others: its states are those of a motion under the law, or under a known mistake."""
    robot = AirRobot(mechanism, law)
    motion = states_of(record, robot)
    if isinstance(motion, str):
        return Layer("motion", reason=motion)
    if abs(record.time[0]) * law.rate > WHOLE:
        return Layer("motion", reason="the record does not begin at time 0, the first instant of the controller")
    q, v = (np.array(part) for part in zip(*motion, strict=True))
    every = float(np.diff(record.time).mean())
    names = [name for name in record.rounding if name.startswith(("q.", "v.", "p_WB.", "q_WB."))]
    rounding = max(float(record.rounding[name].max()) for name in names)
    seen = SeenMotion(np.array([every * k for k in range(len(q))]), q, v, rounding).until(SHOWN)
    found: list[MistakeSearch] = []
    for steps in _STEPS:
        if (steps > 1 and every / steps < _LEAST_STEP) or abs(steps / every / law.rate % 1 - 0.5) < 0.5 - WHOLE:
            continue
        found.append(explained(mechanism, law, seen, every / steps, deep=False))
        if found[-1].explanations:
            break
    if not found:
        return Layer("motion", reason="no step divides both the interval of rows and the time between instants")
    best = found[-1] if found[-1].explanations else min(found, key=lambda item: item.before)
    bar = max(best.spread, seen.bar)
    if not best.explanations and best.before > bar:
        best = explained(mechanism, law, seen, every, deep=True)
    if best.explanations:
        bar = best.explanations[0].after
    causes = (
        LayerCause(
            id=" + ".join(mistake.id for mistake in item.mistakes),
            sentence=item.sentence,
            size=item.sizes[0] if item.mistakes[0].sized else None,
            after=item.after,
        )
        for item in best.explanations
    )
    return Layer(
        name="motion",
        residual=best.before,
        bar=bar,
        column="the state",
        time=float(seen.time[-1]),
        causes=tuple(causes),
    )
