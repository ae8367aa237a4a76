"""Fits of servos name the numbers that a record determines, and no others."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.robots.control.fits import ServoRows, servo_causes

KP, KD, LIMIT = np.array([30.0, 40.0, 50.0]), np.array([0.5, 0.6, 0.7]), 20.0
TIMES = np.linspace(0.0, 1.0, 60)


def law() -> Any:
    """Servos of three joints as they should be."""

    def effort(target: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.clip(KP * (target - q) - KD * v, -LIMIT, LIMIT)

    return SimpleNamespace(joints=("a", "b", "c"), kp=KP, kd=KD, limit=np.full(3, LIMIT), effort=effort)


def rows(kp: np.ndarray, *, limit: float = LIMIT, resting: bool = False, steps: bool = False) -> ServoRows:
    """Rows of servos with other gains or another limit; the last joint may rest, and efforts may have few levels."""
    q = np.stack([np.sin(7 * TIMES), np.cos(5 * TIMES), np.sin(3 * TIMES) ** 2], axis=1)
    v = np.stack([7 * np.cos(7 * TIMES), -5 * np.sin(5 * TIMES), 3 * np.sin(6 * TIMES)], axis=1)
    target = q + 0.2 * np.stack([np.cos(11 * TIMES), np.sin(13 * TIMES), np.cos(4 * TIMES)], axis=1)
    if resting:
        q[:, 2], v[:, 2], target[:, 2] = 0.3, 0.0, 0.4
    if steps:
        q[:, 0], v[:, 0] = np.round(q[:, 0], 1), np.round(v[:, 0], 0)
        target[:, 0] = q[:, 0] + 0.1 * np.sign(np.cos(11 * TIMES))
    return ServoRows(target=target, q=q, v=v, effort=np.clip(kp * (target - q) - KD * v, -limit, limit))


def told(changed: ServoRows) -> list[str]:
    """Clauses on the servos of these rows."""
    return [cause.sentence for _, cause in servo_causes(changed, law(), 1e-6) if cause.id == "servo"]


@pytest.mark.parametrize("resting", [False, True])
def test_a_joint_that_holds_its_law_is_not_named(resting: bool) -> None:
    """Of one joint with another gain its number is told, whether another joint moves or rests; those are not listed."""
    assert told(rows(KP * [1.3, 1.0, 1.0], resting=resting)) == ["kp is another: a 1.3 of the right one"]


def test_efforts_that_repeat_are_no_limit() -> None:
    """Largest efforts that several rows have are those of a limit only where the servo would have given more."""
    assert told(rows(KP * [1.3, 1.0, 1.0], steps=True)) == ["kp is another: a 1.3 of the right one"]


def test_a_limit_that_efforts_reach_is_told() -> None:
    """Where efforts stay at their ends, the limit is that of the ends."""
    assert told(rows(KP, limit=5.0)) == ["the limit of efforts is 0.25 of the right one"]
