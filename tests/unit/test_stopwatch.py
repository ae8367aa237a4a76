"""The speed of cases."""

from __future__ import annotations

import dataclasses

from proofroll.stopwatch import Stopwatch
from proofroll.studies.single import single_case


def test_a_finer_step_costs_more() -> None:
    """A step ten times smaller takes several times longer per simulated second."""
    with Stopwatch() as stopwatch:
        coarse, fine = (
            stopwatch(
                single_case(
                    "sphere_in_cylinder",
                    {},
                    f"exudyn[formulation=generic,dt={dt}]",
                    until=0.2,
                    every=0.02,
                    time_limit=60,
                ),
                seconds=0.02,
            )
            for dt in (1e-3, 1e-4)
        )
    assert coarse is not None
    assert fine is not None
    assert fine > 3 * coarse


def test_what_cannot_be_built_has_no_speed() -> None:
    """An engine that refuses the scene gives None, and the stopwatch goes on with other cases."""
    refused = single_case(
        "sphere_in_cylinder", {"mu_static": 0.3}, "exudyn[formulation=carrier]", until=0.1, every=0.1, time_limit=60
    )
    good = single_case("sphere_in_cylinder", {}, "exudyn[formulation=carrier]", until=0.1, every=0.1, time_limit=60)
    broken = dataclasses.replace(good, engine=dataclasses.replace(good.engine, name="nothing"))
    with Stopwatch() as stopwatch:
        assert [stopwatch(case, 0.01) is None for case in (refused, broken, good)] == [True, True, False]
