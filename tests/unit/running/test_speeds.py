"""The speed of cases."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker
from proofroll.running.time_case import time_once
from proofroll.studies.cases import single_case


@pytest.mark.drill
def test_what_is_measured_is_a_run_of_the_case(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """The cost is that of an engine that takes its time: wall seconds per simulated second, as many as it sleeps."""
    install_engines({"sleepy": "tiny:Sleepy"})
    case = single_case("sphere_in_cylinder", {}, "sleepy[dt=0.01]", until=0.02, every=0.02, time_limit=60)
    cost = Workers().speed(case, seconds=0.01)
    assert cost is not None
    assert cost >= 1.0, "it sleeps for a second in each simulated one; on a busy machine it may take longer"


@pytest.mark.drill
def test_what_cannot_be_built_has_no_speed() -> None:
    """An engine that refuses the scene gives None, and other cases are measured."""
    refused = single_case(
        "sphere_in_cylinder", {"mu_static": 0.3}, "exudyn[formulation=carrier]", until=0.1, every=0.1, time_limit=60
    )
    good = single_case("sphere_in_cylinder", {}, "exudyn[formulation=carrier]", until=0.1, every=0.1, time_limit=60)
    broken = dataclasses.replace(good, engine=dataclasses.replace(good.engine, name="nothing"))
    workers = Workers()
    assert [workers.speed(case, 0.01) is None for case in (refused, broken, good)] == [True, True, False]


@pytest.mark.drill
def test_a_fast_case_is_measured_as_long_as_a_slow_one(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """A run of a fraction of a millisecond is repeated as often as it takes, not twenty times."""
    install_engines({"tiny": "tiny:Tiny"})
    case = single_case("sphere_in_cylinder", {}, "tiny[dt=0.01]", until=0.02, every=0.02, time_limit=60)
    simulated = float(time_once(dataclasses.asdict(case), 0.2)["message"].split()[0])
    assert simulated > 40 * case.until


@pytest.mark.drill
def test_an_interrupted_worker_is_not_lent_again() -> None:
    """A worker that was left in the middle of a measurement is ended: its answer would be taken for the next one's."""
    workers = Workers()
    case = single_case("sphere_in_cylinder", {}, "truth", until=0.1, every=0.1, time_limit=60)

    class Interrupted(Worker):
        def ask(self, *_: Any) -> dict[str, Any]:
            raise KeyboardInterrupt

    workers.keep("truth", Interrupted())
    with pytest.raises(KeyboardInterrupt):
        workers.speed(case)
    with workers.lend("truth") as worker:
        assert not isinstance(worker, Interrupted)
    workers.close()
