"""Two mistakes at one layer of another program's record are named together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from outside_records import CONTROL, KP, MISTAKES, PROGRAMS, Loop, columns_of, urdf, written

from proofroll.robots.control.judge import RecordJudgement, judge_record

# Pairs of mistakes: of separate parts of an observation, of one part, and of targets.
PAIRS = [
    ("order in the observation", "velocity in the base"),
    ("sign of gravity", "velocity of the centre"),
    ("xyzw", "relative coordinates"),
    ("spin back", "spin at 0.25"),
    ("legs swapped", "pose off"),
    ("two instants late", "double scale"),
    ("low pass", "pose missing"),
    ("half kd", "held efforts"),
    ("clipped actions", "no last action"),
    ("half the rate", "an action repeated"),
]


Judged = Callable[..., RecordJudgement]


@pytest.fixture
def judged(tmp_path: Path) -> Judged:
    """Judgement of a loop's record by a program, with something added to its efforts."""
    robot, control = tmp_path / "legs.urdf", tmp_path / "legs.toml"
    robot.write_text(urdf())
    control.write_text(CONTROL)

    def judgement(loop: Loop, program: str, added: float = 0.0) -> RecordJudgement:
        columns = columns_of(loop.record(PROGRAMS[program]))
        wave = added * np.sin(30 * columns["time"])
        columns |= {name: values + wave for name, values in columns.items() if name.startswith("effort.")}
        return judge_record(written(columns, tmp_path / "record.csv", ""), robot, control)

    return judgement


@pytest.mark.one_in(4)
@pytest.mark.nightly_of("pair3-pinocchio")
@pytest.mark.drill
@pytest.mark.parametrize(
    ("pair", "program"),
    [
        pytest.param(pair, ("mujoco", "pinocchio")[k % 2], marks=() if k % 3 == 0 else pytest.mark.nightly)
        for k, pair in enumerate(PAIRS)
    ],
)
def test_two_mistakes_at_one_layer_are_named(pair: tuple[str, str], program: str, judged: Judged) -> None:
    """The first layer that does not hold names both, and nothing else."""
    first, second = (MISTAKES[name] for name in pair)
    judgement = judged(Loop(**(first[2] | second[2])), program)
    layer = next(item for item in judgement.layers if not item.holds)
    assert layer.name == first[1] == second[1]
    assert set(layer.causes[0].id.split(" + ")) == {first[0], second[0]}, "\n".join(judgement.lines())
    assert layer.causes[0].after < 1e-6


@pytest.mark.nightly
def test_what_no_cause_explains_is_told(judged: Judged, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cause beside something that no mistake explains says which part of the difference it leaves."""
    monkeypatch.setattr("proofroll.robots.control.judge.SEARCH_TIME", 10.0)  # else all pairs of mistakes are tried
    layer = next(item for item in judged(Loop(kp=0.5 * KP), "mujoco", added=2e-3).layers if item.name == "effort")
    assert layer.causes[0].sentence.startswith("kp is ")
    assert "; a cause is missing: 0." in layer.causes[0].sentence
    assert layer.causes[0].after > 1e-6


@pytest.mark.nightly
def test_what_leaves_more_is_no_alternative(judged: Judged) -> None:
    """Beside causes that leave rounding alone none is listed that leaves a part of the difference."""
    layer = next(item for item in judged(Loop(ramp="recorded"), "pinocchio").layers if item.name == "target")
    assert [cause.id for cause in layer.causes] == ["ramped", "mixed_actions"]
