"""Worker processes of tests, forked from one with common modules already imported, which halves their start.

On Linux only; elsewhere, in other interpreters and in tests marked ``own_workers`` a worker starts as usual. A forked
worker behaves the same from its first line on: its pipes, folder, environment, session and parent are those of a
started process, and it has loaded no engine, scene or announcement.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import importlib
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from proofroll.files.trajectory_file import import_xarray
from proofroll.running import process, worker

_MODULE = "proofroll.running.worker"
# Modules that runs, truths and certificates need; no engine, scene or kind of element.
_IMPORTED = (
    "proofroll.core.first_steps",
    "proofroll.core.multi_element",
    "proofroll.core.truth",
    "proofroll.files.scene_file",
    "proofroll.running.loading",
    "proofroll.running.recording",
    "pydantic.dataclasses",
    "pydantic.types",
    "scipy.integrate",
    "scipy.interpolate",
    "scipy.spatial.transform",
)
# Python reads these variables when it starts: if one differs, a new process is started instead of a fork.
_READ_AT_START = ("PYTHONHASHSEED", "PYTHONWARNINGS", "PYTHONSAFEPATH", "PYTHONHOME", "PYTHONDONTWRITEBYTECODE")
_SET_CHILD_SUBREAPER = 36  # <linux/prctl.h>


class Forked:
    """Forked process, with the part of :class:`subprocess.Popen` that a worker's parent uses."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._lock = threading.Lock()

    def _reap(self, options: int) -> int | None:
        with self._lock:
            if self.returncode is None:
                pid, status = os.waitpid(self.pid, options)
                if pid:
                    self.returncode = os.waitstatus_to_exitcode(status)
            return self.returncode

    def poll(self) -> int | None:
        """Exit code of the process; None: it still runs."""
        return self._reap(os.WNOHANG)

    def wait(self) -> int | None:
        """Waits for the end of the process; returns its exit code."""
        return self._reap(0)


class Forks:
    """The process from which workers are forked; started with the first worker."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._template: subprocess.Popen[bytes] | None = None
        self._began_with: dict[str, str | None] = {}

    @contextlib.contextmanager
    def lent(self) -> Iterator[None]:
        """Context in which workers of this interpreter are forked."""
        if sys.platform != "linux":
            yield
            return
        before = process.subprocess
        process.subprocess = SimpleNamespace(Popen=self._popen, PIPE=subprocess.PIPE)
        try:
            yield
        finally:
            process.subprocess = before

    def _popen(self, words: Sequence[Any], *, env: Mapping[str, str], pass_fds: Sequence[int], **more: Any) -> Any:
        at_start = {name: env.get(name) for name in _READ_AT_START}
        with self._lock:
            if self._template is None:
                self._begin(env)
                self._began_with = at_start
            if list(map(str, words[:3])) != [sys.executable, "-m", _MODULE] or at_start != self._began_with:
                return subprocess.Popen(words, env=env, pass_fds=pass_fds, **more)
            request = {"cwd": os.getcwd(), "env": dict(env), "parent": os.getpid()}
            _adopt(1)
            try:
                descriptors = [more["stdin"], more["stdout"], *pass_fds]
                socket.send_fds(self._line, [json.dumps(request).encode()], descriptors)
                pid = int(self._line.recv(64))
            finally:
                _adopt(0)
        return Forked(pid)

    def _begin(self, env: Mapping[str, str]) -> None:
        self._line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)  # which keeps requests apart
        own = {**env, "PYTHONPATH": str(Path(process.__file__).parents[2])}  # this proofroll, installed or not
        with theirs:
            self._template = subprocess.Popen(
                [sys.executable, str(Path(__file__)), str(theirs.fileno())],
                env=own,
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,
            )

    def close(self) -> None:
        """Ends the process from which workers are forked."""
        if self._template is not None:
            self._line.close()
            self._template.wait()
            self._template = None


def _adopt(yes: int) -> None:
    """Makes this process adopt descendants whose parent has ended (1), or not (0)."""
    ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, yes, 0, 0, 0)


def _serve(line: socket.socket) -> None:
    """Forks a worker for each request, by an intermediate process that ends, so that the requester adopts it."""
    for module in _IMPORTED:
        importlib.import_module(module)
    import_xarray()
    gc.freeze()  # a collection would copy the pages that all share
    while True:
        message, descriptors, *_ = socket.recv_fds(line, 1 << 20, 4)
        if not message:
            return
        if not (between := os.fork()):
            if os.fork():
                os._exit(0)
            request = json.loads(message)
            _as_if_started(line, request, *descriptors[:2])
            worker.main(descriptors[2], request["parent"], descriptors[3])
            return
        for descriptor in descriptors:
            os.close(descriptor)
        os.waitpid(between, 0)


def _as_if_started(line: socket.socket, request: dict[str, Any], stdin: int, log: int) -> None:
    """Does the steps of the system and of Python that precede the first line of a started worker."""
    os.setsid()
    while os.getppid() != request["parent"]:
        os.kill(request["parent"], 0)  # raises, which ends this process, if the requester has ended
        time.sleep(0.001)
    line.sendall(b"%d" % os.getpid())
    line.close()
    os.chdir(request["cwd"])
    os.environ.clear()
    os.environ.update(request["env"])
    for ours, standard in ((stdin, 0), (log, 1), (log, 2)):
        os.dup2(ours, standard)
    os.close(stdin)
    os.close(log)
    sys.path[:0] = filter(None, request["env"].get("PYTHONPATH", "").split(os.pathsep))


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))
