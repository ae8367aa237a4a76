"""Search for mistakes of bookkeeping in states alone, on records that other programs wrote."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from outside_records import CONTROL, MISTAKES, PROGRAMS, SERVOS, Loop, urdf

from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.bookkeeping.air import AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.mistakes import Mistake, SearchTime
from proofroll.robots.control.bookkeeping.screen import SeenMotion
from proofroll.robots.control.bookkeeping.search import LayerTrials, MotionSearch, mistakes_together
from proofroll.robots.control.controlled import ControlledScenes

EVERY = {1e-3: 4, 2e-3: 2, 5e-3: 1}  # steps between samples


@cache
def _robot() -> tuple[Mechanism, ControlLaw]:
    with TemporaryDirectory() as folder:
        robot, control = Path(folder) / "legs.urdf", Path(folder) / "legs.toml"
        robot.write_text(urdf())
        control.write_text(CONTROL)
        mechanism = ControlledScenes(control).of_record(robot, free=True).mechanism
    return mechanism, ControlLaw.of(mechanism)


def _found(program: str, step: float, **mistake: object) -> MotionSearch:
    mechanism, law = _robot()
    robot, every = AirRobot(mechanism, law), EVERY[step]
    record = Loop(step=step, steps=round(0.1 / step), **mistake).record((PROGRAMS | SERVOS)[program])  # type: ignore[operator, arg-type]
    base = np.concatenate([record[name] for name in ("p_WB", "q_WB", "v_WB", "w_WB")], axis=1)
    rows = zip(record["q"][::every], record["v"][::every], base[::every], strict=True)
    q, v = (np.array(part) for part in zip(*(robot.coordinates(*row) for row in rows), strict=True))
    return MotionSearch(mechanism, law, SeenMotion(record["time"][::every, 0], q, v), [step])


@pytest.mark.drill
@pytest.mark.one_in(3)
@pytest.mark.parametrize("program", [*PROGRAMS, *SERVOS])
@pytest.mark.parametrize("step", [*(pytest.param(step, marks=pytest.mark.drill) for step in (1e-3, 2e-3)), 5e-3])
def test_a_right_loop_is_accused_of_nothing(program: str, step: float) -> None:
    """States of a right loop are those of the law, to round-off, with the scheme and at the step of the program."""
    found = _found(program, step)
    assert not found.explanations
    assert found.before < 1e-9


@pytest.mark.one_in(4)
@pytest.mark.nightly
@pytest.mark.nightly_of(
    "mujoco-0.002-velocity in the base",
    "pinocchio-0.001-gravity 9.80",
    "mujoco's servos-0.005-sign of a joint",
    "mujoco-0.005-pose off",
)
@pytest.mark.parametrize(
    ("program", "step", "name"),
    [
        ("mujoco", 1e-3, "state before"),
        ("mujoco", 2e-3, "velocity in the base"),
        ("pinocchio", 1e-3, "gravity 9.80"),
        ("pinocchio", 2e-3, "a step more"),
        ("mujoco's servos", 5e-3, "no armature"),
        ("mujoco's servos", 5e-3, "sign of a joint"),
        ("mujoco", 5e-3, "pose off"),
    ],
)
def test_a_mistake_is_named_from_states_alone(program: str, step: float, name: str) -> None:
    """The mistake that was planted in a loop around another program explains its states best."""
    found = _found(program, step, **MISTAKES[name][2])
    assert found.explanations[0].mistake.id == MISTAKES[name][0]
    assert found.explanations[0].after < 1e-3 * found.before


@pytest.mark.nightly
def test_sizes_come_back() -> None:
    """An unknown size is fitted to more than three digits."""
    found = _found("mujoco", 2e-3, kp=0.37 * 5.0)
    assert found.explanations[0].mistake.id == "kp"
    assert found.explanations[0].size == pytest.approx(0.37, rel=1e-4)


def test_dry_friction_holds_a_joint_at_rest_against_small_efforts_alone() -> None:
    """What holds stays at rest, and what efforts overcome moves with friction against it, as beside a rate of 1e-9."""
    mechanism, law = _robot()
    friction = [0.0 if joint.nq != 1 else 0.3 for joint in mechanism.joints]
    joints = tuple(replace(joint, friction=size) for joint, size in zip(mechanism.joints, friction, strict=True))
    robot, (q, _) = AirRobot(replace(mechanism, joints=joints, gravity=(0.0, 0.0, 0.0)), law), mechanism.start()
    still, efforts = np.zeros(mechanism.nv), np.zeros(len(law.joints))
    columns = robot.driven[:, 1]
    efforts[0] = 0.2
    assert not robot.solved(q, still, efforts).acceleration[columns].any()
    efforts[0] = 2.0
    drawn = robot.solved(q, still, efforts).acceleration
    rates = np.sign(drawn) * (np.abs(drawn) > 0)
    moving = robot.solved(q, 1e-9 * rates, efforts).acceleration
    assert drawn[columns[0]] > 0
    assert drawn == pytest.approx(moving, abs=1e-6 * np.abs(drawn).max())


# Columns: a law is a tuple of their numbers, and the record has these.
RECORDED = (3.0, -1.0, 5.0)
BAR = 1e-9


def mistake(name: str, changed: Callable[..., Any], *, sized: bool = False, opposite: str = "") -> Mistake:
    """A mistake of a tuple of numbers."""
    words = f"{name} {{size}}" if sized else name
    return Mistake(id=name, words=words, layer="target", changed=changed, sized=sized, opposite=opposite)


FIRST = mistake("first", lambda law, _: (3.0, law[1], law[2]))
SECOND = mistake("second", lambda law, _: (law[0], -1.0, law[2]))
THIRD = mistake("third", lambda law, size: (law[0], law[1], size * law[2]), sized=True)
SPOILS = mistake("spoils", lambda law, _: (3.0, 7.0, law[2]))
BOTH = mistake("both", lambda law, _: (3.0, -1.0, law[2]))
ADDED = mistake("added", lambda law, _: (law[0] + 1.0, law[1], law[2]))
TIMES = mistake("times", lambda law, size: (size * law[0], law[1], size * law[2]), sized=True, opposite="other signs")


def told(law: tuple[float, ...], *candidates: Mistake, time: SearchTime | None = None) -> tuple[str, str] | None:
    """Names and sentence of the mistakes that lead from a law to the record."""

    def left(trial: Any) -> Any:
        return np.array(trial) - RECORDED

    trials = LayerTrials(lambda trial: np.abs(left(trial)) / BAR, left, lambda _: iter(()))
    cause = mistakes_together(candidates, law, trials, time or SearchTime())  # type: ignore[arg-type]
    return None if cause is None else (cause.id, cause.sentence)


@pytest.mark.parametrize("order", [(FIRST, SECOND, THIRD), (THIRD, SECOND, FIRST)])
def test_mistakes_of_separate_columns_are_named_one_by_one(order: tuple[Mistake, ...]) -> None:
    """Each closes its columns, in whatever order the mistakes are listed; one with a size is the last."""
    names, sentence = told((1.0, 1.0, 2.5), *order) or ("", "")
    assert set(names.split(" + ")) == {"first", "second", "third"}
    assert "third 2" in sentence


def test_what_closes_most_is_named_first() -> None:
    """A mistake that closes two columns is named in place of one for each of them."""
    assert (told((1.0, 1.0, 2.5), FIRST, SECOND, BOTH, THIRD) or ("", ""))[0] == "both + third"


def test_two_mistakes_of_the_same_columns_are_a_pair() -> None:
    """A mistake without a size and one whose size fits, of which neither closes the column, do together."""
    assert told((0.5, -1.0, 2.5), ADDED, TIMES) == ("added + times", "added; and times 2")
    assert told((0.2, -1.0, 2.0), ADDED, TIMES) == ("added + times", "added; and times 2.5")
    assert told((-4.0, -1.0, -5.0), ADDED, TIMES) == ("added + times", "added; and other signs")


def test_nothing_is_named_that_leaves_a_column_wrong() -> None:
    """What spoils a right column, leaves one wrong, or needs more time than there is, is no cause."""
    assert told((1.0, -1.0, 2.0), SPOILS, SECOND, THIRD) is None
    assert told((1.0, 1.0, 2.0), FIRST, SECOND) is None
    assert told((1.0, 1.0, 2.5), FIRST, SECOND, THIRD, time=SearchTime(-math.inf)) is None
    assert told((0.5, -1.0, 2.5), ADDED, TIMES, time=SearchTime(-math.inf)) is None


def test_a_single_mistake_is_left_to_others() -> None:
    """One mistake that closes all columns is not told as several."""
    assert told((1.0, -1.0, 5.0), FIRST) is None


def test_a_size_is_fitted_where_it_changes_what_is_wrong() -> None:
    """A mistake that leaves a wrong column as it is is tried at its starts alone, and one that reaches it is fitted."""
    tried: list[float] = []

    def changed(law: tuple[float, ...], size: float) -> tuple[float, ...]:
        tried.append(size)
        return law[0], size * law[1], law[2]

    elsewhere = mistake("elsewhere", changed, sized=True)
    assert told((0.5, -1.0, 2.5), ADDED, TIMES, elsewhere) == ("added + times", "added; and times 2")
    assert set(tried) == {0.95}
