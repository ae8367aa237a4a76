"""Texts of numbers."""

from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proofroll.core.number_format import be, with_bar


@pytest.mark.parametrize(
    ("value", "bar", "texts"),
    [
        (3.48407, 0.33, ("3.5", "0.35")),
        (0.4634259429810123, 8.9e-15, ("0.463425942981012", "9.3e-15")),
        (-2.0, 1e-3, ("-2", "1.1e-3")),  # 1e-3 itself is a hair more than its digits
        (0.3, 0.33, ("0", "0.64")),
        (1.5, 0.0, ("1.5", "0")),
    ],
)
def test_a_value_is_rounded_at_the_first_digit_of_its_bar(value: float, bar: float, texts: tuple[str, str]) -> None:
    """The rounding is added to the bar."""
    assert with_bar(value, bar) == texts


@given(
    st.floats(-1e12, 1e12, allow_subnormal=False),
    st.floats(0.0, 1e12, allow_subnormal=False),
    st.integers(1, 2),
)
def test_the_texts_contain_the_interval(value: float, bar: float, digits: int) -> None:
    """Between text of the value minus and plus text of the bar lies all between value minus and plus bar."""
    middle, half = map(Decimal, with_bar(value, bar, digits))
    assert middle - half <= Decimal(value) - Decimal(bar)
    assert Decimal(value) + Decimal(bar) <= middle + half


@pytest.mark.parametrize(("quantity", "verb"), [("gap", "is"), ("across", "is"), ("positions", "are"), ("v_x", "is")])
def test_a_quantity_has_its_verb(quantity: str, verb: str) -> None:
    """Names of several values are in the plural."""
    assert be(quantity) == verb
