"""Numbers of a scene as parameters at run time."""

import numpy as np

from proofroll.truth.numerics.run_time_constants import Constants, Symbol


def test_numbers_become_parameters_and_those_of_formulas_stay() -> None:
    """Each different number is one parameter after the first; 0, 1, 2 and halves stay numbers, on either side."""
    constants = Constants(lambda index: f"p{index}", 3, lambda value: f"{value:g}")

    class Text(str):
        """An expression that writes itself down."""

        def __mul__(self, other: str) -> "Text":  # type: ignore[override]
            return Text(f"({self}*{other})")

        def __sub__(self, other: str) -> "Text":
            return Text(f"({self}-{other})")

        def __neg__(self) -> "Text":
            return Text(f"-{self}")

    x = Symbol(Text("x"), constants)
    assert (-(x * 0.3) * 2.0 * np.float64(0.7) * 0.3).expression == "(((-(x*p3)*2)*p4)*p3)"
    assert (x - 1.0).expression == "(x-1)"
    assert constants.values(0.0).tolist() == [0.3, 0.7]
    assert constants.functions({"half": lambda y: Text(f"half({y})")})["half"](0.7).expression == "half(p4)"
