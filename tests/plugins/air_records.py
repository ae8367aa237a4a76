"""Records of robots in the air, as another program would write them."""

from __future__ import annotations

import itertools

import numpy as np
from air_robots import start_of

from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.bookkeeping.air import AirRobot, AirScheme, Treatment, steps_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import ControlRecord, record_of


def recorded(
    mechanism: Mechanism,
    law: ControlLaw,
    right: ControlLaw,
    *,
    step: float = 1e-3,
    count: int = 100,
    scheme: Treatment = "explicit",
    digits: str = "",
) -> ControlRecord:
    """Record of a run under a law, started as the right law starts.

    ``digits``: of the file: ``single`` precision, a number of decimals, or all.
    """
    robot = AirRobot(mechanism, law)
    steps = steps_in_air(robot, law, robot.coordinates(*start_of(right)), step, AirScheme(scheme))
    run, times = [*itertools.islice(steps, count + 1)], step * np.arange(count + 1)
    states = [robot.state(time, item.q, item.v) for time, item in zip(times, run, strict=True)]
    columns = {}
    for k, joint in enumerate(law.joints):
        columns |= {f"q.{joint}": [item.q[k] for item in states], f"v.{joint}": [item.v[k] for item in states]}
        columns |= {
            f"action.{joint}": [item.action[k] for item in run],
            f"target.{joint}": [item.target[k] for item in run],
        }
        columns[f"effort.{joint}"] = [item.efforts[k] for item in run]
    for name, axes in (("p_WB", "xyz"), ("q_WB", "wxyz"), ("v_WB", "xyz"), ("w_WB", "xyz")):
        columns |= {f"{name}.{axis}": [getattr(item, name)[k] for item in states] for k, axis in enumerate(axes)}
    period = round(1 / law.rate / step) + law.extra_steps
    seen = [run[row - row % period].observation for row in range(len(run))]
    for name in ("q", "v"):
        columns |= {
            f"observed.{name}.{joint}": [getattr(item, name)[k] for item in seen] for k, joint in enumerate(law.joints)
        }
    for name in ("v_WB_W", "w_WB_B", "gravity_B"):
        columns |= {
            f"observed.{name}.{axis}": [getattr(item, name)[k] for item in seen] for k, axis in enumerate("xyz")
        }
    arrays = {name: np.array(values, dtype=float) for name, values in columns.items()}
    if digits == "single":
        arrays = {name: values.astype(np.float32).astype(float) for name, values in arrays.items()}
    elif digits:
        arrays = {name: np.round(values, int(digits)) for name, values in arrays.items()}
    return record_of(np.round(times, 9), arrays)
