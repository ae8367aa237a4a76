"""Signals by the evaluator of the checks: the values of the scene's own, at any time and beside kinks."""

from __future__ import annotations

import numpy as np
import pytest

from proofroll.elements.mechanism.scene.signal import Formula, Table
from proofroll.elements.mechanism.scene.spring_law import SpringLaw
from proofroll.truth.check.laws.signals import pull_by, value_of

TIME = np.array([[0.1, 0.2, 0.3], [0.6, 0.65, 0.69]])


@pytest.mark.parametrize(
    "text",
    [
        "2*sin(3*t) - t^2/a",
        "-t^2 + 2^-t^2",
        "a*abs(t - 0.5) + max(t, 0.5, a) - min(t, 0.4)",
        "sign(0.5 - t)*exp(-a*t)",
        "(1 + t)/(2 - t)*sqrt(t)*tanh(t)*atan(t)*log(1 + t)*cos(pi*t)*tan(t)*asin(t)",
        "3",
    ],
)
def test_a_formula_has_the_value_of_the_scene(text: str) -> None:
    """Operators bind as in the format, and kinks have their sides."""
    formula = Formula(text, (("a", 0.7),))
    assert value_of(formula, TIME) == pytest.approx(np.broadcast_to(formula.at(TIME), TIME.shape), rel=1e-15)


def test_a_kink_at_the_end_of_a_piece_has_the_side_of_its_middle() -> None:
    """The sign of a piece that begins at its zero is that of the piece."""
    assert value_of(Formula("sign(t - 0.1)"), TIME[:1]).tolist() == [[1.0, 1.0, 1.0]]


@pytest.mark.parametrize("hold", [False, True])
def test_a_table_is_a_line_or_held(hold: bool) -> None:
    """Between its rows a table is a line, or holds the value of the middle of a piece; outside it is constant."""
    table = Table((0.2, 0.5, 0.8), (1.0, 4.0, -2.0), hold)
    lines = [[1.0, 1.0, 2.0], [2.0, 1.0, 0.2]]
    assert value_of(table, TIME) == pytest.approx(np.array([[1.0] * 3, [4.0] * 3] if hold else lines), abs=1e-14)


def test_a_spring_pulls_by_its_own_formula() -> None:
    """Length and rate are variables of the law."""
    law = SpringLaw("50*(L - 0.3)^3 + k*dL", (("k", 2.0),))
    length, rate = TIME, TIME - 0.5
    assert pull_by(law, length, rate) == pytest.approx(law.pull(length, rate), rel=1e-14)
