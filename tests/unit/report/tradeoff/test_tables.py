"""What holds a tolerance in a trade-off, with its price."""

from __future__ import annotations

import dataclasses

from invented import tradeoff_study

from proofroll.core.engine_abilities import Level
from proofroll.report.tradeoff.tables import cheapest_held


def test_each_setting_has_its_cheapest_point_that_holds_the_first_tolerance() -> None:
    """Cheapest first; equations by hand, untimed points and what does not hold are left out, the last counted."""
    study = tradeoff_study()
    point, name = study.points[0], study.quantity
    scale = study.quantities[name].scale
    assert scale is not None

    def other(curve: str, part: float, cost: float | None, level: str | None = None):
        return dataclasses.replace(
            point, curve=curve, level=level, seconds_per_second=cost, error={name: part * scale},
            envelope={name: part * scale},
        )  # fmt: skip

    points = [
        *(other("a", 1e-6, 4.0), other("a", 9e-5, 2.0), other("a", 2e-4, 1.0)),
        *(other("b", 1e-9, 0.5), other("c", 1e-3, 0.1), other("d", 1e-9, None)),
        other("hand", 1e-12, 0.01, Level.REDUCED),
    ]
    held, lacking = cheapest_held(dataclasses.replace(study, points=points))
    assert [(point.curve, point.seconds_per_second) for point in held] == [("b", 0.5), ("a", 2.0)]
    assert lacking == 2
    assert cheapest_held(dataclasses.replace(study, points=points, quantities={}))[0] == []
