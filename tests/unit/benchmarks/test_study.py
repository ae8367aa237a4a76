"""Where the wall time of a study goes."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from proofroll.running.case import Case, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_benchmarks.study import account, first_answer

pytestmark = pytest.mark.own_workers


def test_shares_add_up() -> None:
    """All causes together, with what no case accounts for, are the whole of wall time × workers."""
    found = account([{"advance": 3.0, "writing": 1.0}, {"advance": 2.0, "clean runs": 1.0}], 10.0, resolved=0.5)
    assert sum(found["shares"].values()) == pytest.approx(1.0)
    assert found["outside"] == pytest.approx(0.4)
    assert found["shares"]["waiting"] == pytest.approx(0.25)
    assert found["within_goal"] is False


@pytest.mark.nightly
def test_a_case_says_where_its_time_went(
    tmp_path: Path, make_case: Callable[..., Case], install_engines: Callable[[Mapping[str, str]], None]
) -> None:
    """Every result of a run names its causes, none negative, and the time inside the engine is the stopwatch's."""
    install_engines({"tiny": "tiny:Tiny"})
    case = make_case("tiny", timed=True)
    case = dataclasses.replace(case, engine=dataclasses.replace(case.engine, version="1.0"))
    store = Store(tmp_path)
    result = Runner(store, jobs=1).run([case])[case.key]
    assert result.status is Status.DONE
    causes = {"process start", "loading", "building", "certificate", "advance", "sampling", "trajectory", "writing"}
    assert causes | {"clean runs", "clean-up"} == set(result.spent)
    assert min(result.spent.values()) >= 0
    assert result.spent["advance"] == result.wall_seconds
    assert result.spent["process start"] > 0.01
    stored = store.get(case)
    assert stored is not None
    assert stored.spent["advance"] == result.wall_seconds


def test_records_from_before_are_readable() -> None:
    """A result that was stored before its time was split is read, with nothing said about it."""
    assert Result.from_dict({"status": "done", "message": "reached 1 s"}).spent == {}


@pytest.mark.nightly
def test_the_first_answer_takes_longer_than_none(install_engines: Callable[[Mapping[str, str]], None]) -> None:
    """A process that starts and answers takes time; one that cannot load its engine gives no answer about it."""
    install_engines({"tiny": "tiny:Tiny", "absent": "no_such_module:Engine"})
    seconds = first_answer("tiny")
    assert seconds is not None
    assert seconds > 0.01
    assert first_answer("absent") is None
