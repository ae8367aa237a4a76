"""Records of a pendulum that stands or passes its limits: what holds it is named, and nothing that does not."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from proofroll.robots.control.judge import judge_record
from proofroll.robots.control.record import Layer

MASS, ARM, INERTIA, G, STEP = 2.0, 0.5, 0.02, 9.81, 1e-3
PLACE = 0.512345678901234
WEIGHT = MASS * G * ARM * np.sin(PLACE)  # that holds it there
TIMES = STEP * np.arange(40)
CHANGING = 6 * np.sin(100 * TIMES)
Judged = Callable[..., Layer]


@pytest.fixture
def judged(tmp_path: Path) -> Judged:
    """Layer of accelerations of a record of a pendulum with limits at ±3 rad."""

    def layer(q: np.ndarray | float, v: np.ndarray | float, effort: np.ndarray | float, laws: str = "") -> Layer:
        inertia = f'<inertia ixx="{INERTIA}" iyy="{INERTIA}" izz="0.01" ixy="0" ixz="0" iyz="0"/>'
        limit = '<limit lower="-3" upper="3" effort="100" velocity="100"/>'
        (tmp_path / "pendulum.urdf").write_text(
            f'<robot name="pendulum"><link name="world"/><link name="bob"><inertial><origin xyz="0 0 -{ARM}"/>'
            f'<mass value="{MASS}"/>{inertia}</inertial></link><joint name="j" type="revolute"><parent link="world"/>'
            f'<child link="bob"/><axis xyz="0 1 0"/>{limit}{laws}</joint></robot>'
        )
        rows = np.stack([TIMES, *(np.broadcast_to(item, TIMES.shape) for item in (q, v, effort))], axis=1)
        lines = ["time,q.j,v.j,effort.j", *(",".join(map(repr, row)) for row in rows.tolist())]
        (tmp_path / "record.csv").write_text("\n".join(lines))
        return judge_record(tmp_path / "record.csv", tmp_path / "pendulum.urdf", None).layers[-1]

    return layer


def moved(q: float, v: float) -> tuple[np.ndarray, np.ndarray]:
    """Motion under the changing efforts, without stops."""
    states = []
    for effort in CHANGING:
        states.append((q, v))
        v += STEP * (effort - MASS * G * ARM * np.sin(q)) / (INERTIA + MASS * ARM**2)
        q += STEP * v
    places, rates = np.array(states).T
    return places, rates


@pytest.mark.parametrize(("part", "causes"), [(0.0, []), (0.012, []), (0.4, ["effort"])])
def test_what_is_no_more_than_a_few_roundings_accuses_nothing(part: float, causes: list[str], judged: Judged) -> None:
    """Lost efforts are named where they are beyond two bars of what the record's digits do; less is not decided."""
    q, v = moved(1.0, 0.6)
    layer = judged(q.round(4), v.round(4), ((1 + part) * CHANGING).round(4))
    assert [cause.id for cause in layer.causes] == causes
    assert (layer.undecided, layer.holds) == (part == 0.012, not causes)


@pytest.mark.drill
def test_motors_that_hold_are_named_with_the_forces_that_are_off(judged: Judged) -> None:
    """A joint that changing efforts and its weight do not move has motors; the distance is that of the forces."""
    layer = judged(PLACE, 0.0, CHANGING)
    assert [cause.id for cause in layer.causes] == ["held_joints"]
    off = np.sqrt(np.mean((CHANGING - WEIGHT) ** 2) / (INERTIA + MASS * ARM**2))
    assert layer.residual == pytest.approx(off, rel=0.1)
    assert 0 < layer.bar < 1e-6


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("effort", "words"),
    [(-WEIGHT, "the effort scale has the other sign"), (0.0, "the gravity is 0 ± ")],
)
def test_numbers_that_explain_a_joint_at_rest_go_before_motors(effort: float, words: str, judged: Judged) -> None:
    """A pendulum at rest whose efforts have the other sign, or that has no weight, is told so."""
    layer = judged(PLACE, 0.0, effort)
    assert any(cause.sentence.startswith(words) for cause in layer.causes), layer.causes
    assert "held_joints" not in [cause.id for cause in layer.causes]


@pytest.mark.drill
@pytest.mark.one_in(2)
@pytest.mark.parametrize(("friction", "causes"), [(50, []), (1, ["held_joints"])])
def test_dry_friction_of_the_file_holds_a_joint_as_far_as_it_goes(
    friction: float, causes: list[str], judged: Judged
) -> None:
    """Forces within the dry friction of a joint accuse nothing that holds it, and larger ones do."""
    layer = judged(PLACE, 0.0, CHANGING, f'<dynamics friction="{friction}"/>')
    assert [cause.id for cause in layer.causes] == causes
    held = "rows at which dry friction may hold a joint are left out: v.j, first at 0 s; too few rows are left"
    assert (layer.residual is None, layer.reason) == ((False, "") if causes else (True, held))


@pytest.mark.parametrize("start", [3.05, 2.99])
def test_a_program_without_stops_holds_beyond_limits(start: float, judged: Judged) -> None:
    """Rows beyond a limit are left out only where a stop may have acted in them."""
    layer = judged(*moved(start, 0.6), CHANGING)
    assert layer.holds
    assert (layer.residual is None, layer.reason) == (False, "")


@pytest.mark.drill
def test_a_joint_that_lies_at_its_stop_all_the_time_has_no_row(judged: Judged) -> None:
    """Where a stop holds a joint in all rows, that is the reason, and not motors or a controller."""
    layer = judged(3.0, 0.0, 9 + CHANGING)
    assert layer.residual is None
    assert layer.reason == (
        "rows at an end of the range of a joint are left out: q.j, first at 0 s; too few rows are left"
    )
