"""Measures the speed of cases in worker processes, one at a time, so that nothing of ours runs beside them."""

import dataclasses
from typing import Self

from proofroll.core.errors import ProofrollError
from proofroll.core.limits import STUDY_TIME_LIMIT
from proofroll.running.case import Case
from proofroll.running.process import Worker, WorkerDied
from proofroll.running.worker_pool import Workers

# Long enough for the clock and for caches to settle, short enough for many rounds.
SECONDS = 0.05


class Stopwatch:
    """Clock with one worker per engine, kept warm between the rounds of :func:`proofroll.running.timing.interleaved`.

    They come from ``workers`` and go back there.
    """

    def __init__(self, workers: Workers | None = None) -> None:
        self._lent = workers or Workers()
        self._workers: dict[str, Worker] = {}

    def __call__(self, case: Case, seconds: float | None = None) -> float | None:
        """Wall seconds per simulated second of a case, from clean runs that only advance; None: it did not run.

        They last ``seconds``, by default :data:`SECONDS`.
        """
        name = case.engine.name
        if name not in self._workers:
            try:
                self._workers[name] = self._lent.take(name)
            except ProofrollError:  # another interpreter that does not serve any more
                return None
        request = {"do": "time", "case": dataclasses.asdict(case), "seconds": seconds or SECONDS}
        try:
            rate = self._workers[name].ask(request, STUDY_TIME_LIMIT).get("seconds_per_second")
        except WorkerDied:
            self._workers.pop(name).close()
            return None
        except BaseException:  # its answer is still to come, and would be taken for the next one's
            self._workers.pop(name).close()
            raise
        return float(rate) if rate is not None else None

    def close(self) -> None:
        """Gives the workers back to their lender, or ends them."""
        for name, worker in self._workers.items():
            self._lent.keep(name, worker)
        self._workers.clear()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
