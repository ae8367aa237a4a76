"""Numbers that close the forces of a record together."""

from __future__ import annotations

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


def test_numbers_that_make_the_equations_themselves_explain_nothing(rows: AirRows) -> None:
    """A remainder that efforts and three more numbers cancel, as all numbers of a robot do, has no cause of two."""
    others = sum(rows.columns[name] for name in ("gravity", "drag", "damping"))
    columns = {**rows.columns, "effort": rows.left - others}
    assert not may_be_explained(replace(rows, columns=columns), JOINTS)
