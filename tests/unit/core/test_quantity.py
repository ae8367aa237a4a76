"""Numbers with units in formulas."""

import pytest

from proofroll.core.errors import InputError
from proofroll.core.parameters import Parameters
from proofroll.core.quantity import Quantity, UnitsDiffer, powers_of

GIVEN = Parameters(
    {"mass": 2.0, "length": 3.0, "time": 0.5, "angle": 1.0, "count": 4.0},
    {"mass": "kg", "length": "m", "time": "s", "angle": "rad", "count": "1"},
)


@pytest.mark.parametrize(
    ("one", "other"),
    [("N m s/rad", "kg m^2/s"), ("N/m", "kg/s^2"), ("J", "N m"), ("1", "rad"), ("m^-1", "1/m"), ("W", "N m/s")],
)
def test_a_unit_is_its_base_units(one: str, other: str) -> None:
    """Units that are products of others have the same powers."""
    assert powers_of(one) == powers_of(other)


def test_a_unit_that_nobody_knows_is_a_base() -> None:
    """A name of no other unit cancels itself alone, so that other kinds of elements may have units of their own."""
    assert powers_of("V A/V") == {"A": 1.0}


@pytest.mark.parametrize(
    ("formula", "unit", "value"),
    [
        ("= mass*length^2/12", "kg m^2", 1.5),
        ("= -length/time", "m/s", -6.0),
        ("= angle/time", "rad/s", 2.0),
        ("= length/count + 1", "m", 1.75),
        ("= 2*pi/8", "rad", 0.7853981633974483),
        ("= count/8", "m", 0.5),
        ("= (mass*length*mass*length)^0.5/time", "N s", 12.0),
        ("= length*sin(pi/6)", "m", 1.5),
        ("= length*cos(angle)", "m", 1.6209069176044193),
        ("= sqrt(length/(mass/mass))*sqrt(length)", "m", 3.0),
        ("= hypot(length, 4)", "m", 5.0),
        ("= atan2(length, length)", "rad", 0.7853981633974483),
        ("= asin(1) + acos(1) + atan(tan(angle)) - abs(-angle)", "rad", 1.5707963267948966),
        ("= 30*deg", "rad", 0.5235987755982988),
        ("30 deg", "rad", 0.5235987755982988),
        ("-90deg", "rad or m", -1.5707963267948966),
        ("180 deg/s", "rad/s", 3.141592653589793),
    ],
)
def test_a_formula_has_the_unit_of_its_place(formula: str, unit: str, value: float) -> None:
    """Formulas of the right unit are read, those of plain numbers anywhere."""
    assert GIVEN.filled({"key": formula}, "place", {"key": unit})["key"] == pytest.approx(value, rel=1e-14)


@pytest.mark.parametrize(
    ("formula", "unit", "said"),
    [
        ("= mass*length", "kg m^2", "this number is in kg m.2, the formula gives kg m;"),
        ("= angle*length", "rad", "the formula gives m"),
        ("= length + time", "m", "m and s cannot be added"),
        ("= angle", "m", "the formula gives 1"),
        ("= length^mass", "m", "a power must be a plain number, this one is in kg"),
        ("heavy", "kg", "this is not a number; give one in kg"),
        ("= sin(length)", "1", "sin is of a ratio, and this is in m"),
        ("= hypot(length, time)", "m", "m and s cannot be added"),
        ("= sqrt(length)", "m", "the formula gives m.0.5"),
        ("30 deg", "m", "this number is in m, and not in deg"),
        ("30 deg", "rad/s", "this number is in rad/s, and not in deg"),
        ("$mass", "m", "this number is in m, that parameter in kg"),
    ],
)
def test_a_formula_of_another_unit_is_refused(formula: str, unit: str, said: str) -> None:
    """Each error names the place, the formula, both units."""
    with pytest.raises(InputError, match=said) as raised:
        GIVEN.filled({"key": [0, formula]}, "place", {"key": unit})
    assert raised.value.field == "place.key.1"


def test_a_sum_of_a_plain_number_keeps_the_unit() -> None:
    """A plain number takes the unit of its partner in a sum, and has none in a product."""
    length = Quantity(2.0, powers_of("m"))
    assert (1 + length).powers == (length - 1).powers == (3 * length).powers == powers_of("m")
    assert (1 / length).unit == "1/m"
    with pytest.raises(UnitsDiffer):
        length + length**2
