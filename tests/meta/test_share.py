"""Cases of a test that are left to the night."""

from __future__ import annotations

from share import is_of_the_day

_CASES = 120


def test_a_share_of_cases_is_spread_over_all() -> None:
    """One case in n runs by day, within one case, among them some of each value of a parameter that returns."""
    for count in (2, 3, 4):
        taken = [place for place in range(_CASES) if is_of_the_day(place, count)]
        assert taken[0] == 0
        assert abs(len(taken) - _CASES / count) <= 1
        for period in range(2, 9):
            assert {place % period for place in taken} == {*range(period)}
