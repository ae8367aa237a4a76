"""Results that are kept are found once."""

from dataclasses import dataclass, replace

from proofroll.core.last_results import kept


@dataclass(frozen=True)
class _Side:
    length: float


def test_a_result_is_found_once_for_each_record() -> None:
    """A record keeps its result, an equal or changed record finds its own, and records stay equal."""
    calls = []

    @kept
    def area(side: _Side) -> float:
        calls.append(side.length)
        return side.length**2

    side = _Side(2.0)
    assert [area(side), area(side), area(replace(side, length=3.0)), area(side)] == [4.0, 4.0, 9.0, 4.0]
    assert calls == [2.0, 3.0]
    assert side == _Side(2.0)
