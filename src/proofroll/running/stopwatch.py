"""Measures the speed of cases in worker processes, one at a time, so that no other case of ours runs beside them."""

import dataclasses
from typing import Self

from proofroll.core.errors import ProofrollError
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.running.case import Case
from proofroll.running.idle_workers import Workers
from proofroll.running.process import Worker, WorkerDied

# Default length of a measurement [s]: long enough for the clock and the caches, short enough for many rounds.
SECONDS = 0.05


class Stopwatch:
    """Measures speeds with one worker per engine, kept warm for :func:`proofroll.running.timing.time_in_rounds`.

    The workers are borrowed from ``workers``.
    """

    def __init__(self, workers: Workers | None = None) -> None:
        self._lent = workers or Workers()
        self._workers: dict[str, Worker] = {}

    def __call__(self, case: Case, seconds: float | None = None) -> float | None:
        """Wall time per simulated second of a case, from clean runs that only advance; None: they failed.

        The runs take ``seconds`` of wall time, by default :data:`SECONDS`.
        """
        name = case.engine.name
        if name not in self._workers:
            try:
                self._workers[name] = self._lent.take(name)
            except ProofrollError:  # the engine's interpreter is gone
                return None
        request = {"do": "time", "case": dataclasses.asdict(case), "seconds": seconds or SECONDS}
        try:
            rate = self._workers[name].ask(request, STUDY_TIME_LIMIT).get("seconds_per_second")
        except WorkerDied:
            self._workers.pop(name).close()
            return None
        except BaseException:  # the late answer would be taken for that of the next request
            self._workers.pop(name).close()
            raise
        return float(rate) if rate is not None else None

    def close(self) -> None:
        """Returns the workers to their pool."""
        for name, worker in self._workers.items():
            self._lent.keep(name, worker)
        self._workers.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
