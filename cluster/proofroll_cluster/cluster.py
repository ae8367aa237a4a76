"""Runs cases on other machines, through a Dask cluster: a ``proofroll.running.cluster.Cluster``.

The runner stays the only planner: it sends cases to the cluster instead of its own threads. Each result comes back as
the runner's own worker process would give it.
"""

import contextlib
import dataclasses
import logging
import os
import re
import sys
import threading
import uuid
import weakref
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

from distributed import Client, LocalCluster
from distributed.scheduler import KilledWorker

from proofroll.core.errors import InputError, ProofrollError
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import read_scene_file, scene_folder
from proofroll.files.scene_sources import parts_of, source_of
from proofroll.running.case import Case, Result, Status
from proofroll.running.cluster import Arrived, Found, Item
from proofroll.running.memory import VARIABLE, memory_limit
from proofroll.running.process import WorkerDied
from proofroll.running.process_end import interrupt_held
from proofroll_cluster import task as worker_task

# Most cases that the scheduler holds, which bounds its memory.
_AHEAD = 1000
# Time limit for an answer of a scheduler [s].
_PATIENCE = 30.0
# Time limit for the start of a scheduler on this machine, which may be busy [s].
_STARTS = 300.0


class Cluster:
    """A Dask cluster on which cases run.

    Args:
        address: of a scheduler, ``tcp://…`` or ``tls://…``; or ``local``, ``local:4`` for 4 workers on this machine.
        task: function that a worker calls for a case; tests replace it to measure the overhead.

    Raises:
        InputError: the address is invalid, or no scheduler answers there.
    """

    def __init__(self, address: str, task: Callable[..., Any] = worker_task.run_case) -> None:
        self.address = address
        memory = memory_limit() if VARIABLE in os.environ else None
        self._asked = worker_task.Asked(uuid.uuid4().hex[:12], worker_task.installed(), memory)
        self._task = task
        self._client, started = _connected(address)
        self._close = weakref.finalize(self, _end, self._client, started, self._asked.command)
        self._executor: Any = None

    @property
    def threads(self) -> int:
        """Number of cases that it runs at once."""
        return sum(self._client.nthreads().values())

    def serve(
        self, take: Callable[[str | None], Case | None], arrived: Arrived, failed: Callable[[Exception], None]
    ) -> None:
        """Sends cases of a runner until there are no more; results arrive in a thread of Dask's."""
        room, executor = threading.Semaphore(_AHEAD), self._new_executor()
        engine = None
        try:
            while (case := take(engine)) is not None:
                engine = case.engine.name
                content = dataclasses.asdict(case) | {"timed": False}
                try:
                    files = _files(case)
                except OSError as error:  # an error of this case, not of the scheduler
                    unread = InputError("scene", case.scene, f"{error.filename} cannot be read: {error.strerror}")
                    arrived(case, partial(_raise, unread))
                    continue
                except InputError as error:
                    arrived(case, partial(_raise, error))
                    continue
                room.acquire()
                if self._client.status != "running":
                    raise self._gone(None)
                future = executor.submit(self._task, self._asked, content, files)
                future.add_done_callback(partial(self._come, room, case, arrived, failed))
        except Exception as error:
            failed(self._gone(error))

    def map(self, function: Callable[[Item], Found], items: Sequence[Item]) -> Iterator[tuple[str, Found]]:
        """Yields the machine's name and a function's result for each item, in order, from watched processes."""
        try:
            yield from self._new_executor().map(partial(worker_task.call, self._asked, function), items)
        except BaseException as error:
            self.stop()
            raise self._gone(error) if isinstance(error, Exception) else error from None

    def stop(self) -> None:
        """Ends the running and waiting cases of this command on the cluster."""
        if self._executor is not None and self._client.status == "running":
            with contextlib.suppress(Exception):  # a scheduler that is gone needs no end
                self._executor.shutdown(wait=False)
                self._client.run(worker_task.end, self._asked.command, on_error="ignore")

    def _new_executor(self) -> Any:
        """Dask's ``concurrent.futures`` executor of one run; cases are never taken from an earlier run."""
        self._executor = self._client.get_executor(pure=False)
        return self._executor

    def _come(
        self,
        room: threading.Semaphore,
        case: Case,
        arrived: Arrived,
        failed: Callable[[Exception], None],
        future: Future[tuple[dict[str, Any], bytes | None]],
    ) -> None:
        """Hands the result of a finished case to the run that sent it."""
        room.release()
        try:
            content, data = future.result()
        except KilledWorker as error:
            lost = f"each of {error.allowed_failures + 1} workers of the cluster that ran it was lost"
            arrived(case, partial(_raise, WorkerDied(Status.CRASHED, lost)))
        except Exception as error:
            failed(self._gone(error))
        else:
            arrived(case, partial(_made, content, data))

    def _gone(self, error: Exception | None) -> ProofrollError:
        """Error that ends a run because of the cluster, in one line."""
        if isinstance(error, ProofrollError):
            return error
        if error is None or isinstance(error, (CancelledError, OSError)):
            gone = f"the Dask scheduler at {self.address} is gone"
            return ProofrollError(f"{gone}; finished runs are kept, and the same command continues from there")
        text = " ".join(str(error).split())[:200]
        return ProofrollError(f"the workers of {self.address} cannot run a case ({type(error).__name__}: {text})")


