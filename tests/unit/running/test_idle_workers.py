"""Worker processes that are kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from proofroll.running.engine_questions import prepare, resolve
from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll.studies.cases import single_case

pytestmark = pytest.mark.own_workers

ASK = {"do": "resolve", "engine": "truth", "options": {}}


def process(worker: Worker) -> int:
    """Number of a worker's process."""
    return int(worker._process.pid)


@pytest.mark.nightly
def test_a_worker_is_kept_for_its_engine() -> None:
    """The same process answers for the same engine again, and never for another."""
    workers = Workers()
    with workers.lend("truth") as worker:
        worker.request(ASK, 60)
        first = process(worker)
    with workers.lend("projection") as worker:
        assert process(worker) != first
    with workers.lend("truth") as worker:
        assert process(worker) == first
        worker.request(ASK, 60)
    workers.close()


@pytest.mark.nightly
def test_a_prepared_worker_serves_the_engine_and_a_wrong_name_is_left_to_who_asks_next() -> None:
    """An engine's process is kept once it has imported what a run needs; of nonsense nothing is kept or raised."""
    workers = Workers()
    prepare("projection[dt=1e-3", workers)
    prepare("no_such_engine", workers)
    for name, asked in (("projection", 1), ("truth", 2)):  # its settings, and of the truth the import of datasets
        prepare(name, workers)
        with workers.lend(name) as worker:
            assert worker._asked == asked
    workers.close()


def test_the_last_worker_of_an_engine_is_lent_again() -> None:
    """One thread that measures an engine again and again has one process, though the pool has more of that engine."""
    workers = Workers()
    idle: list[Any] = [Mock(), Mock(), Mock()]
    for name, worker in zip(("truth", "truth", "projection"), idle, strict=True):
        workers.keep(name, worker)
    for _ in range(2):
        with workers.lend("truth") as worker:
            assert worker is idle[1]
    workers.close()


def test_a_worker_with_which_something_went_wrong_is_ended() -> None:
    """A worker is not kept when the block that borrowed it fails."""
    workers = Workers()
    with pytest.raises(RuntimeError), workers.lend("truth") as worker:
        raise RuntimeError
    assert worker._process.poll() is not None


@pytest.mark.drill
def test_idle_workers_are_bounded_and_end_with_their_owner() -> None:
    """Of many idle workers the oldest are ended, and all are when nobody holds them any more."""
    workers = Workers()
    lent = [workers.take(str(number)) for number in range(10)]
    for number, worker in enumerate(lent):
        workers.keep(str(number), worker)
    assert [worker._process.poll() is None for worker in lent] == [False] * 2 + [True] * 8
    del workers
    assert all(worker._process.poll() is not None for worker in lent)


@pytest.mark.drill
def test_a_study_starts_each_engine_once(tmp_path: Path) -> None:
    """Settings, runs and further runs of one engine are asked of the processes that were started first."""
    runner = Runner(Store(tmp_path), jobs=1)
    resolve([("projection", {})], runner.workers)
    ((_, worker),) = runner.workers._idle
    for speed in (3.0, 4.0):
        case = single_case("sphere_in_cylinder", {"speed": speed}, "projection", until=0.02, every=0.01, time_limit=60)
        (result,) = runner.run([case]).values()
        assert result.status == "done"
        assert [idle for _, idle in runner.workers._idle] == [worker]
