"""Numbers that close the forces of a record together."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from proofroll.robots.control.air_rows import BY_JOINT, NUMBERS, AirRows
from proofroll.robots.control.air_several import may_be_explained, several_causes

JOINTS = ("hip", "knee")
RIGHT = {"gravity": 1.0, "effort": 1.0, "armature": 1.0}
EQUATIONS = 240


@pytest.fixture
def rows() -> AirRows:
    """Columns at random, and a remainder of none of them."""
    random = np.random.default_rng(0)
    return AirRows(
        left=random.normal(size=EQUATIONS),
        columns={name: random.normal(size=EQUATIONS) for name in (*NUMBERS, "implicit")},
        by_joint={name: random.normal(size=(EQUATIONS, len(JOINTS))) for name in BY_JOINT},
        added={name: random.normal(size=(EQUATIONS, 10)) for name in ("trunk", "thigh")},
        rounding=1e-9,
        late=np.zeros(EQUATIONS),
        size=1.0,
        slow=np.zeros(EQUATIONS, bool),
        pushed={name: random.normal(size=(EQUATIONS, 3)) for name in ("", "trunk", "thigh")},
    )


def test_what_no_number_leaves_at_rounding_is_not_explained(rows: AirRows) -> None:
    """A remainder of none of the columns has no cause, nor has one that needs three groups of numbers."""
    assert not may_be_explained(rows, JOINTS)
    three = rows.columns["gravity"] + rows.columns["drag"] + rows.by_joint["torque"] @ [1.0, 2.0]
    assert several_causes(replace(rows, left=three), JOINTS, RIGHT) == []


@pytest.mark.parametrize("scaled", [False, True])
def test_two_groups_are_told_together(scaled: bool, rows: AirRows) -> None:
    """A constant torque beside drag, or beside another scale of efforts, is told with its size."""
    beside = "effort" if scaled else "drag"
    both = replace(rows, left=0.1 * rows.columns[beside] + rows.by_joint["torque"] @ [0.5, 0.0])
    assert may_be_explained(both, JOINTS)
    causes = several_causes(both, JOINTS, RIGHT)
    assert {cause.id for cause in causes} == {beside, "torque"}
    assert "a constant torque of 0.5" in " ".join(cause.sentence for cause in causes)


@pytest.mark.parametrize(
    ("table", "name", "numbers", "cause", "words"),
    [
        ("by_joint", "efforts", [0.0, -2.0], "efforts", "joints have efforts of -1 at knee of the right ones"),
        (
            "by_joint",
            "quadratic",
            [0.2, 0.0],
            "quadratic",
            "joints have drag v |v| of 0.2 at hip N m s²/rad² or N s²/m² that is not told",
        ),
        (
            "pushed",
            "",
            [0.3, 0.0, -0.4],
            "pull",
            "gravity is more by 0.3 m/s² along x, -0.4 m/s² along z",
        ),
        ("pushed", "trunk", [0.0, 2.0, 0.0], "push", "a constant force of 2 N along y acts on trunk"),
    ],
)
def test_a_vector_or_a_part_of_an_effort_is_told(
    table: str, name: str, numbers: list[float], cause: str, words: str, rows: AirRows
) -> None:
    """Efforts of one joint, its quadratic drag, another gravity and a constant force on a body are told alone."""
    (told,) = several_causes(replace(rows, left=getattr(rows, table)[name] @ numbers), JOINTS, RIGHT)
    assert (told.id, re.sub(r" ± \S+", "", told.sentence).partition(" (")[0]) == (cause, words)


def test_a_dead_motor_beside_a_link_without_mass_is_no_cause(rows: AirRows) -> None:
    """Efforts of nothing are told alone, and not beside another inertia: masses of nothing explain any motion."""
    dead = replace(rows, left=rows.by_joint["efforts"] @ [0.0, -1.0])
    assert [cause.id for cause in several_causes(dead, JOINTS, RIGHT)] == ["efforts"]
    beside = replace(dead, left=dead.left + rows.added["thigh"] @ np.linspace(1, 2, 10))
    assert several_causes(beside, JOINTS, RIGHT) == []


def test_numbers_that_make_the_equations_themselves_explain_nothing(rows: AirRows) -> None:
    """A remainder that efforts and three more numbers cancel, as all numbers of a robot do, has no cause of two."""
    others = sum(rows.columns[name] for name in ("gravity", "drag", "damping"))
    columns = {**rows.columns, "effort": rows.left - others}
    assert not may_be_explained(replace(rows, columns=columns), JOINTS)
