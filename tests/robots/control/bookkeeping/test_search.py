"""Search for mistakes of bookkeeping in states alone, on records that other programs wrote."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from outside_records import CONTROL, MISTAKES, PROGRAMS, SERVOS, Loop, urdf

from proofroll.elements.mechanism import Mechanism
from proofroll.robots.control.bookkeeping.air import AirRobot
from proofroll.robots.control.bookkeeping.law import ControlLaw
from proofroll.robots.control.bookkeeping.search import MistakeSearch, explained
from proofroll.robots.control.bookkeeping.seen import SeenMotion
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


def _found(program: str, step: float, **mistake: object) -> MistakeSearch:
    mechanism, law = _robot()
    robot, every = AirRobot(mechanism, law), EVERY[step]
    record = Loop(step=step, steps=round(0.1 / step), **mistake).record((PROGRAMS | SERVOS)[program])  # type: ignore[operator, arg-type]
    base = np.concatenate([record[name] for name in ("p_WB", "q_WB", "v_WB", "w_WB")], axis=1)
    rows = zip(record["q"][::every], record["v"][::every], base[::every], strict=True)
    q, v = (np.array(part) for part in zip(*(robot.coordinates(*row) for row in rows), strict=True))
    return explained(mechanism, law, SeenMotion(record["time"][::every, 0], q, v), step)


@pytest.mark.parametrize("program", [*PROGRAMS, *SERVOS])
def test_a_right_loop_is_accused_of_nothing(program: str) -> None:
    """States of a right loop are those of the law, to round-off, with the scheme of the program."""
    found = _found(program, 5e-3)
    assert found.explanations == ()
    assert found.before < 1e-9


@pytest.mark.drill
@pytest.mark.parametrize(
    ("program", "step", "name"),
    [
        ("mujoco", 1e-3, "state before"),
        ("mujoco", 2e-3, "velocity in the base"),
        ("pinocchio", 1e-3, "gravity 9.80"),
        ("pinocchio", 2e-3, "a step more"),
        ("mujoco's servos", 5e-3, "no armature"),
        ("mujoco's servos", 5e-3, "sign of a joint"),
    ],
)
def test_a_mistake_is_named_from_states_alone(program: str, step: float, name: str) -> None:
    """The mistake that was planted in a loop around another program explains its states best."""
    found = _found(program, step, **MISTAKES[name][2])
    assert [item.id for item in found.explanations[0].mistakes] == [MISTAKES[name][0]]
    assert found.explanations[0].after < 1e-3 * found.before


PAIRS = (
    ("half kd", "half scale"),
    ("half scale", "xyzw"),
    ("order in the observation", "half kd"),
    ("half kp", "an instant late"),
    ("half kp", "no armature"),
    ("half kd", "spin in the world"),
    ("pose missing", "state before"),
    ("pose off", "sign of gravity"),
    ("place by place", "half the clamp"),
    ("legs swapped", "velocity in the base"),
    ("order in the observation", "pose missing"),
    ("pose missing", "double scale"),
    ("place by place", "spin in the world"),
    ("no armature", "xyzw"),
)


def _named_together(program: str, step: float, names: tuple[str, str]) -> None:
    found = _found(program, step, **MISTAKES[names[0]][2], **MISTAKES[names[1]][2])
    first = found.explanations[0]
    assert {item.id for item in first.mistakes} == {MISTAKES[name][0] for name in names}
    assert first.after < 1e-6 * found.before


def test_two_mistakes_at_once_are_named() -> None:
    """Two mistakes in a loop are named together from its states alone, where neither alone explains them."""
    _named_together("mujoco", 5e-3, ("pose missing", "no armature"))


@pytest.mark.drill
@pytest.mark.nightly
@pytest.mark.parametrize("names", PAIRS, ids=" + ".join)
def test_pairs_at_random_are_named(names: tuple[str, str]) -> None:
    """Fourteen pairs drawn at random are named from states alone."""
    _named_together("mujoco", 2e-3, names)


@pytest.mark.drill
@pytest.mark.parametrize("program", [*PROGRAMS, *SERVOS])
@pytest.mark.parametrize("step", EVERY)
def test_right_loops_are_accused_of_nothing(program: str, step: float) -> None:
    """A right loop is accused of nothing at any step, with gains treated explicitly and implicitly."""
    assert _found(program, step).explanations == ()


@pytest.mark.drill
def test_sizes_come_back() -> None:
    """An unknown size is fitted to more than three digits."""
    found = _found("mujoco", 2e-3, kp=0.37 * 5.0)
    assert found.explanations[0].mistakes[0].id == "kp"
    assert found.explanations[0].sizes[0] == pytest.approx(0.37, rel=1e-4)
