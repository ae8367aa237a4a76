"""Programs recorded from formulas: the same numbers, and no more operations than these need."""

import math
from typing import Any

import numpy as np

from proofroll.elements.mechanism.scene.shapes.walls.formula import RecordedProgram, cos, sin, sqrt

NUMBERS = 0.7, -1.3, 2.1


def formulas(x: Any, y: Any, z: Any) -> list[Any]:
    """Formulas with each operation, sign and kind of constant."""
    return [
        x - y,
        y - x,
        -(x - y) * -z,
        (-x) * y + z * -2.0,
        -0.5 * x - -1.0 * y,
        1.0 - (-x) ** 3 + (-y) ** 2,
        -x / -y + 2.0 / -z - z / -3.0,
        sqrt(x * x + y * y) * sin(-z) - cos(x - z),
        (x + y) - (y + x),
        0.0 * x + 1.0 * y - 0.0,
    ]


def test_a_program_has_the_numbers_of_its_formulas() -> None:
    """Signs, constants and functions are those of the formulas, to the last digit."""
    program = RecordedProgram(3)
    (calculated,) = program.functions(formulas(*program.symbols), math)
    np.testing.assert_array_equal(calculated(*NUMBERS), [float(part) for part in formulas(*NUMBERS)])


def test_a_program_has_only_what_is_needed() -> None:
    """A result is calculated once, its opposite not again, what cancels and what nobody needs not at all."""
    program = RecordedProgram(2)
    x, y = program.symbols
    unneeded = [sin(x), (x + y) * y]
    (calculated,) = program.functions([x - y, y - x, (x + y) - (y + x), -y], math)
    assert unneeded
    assert calculated.__code__.co_nlocals == 3  # the arguments and one difference
    assert calculated(3.0, 1.0) == (2.0, -2.0, 0.0, -1.0)
