"""Records of robots in the air, as another program would write them."""

from __future__ import annotations

import numpy as np
from air_robots import start_of

from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.bookkeeping.air import AirRobot, Scheme, run_in_air
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.record import ControlRecord, record_of


def recorded(
    mechanism: Mechanism,
    law: ControlLaw,
    right: ControlLaw,
    *,
    step: float = 1e-3,
    count: int = 100,
    scheme: Scheme = "explicit",
    digits: str = "",
) -> ControlRecord:
    """Record of a run under a law, started as the right law starts.

    ``digits``: of the file: ``single`` precision, a number of decimals, or all.
    """
    robot = AirRobot(mechanism, law)
    run = run_in_air(robot, law, robot.coordinates(*start_of(right)), step, count, scheme)
    states = [robot.state(time, q, v) for time, q, v in zip(run.time, run.q, run.v, strict=True)]
    columns = {}
    for k, joint in enumerate(law.joints):
        columns |= {f"q.{joint}": [item.q[k] for item in states], f"v.{joint}": [item.v[k] for item in states]}
        columns |= {f"action.{joint}": run.actions[:, k], f"target.{joint}": run.targets[:, k]}
        columns[f"effort.{joint}"] = run.efforts[:, k]
    for name, axes in (("p_WB", "xyz"), ("q_WB", "wxyz"), ("v_WB", "xyz"), ("w_WB", "xyz")):
        columns |= {f"{name}.{axis}": [getattr(item, name)[k] for item in states] for k, axis in enumerate(axes)}
    period = round(1 / law.rate / step) + law.extra_steps
    seen = [run.observations[row // period] for row in range(len(run.time))]
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
    return record_of(np.round(run.time, 9), arrays)
