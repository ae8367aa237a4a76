"""Runs cases on other machines, through a Dask cluster.

The runner stays the only planner: it sends cases to the cluster instead of its own threads. The cluster never holds
more cases than keep its workers busy, and returns each result as the runner's own worker process would.
"""

import contextlib
import dataclasses
import logging
import os
import re
import sys
import threading
import time
import uuid
import weakref
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, TypeVar

from proofroll.core.errors import InputError, Missing, ProofrollError
from proofroll.files.data_folders import data_folder
from proofroll.files.scene_file import read_scene_file, scene_folder
from proofroll.files.scene_sources import parts_of, source_of
from proofroll.running import cluster_task
from proofroll.running.case import Case, Result, Status
from proofroll.running.memory import VARIABLE, memory_limit
from proofroll.running.process import WorkerDied
from proofroll.running.process_end import interrupt_held

# Most cases that the scheduler holds: _AHEAD per thread (one runs, one waits) plus _AT_LEAST, so that a cluster that
# grows with its load sees waiting work.
_AHEAD, _AT_LEAST = 2, 64
# Most results that are fetched together.
_TOGETHER = 64
# Interval at which the threads of a cluster are counted, as workers come and go [s].
_COUNTED = 2.0
# Time limit for an answer of a scheduler [s].
_PATIENCE = 30.0
# Time limit for the start of a scheduler on this machine, which may be busy [s].
_STARTS = 300.0

Item = TypeVar("Item")
Found = TypeVar("Found")
Make = Callable[[Path], Result]
Arrived = Callable[[Case, Make], object]


class Cluster:
    """A Dask cluster on which cases run.

    Args:
        address: of a scheduler, ``tcp://…`` or ``tls://…``; or ``local``, ``local:4`` for 4 workers on this machine.
        task: function that a worker calls for a case; tests replace it to measure the overhead.

    Raises:
        InputError: the address is invalid, or no scheduler answers there.
        Missing: Dask is not installed.
    """

    def __init__(self, address: str, task: Callable[..., Any] = cluster_task.run_case) -> None:
        self.address = address
        memory = memory_limit() if VARIABLE in os.environ else None
        self._asked = cluster_task.Asked(uuid.uuid4().hex[:12], cluster_task.installed(), memory)
        self._task = task
        self._client, started = _connected(address)
        self._close = weakref.finalize(self, _end, self._client, started, self._asked.command)
        self._room = threading.Condition()
        self._sent: dict[Any, tuple[Case, Arrived]] = {}
        self._threads, self._counted = 0, -_COUNTED
        self._stopped = False

    @property
    def threads(self) -> int:
        """Number of cases that it runs at once, counted at most two seconds ago."""
        self._most()
        return self._threads

    def serve(
        self, take: Callable[[str | None], Case | None], arrived: Arrived, failed: Callable[[Exception], None]
    ) -> None:
        """Runs cases for a runner until there are no more.

        Args:
            take: gives the next case, preferably of the named engine; None: there are no more.
            arrived: called in a thread of Dask's with a case and a function that writes its trajectory and returns its
                result.
            failed: called with an error that ends the whole run.
        """
        self._stopped = False
        engine = None
        try:
            while self._has_room() and (case := take(engine)) is not None:
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
                future = self._submit(self._task, (content, files), case.key)
                with self._room:
                    self._sent[future] = case, arrived
                future.add_done_callback(partial(self._come, failed))
        except Exception as error:
            failed(self._gone(error))

    def map(self, function: Callable[[Item], Found], items: Sequence[Item]) -> Iterator[tuple[str, Found]]:
        """Yields the machine's name and a function's result for each item, in order, from watched processes.

        The function and its results must be picklable.

        Raises:
            ProofrollError: a process or the scheduler ended, or the function raised it.
        """
        waiting: list[Any] = []
        rest = iter(items)
        self._stopped = False
        try:
            while True:
                for item in rest:
                    waiting.append(self._submit(cluster_task.call, (function, item), str(len(waiting))))
                    if len(waiting) >= self._most():
                        break
                if not waiting:
                    return
                try:
                    yield waiting.pop(0).result()
                except ProofrollError:
                    raise
                except Exception as error:
                    raise self._gone(error) from None
        finally:
            self.stop(waiting)

    def stop(self, futures: Sequence[Any] = ()) -> None:
        """Ends the running and waiting cases of this command on the cluster."""
        with self._room:
            self._stopped = True
            futures = [*futures, *self._sent]
            self._sent.clear()
            self._room.notify_all()
        if futures and self._client.status == "running":
            with contextlib.suppress(Exception):  # a scheduler that is gone needs no end
                self._client.cancel(futures)
                self._client.run(cluster_task.end, self._asked.command, on_error="ignore")

    def _submit(self, task: Callable[..., Any], arguments: tuple[Any, ...], name: str) -> Any:
        key = f"proofroll-{self._asked.command}-{uuid.uuid4().hex[:8]}-{name}"
        if self._client.status != "running":
            raise self._gone(None)
        return self._client.submit(task, self._asked, *arguments, key=key, pure=False)

    def _has_room(self) -> bool:
        """Waits until another case may be sent; False if the cluster was stopped."""
        most = self._most()
        with self._room:
            while not self._stopped and len(self._sent) >= most:
                self._room.wait(_COUNTED)
            return not self._stopped

    def _most(self) -> int:
        """Largest number of cases that the cluster may hold."""
        if time.monotonic() - self._counted > _COUNTED:
            self._threads, self._counted = sum(self._client.nthreads().values()), time.monotonic()
        return _AHEAD * self._threads + _AT_LEAST

    def _come(self, failed: Callable[[Exception], None], future: Any) -> None:
        """Fetches the result of a finished case with all others finished by now, which costs no more than one.

        Each result goes to the run that sent its case; that run may be over when Dask reports a result fetched before.
        """
        with self._room:
            if future not in self._sent:  # fetched already, with others
                return
            done = [item for item in self._sent if item.status == "finished"][:_TOGETHER]
            done = done if future in done else [future]
            sent = [(item, *self._sent.pop(item)) for item in done]
            self._room.notify()
        self._fetch(sent, failed)

    def _fetch(self, sent: Sequence[tuple[Any, Case, Arrived]], failed: Callable[[Exception], None]) -> None:
        """Fetches results and hands each, with its case, to the run that sent it."""
        try:
            answers = self._client.gather([future for future, _, _ in sent])
        except Exception as error:
            from distributed.scheduler import KilledWorker

            if not isinstance(error, KilledWorker):
                failed(self._gone(error))
            elif len(sent) > 1:  # one of them killed its workers: find it by fetching each alone
                for sent_future in sent:
                    self._fetch([sent_future], failed)
            else:
                lost = f"each of {error.allowed_failures + 1} workers of the cluster that ran it was lost"
                ((_, case, arrived),) = sent
                arrived(case, partial(_raise, WorkerDied(Status.CRASHED, lost)))
            return
        for (_, case, arrived), (content, data) in zip(sent, answers, strict=True):
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
    try:
        from distributed import Client, LocalCluster
    except ModuleNotFoundError as error:
        raise Missing(f"--scheduler needs Dask ({error.name} is missing): pip install 'proofroll[cluster]'") from None
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
            client.run(cluster_task.end, command, on_error="ignore")
        client.close(timeout=_PATIENCE)
        if started is not None:
            started.close(timeout=_PATIENCE)
