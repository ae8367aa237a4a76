"""Units as other programs write them."""

import time

import pytest

from proofroll.core.errors import InputError
from proofroll.core.parameters import measured
from proofroll.core.unit_conversion import is_known


@pytest.mark.parametrize(
    ("unit", "known"),
    [
        ("N/s", True),
        ("kg m^2/s^2", True),
        ("rad s-1", True),
        ("1/s", True),
        ("mm", True),
        ("furlong", False),
        ("", False),
    ],
)
def test_products_of_units_are_units(unit: str, known: bool) -> None:
    """A product or quotient of powers of SI units is known, and other words are not."""
    assert is_known(unit) is known


def test_a_number_in_a_unit_of_another_kind_is_refused() -> None:
    """A rate of force is no force, and is one where a rate of force is asked for."""
    with pytest.raises(InputError, match="this number is in N, and not in N/s"):
        measured("size", "3 N/s", "N")
    assert measured("size", "3 N/s", "N/s") == 3.0


@pytest.mark.parametrize("text", ["9" * 10**5, "1 m" + " " * 10**5 + "=", "1" + " " * 10**5 + "=", "1e" + "9" * 10**5])
def test_a_long_text_is_read_in_one_pass(text: str) -> None:
    """A text of a hundred thousand characters that is no measure is known as such at once; it took minutes."""
    began = time.process_time()
    assert measured("size", text, "m") is None
    assert time.process_time() - began < 0.5
