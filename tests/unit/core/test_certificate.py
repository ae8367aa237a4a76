"""What a certificate says of a quantity that differs."""

from __future__ import annotations

from proofroll.core.certificate import Line, first_difference, tolerated
from proofroll.core.engine import Regularised


def test_of_many_numbers_the_one_furthest_off_is_shown() -> None:
    """Accelerations of eighty bodies are two hundred and forty numbers, of which a sentence holds one."""
    expected = tuple(float(n) for n in range(240))
    found = (*expected[:100], 100.5, *expected[101:])
    said = first_difference([Line("acceleration", "m/s^2", expected, found, 0.5 / 239, 1e-9)])
    assert said is not None
    assert "is 100.5 instead of 100 m/s^2 (the one of 240 numbers that is furthest off)" in said
    assert len(said) < 240


def test_a_difference_names_its_scale() -> None:
    """Where a difference is not relative to the numbers beside it, what it is relative to is told."""
    for scale, told in (
        (67.0, "(relative difference 0.1, allowed"),
        (2800.0, "(relative difference 2.4e-3 of 2800 rad"),
    ):
        said = first_difference([Line("spin", "rad/s^2", (67.0,), (60.3,), 6.7 / scale, 1e-9)])
        assert told in str(said)


def test_a_softening_beyond_what_is_accepted_is_told() -> None:
    """An engine whose loops give way too much has no wrong number, and the sentence says what gives way."""
    soft, cap = Regularised(1.9, "loops are soft"), Regularised(0.5, "a spring pulls in proportion to its opening")
    tolerance, because = tolerated(soft, cap, 1e-9, "")
    said = first_difference([Line("forces", "N", (265.0,), (12.0,), 0.95, tolerance, because)])
    assert str(said).endswith("(relative difference 0.95, allowed 0.5); loops are soft")


def test_a_number_that_is_none_is_shown() -> None:
    """NaN among many numbers is the one that is furthest off, and the sentence has it beside the scene's."""
    found = (1.0,) * 10 + (float("nan"), 2.0)
    said = first_difference([Line("inertia", "kg m^2", (1.0,) * 12, found, float("inf"), 1e-9)])
    assert "inertia is nan instead of 1 kg m^2 (the one of 12 numbers that is furthest off)" in str(said)
