"""Fits of servos name the numbers that a record determines, and no others."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from proofroll.robots.control.fits import ServoRows, observation_causes, servo_causes, target_causes

KP, KD, LIMIT = np.array([30.0, 40.0, 50.0]), np.array([0.5, 0.6, 0.7]), 20.0
TIMES = np.linspace(0.0, 1.0, 60)


def law(limit: float = LIMIT) -> Any:
    """Servos of three joints as they should be."""

    def effort(target: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.clip(KP * (target - q) - KD * v, -limit, limit)

    return SimpleNamespace(joints=("a", "b", "c"), kp=KP, kd=KD, limit=np.full(3, limit), effort=effort)


def rows(
    kp: np.ndarray,
    *,
    kd: np.ndarray = KD,
    limit: float = LIMIT,
    resting: bool = False,
    steps: bool = False,
    digits: int = 17,
) -> ServoRows:
    """Rows of servos with other gains or another limit; the last joint may rest, and efforts may have few levels."""
    q = np.stack([np.sin(7 * TIMES), np.cos(5 * TIMES), np.sin(3 * TIMES) ** 2], axis=1)
    v = np.stack([7 * np.cos(7 * TIMES), -5 * np.sin(5 * TIMES), 3 * np.sin(6 * TIMES)], axis=1)
    target = q + 0.2 * np.stack([np.cos(11 * TIMES), np.sin(13 * TIMES), np.cos(4 * TIMES)], axis=1)
    if resting:
        q[:, 2], v[:, 2], target[:, 2] = 0.3, 0.0, 0.4
    if steps:
        q[:, 0], v[:, 0] = np.round(q[:, 0], 1), np.round(v[:, 0], 0)
        target[:, 0] = q[:, 0] + 0.1 * np.sign(np.cos(11 * TIMES))
    effort = np.round(np.clip(kp * (target - q) - kd * v, -limit, limit), digits)
    return ServoRows(target=target, q=q, v=v, effort=effort)


def told(changed: ServoRows, most: float = 1e-6, limit: float = LIMIT) -> list[str]:
    """Clauses on the servos of these rows."""
    return [cause.sentence for cause in servo_causes(changed, law(limit), most) if cause.id == "servo"]


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


def test_the_digits_of_a_record_say_what_is_a_difference() -> None:
    """Half a thousandth of a gain is told where all digits are there, and not where two decimals are."""
    assert told(rows(KP * [1.0005, 1.0, 1.0])) == ["kp is another: a 1.0005 of the right one"]
    assert told(rows(KP * [1.3, 1.0, 1.0], kd=KD * [1.002, 1.0, 1.0], digits=1), 1e-2) == [
        "kp is another: a 1.3 of the right one"
    ]


def test_gains_that_are_halved_are_not_the_efforts() -> None:
    """Both gains of a half are told; efforts are named beside them only where no limit tells the two apart."""
    assert told(rows(KP / 2, kd=KD / 2)) == ["kp and kd are both, or efforts are, 0.5 of the right ones"]
    largest = float(np.abs(rows(KP / 2, kd=KD / 2).effort).max())
    assert told(rows(KP / 2, kd=KD / 2), limit=1.1 * largest) == ["kp and kd are both 0.5 of the right ones"]


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_gain_of_a_noisy_log_has_its_bar(noise: float) -> None:
    """A gain that noise leaves open is told with a bar that the right one lies in, and one without noise alone."""
    wrong = rows(1.3 * KP)
    effort = wrong.effort + noise * np.random.default_rng(0).normal(size=wrong.effort.shape)
    (clause,) = told(replace(wrong, effort=effort), 0.1)
    number = re.fullmatch(r"kp is (\S+)(?: ± (\S+))? of the right one", clause)
    assert number is not None
    assert (number[2] is None) == (noise == 0)
    assert float(number[1]) == pytest.approx(1.3, abs=float(number[2] or 1e-9))


EXCHANGED = "(a has that of c, b has that of a, c has that of b)"


def test_an_exchange_of_three_joints_is_named() -> None:
    """Efforts, and targets, of three joints that have each other's are told with the joint that each is of."""
    right = rows(KP)
    changed = replace(right, effort=right.effort[:, [2, 0, 1]])
    causes = [cause.sentence for cause in servo_causes(changed, law(), 1e-6)]
    assert causes == [f"efforts are of joints in another order {EXCHANGED}"]
    pose = np.array([0.1, -0.2, 0.3])
    control = SimpleNamespace(joints=("a", "b", "c"), pose=pose, scale=0.5)
    sentences = [
        item.sentence
        for item in target_causes(pose + 0.5 * right.q[:, [2, 0, 1]], right.q, None, control, 1e-6)  # type: ignore[arg-type]
    ]
    assert sentences == [f"actions are for joints in another order {EXCHANGED}"]


def test_a_dead_band_is_named_with_its_least_width() -> None:
    """Errors below which kp does nothing are told for the joint that has them, up to the largest that was seen."""
    right = rows(KP)
    apart = right.target[:, 1] - right.q[:, 1]
    effort = right.effort.copy()
    effort[:, 1] = np.clip(KP[1] * np.where(np.abs(apart) < 0.1, 0, apart) - KD[1] * right.v[:, 1], -LIMIT, LIMIT)
    (cause,) = servo_causes(replace(right, effort=effort), law(), 1e-6)
    width = np.abs(apart[np.abs(apart) < 0.1]).max()
    assert cause.sentence == f"kp does nothing near a target, up to at least: b {width:.5g}"


def test_a_constant_that_is_added_is_no_size() -> None:
    """A constant that is added to a column that hardly varies is named as one."""
    right = 9.8 + 0.01 * np.sin(np.stack([TIMES, 3 * TIMES], axis=1))
    difference = np.tile([0.5, 0.0], (len(TIMES), 1))
    recorded = right + difference
    causes = observation_causes(("x", "y"), recorded, difference, np.abs(recorded).max(axis=0), 1e-3)
    best = min(causes, key=lambda cause: cause.after)
    assert (best.id, best.sentence) == ("observed_offset", "parts are observed with a constant added: x 0.5")