def _raise(error: Exception, _: Path) -> Result:
    raise error


def _made(content: dict[str, Any], data: bytes | None, path: Path) -> Result:
    """Result sent by a worker, after its trajectory was written to ``path``."""
    if data is not None:
        path.write_bytes(data)
    result = Result.from_dict(content)
    return dataclasses.replace(result, trajectory=result.trajectory and path.name)


def _files(case: Case) -> dict[str, bytes]:
    """Files of a scene that is not part of proofroll, by name, to be sent to the workers; its folder or robot file."""
    if (source := source_of(case.scene)) is not None:
        if parts_of(case.scene)[1]:
            raise InputError(
                "--scheduler", case.scene, "a controller's file is not sent to other machines; leave it out"
            )
        return {source[1].name: source[1].read_bytes()}
    if not case.scene or (folder := scene_folder(case.scene)).parent == data_folder("models"):
        return {}
    contents = {"scene.toml": (folder / "scene.toml").read_bytes()}
    return contents | {name: (folder / name).read_bytes() for name in read_scene_file(case.scene).files}


def _connected(address: str) -> tuple[Any, Any]:
    """Client of the scheduler, and the cluster that was started for it, or None."""
    local = re.fullmatch(r"local(?::(\d+))?", address)
    if not local and not re.match(r"\w+://.", address):
        raise InputError("--scheduler", address, "give the address of a Dask scheduler, tcp://…, or local, local:4")
    for name in [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]:
        logging.getLogger(name).disabled = True  # our own message has what matters
    # The resource tracker of multiprocessing unblocks Ctrl-C when it starts, so it must run before Ctrl-C is held.
    sys.warnoptions.append("ignore")  # inherited by the tracker: leaks do not matter when all processes end at once
    resource_tracker.ensure_running()
    sys.warnoptions.pop()
    try:
        if not local:
            return Client(address, timeout=_PATIENCE, set_as_default=False), None
        count = int(local[1] or os.cpu_count() or 1)
        if not count:
            raise InputError("--scheduler", address, "give at least one worker: local:1")
        with interrupt_held():
            started = LocalCluster(
                n_workers=count,
                threads_per_worker=1,
                dashboard_address="127.0.0.1:0",
                memory_limit=None,
                silence_logs=logging.CRITICAL + 1,
            )
            return Client(started, timeout=_STARTS, set_as_default=False), started
    except (OSError, ValueError) as error:
        text = " ".join(str(error).split())[:120]
        raise InputError("--scheduler", address, f"no Dask scheduler answers there ({text})") from None


def _end(client: Any, started: Any, command: str) -> None:
    """Disconnects from a cluster, after ending the command's processes there or the cluster that was started here."""
    with contextlib.suppress(Exception):
        if client.status == "running" and started is None:
            client.run(worker_task.end, command, on_error="ignore")
        client.close(timeout=_PATIENCE)
        if started is not None:
            started.close(timeout=_PATIENCE)
