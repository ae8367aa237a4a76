"""Observations of a control law."""

from __future__ import annotations

import numpy as np
from air_robots import law_of, legged

from proofroll.robots.control.bookkeeping.law import RobotState
from proofroll.robots.control.bookkeeping.mistakes import mistakes


def test_states_at_once_are_observed_as_one_by_one() -> None:
    """Arrays of several states have the observations of each, under the right law and under every mistake of one."""
    law, random = law_of(legged()), np.random.default_rng(0)
    count, joints = 4, len(law.joints)
    q, v, last = random.normal(size=(3, count, joints))
    place, velocity, spin = random.normal(size=(3, count, 3))
    attitude = random.normal(size=(count, 4))
    base = {"p_WB": place, "q_WB": attitude, "v_WB": velocity, "w_WB": spin}
    seen_mistakes = [item for item in mistakes(law) if item.layer == "observation"]
    for changed in [law, *(item.changed(law, 0.7) for item in seen_mistakes)]:
        seen = changed.observed(RobotState(time=np.arange(count), q=q, v=v, **base), last)
        for row in range(count):
            state = RobotState(time=row, q=q[row], v=v[row], **{name: item[row] for name, item in base.items()})
            for name, values in vars(changed.observed(state, last[row])).items():
                assert np.allclose(getattr(seen, name)[row], values, rtol=0, atol=1e-14), (row, name)
