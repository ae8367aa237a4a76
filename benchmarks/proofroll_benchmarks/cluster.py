"""Cost of a cluster besides its cases: many that compute nothing, planned, sent and stored as any others."""

from __future__ import annotations

import contextlib
import dataclasses
import resource
import socket
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from proofroll.running.case import Case, EngineFacts, Result, Status
from proofroll.running.runner import Runner
from proofroll.running.store import Store
from proofroll_cluster.cluster import Cluster
from proofroll_cluster.task import Asked

MB = 1e6


def idle(_: Asked, content: dict[str, Any], __: Mapping[str, bytes]) -> tuple[dict[str, Any], None]:
    """Work on a case here: a wait, without a processor to share."""
    time.sleep(content["engine"]["settings"]["seconds"])
    result = Result(Status.REFUSED, "it computes nothing", versions={"idle": "1"}, host=socket.gethostname())
    return dataclasses.asdict(result), None


def bench_cluster(
    scheduler: str, cases: int, seconds: float, progress: Callable[[str], None] | None = None
) -> dict[str, Any]:
    """Runs cases that only wait, through the runner and into a store.

    Args:
        scheduler: as of ``--scheduler``; or ``threads``: one in this process, with two threads for workers.
        cases: number of cases.
        seconds: wait of each [s].
        progress: called after each of them.

    Returns:
        ``cases``, ``threads`` of the cluster, ``seconds`` of each, ``wall`` and ``processor`` seconds of this process,
        ``memory`` that it had at most beyond what it began with [MB], ``stored`` bytes, and ``efficiency``: the part of
        the threads' wall time in which they waited for a case rather than for the next one; None without waiting.
    """
    with contextlib.ExitStack() as stack:
        if scheduler == "threads":
            from distributed import LocalCluster

            own = stack.enter_context(
                LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address="127.0.0.1:0")
            )
            scheduler = own.scheduler_address
        cluster = Cluster(scheduler, idle)
        threads = cluster.threads
        name = stack.enter_context(tempfile.TemporaryDirectory())
        store = Store(Path(name))
        runner = Runner(store, cluster=cluster)
        warm = runner.run(_cases(4 * threads, 0.0, first=-4 * threads))
        assert all(result.status is Status.REFUSED for result in warm.values())
        before, wall, processor = _peak(), time.perf_counter(), time.process_time()
        runner.run(_cases(cases, seconds), lambda *_: progress("cases") if progress else None)
        wall, processor = time.perf_counter() - wall, time.process_time() - processor
        stored = sum(path.stat().st_size for path in Path(name).iterdir())
    return {
        "cases": cases,
        "threads": threads,
        "seconds": seconds,
        "wall": wall,
        "processor": processor,
        "memory": _peak() - before,
        "stored": stored,
        "efficiency": cases * seconds / (wall * threads) if seconds else None,
    }


def _cases(count: int, seconds: float, first: int = 0) -> Iterator[Case]:
    facts = EngineFacts("idle", "1", "none", {"seconds": seconds}, None, None)
    for number in range(first, first + count):
        yield Case("sphere_in_cylinder", {"speed": float(number)}, "none", facts, 1.0, 0.1)


def _peak() -> float:
    """Largest memory of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / MB
