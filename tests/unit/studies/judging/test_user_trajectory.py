"""Trajectories of users: what they may hold."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import proofroll
from proofroll.core.errors import InputError

TIMES = np.linspace(0, 1, 11)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"time": TIMES, "p_WB": np.full((11, 1, 3), "a")}, "p_WB.*it holds text; give real numbers"),
        ({"time": TIMES, "q.pivot": np.zeros(11) + 1j}, "q.pivot.*it holds complex numbers; give real numbers"),
        ({"time": TIMES, "q.pivot": np.zeros(11, dtype=bool)}, "q.pivot.*it holds truth values; give real numbers"),
        ({"time": 3e299 * TIMES, "q.pivot": np.zeros(11)}, "time up to 3e.299 s.*no motion is followed beyond 1e.09 s"),
    ],
)
def test_a_hostile_trajectory_is_refused(columns: dict[str, Any], words: str) -> None:
    """Values that are no real numbers, and times without end, are refused in one line with the column."""
    with pytest.raises(InputError, match=words):
        proofroll.judge(columns, "pendulum")


def test_judge_has_a_limit_of_time(command_line: Callable[..., tuple[int, str, str]], tmp_path: Path) -> None:
    """A truth that takes longer than ``--time-limit`` ends in one line and exit 2."""
    np.savez(tmp_path / "run.npz", time=9e8 * TIMES, **{"q.pivot": np.zeros(11)})
    code, out, err = command_line("judge", str(tmp_path / "run.npz"), "--scene", "pendulum", "--time-limit", "0.2")
    assert (code, out) == (2, "")
    assert "--time-limit = '0.2 s': the truth of pendulum took longer; end the trajectory sooner" in err
