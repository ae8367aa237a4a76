"""Forks processes of Dask, so that tests pay for importing Dask once.

Each line of standard input is a command line in JSON; its process id is printed.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys

from distributed.cli import dask_scheduler, dask_worker

import proofroll_cluster.task  # noqa: F401 -- what workers of tests import as soon as they run anything

MAIN = {"scheduler": dask_scheduler.main, "worker": dask_worker.main}

if __name__ == "__main__":
    for line in sys.stdin:
        name, *words = json.loads(line)
        if not (child := os.fork()):
            os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
            os.dup2(os.open(os.devnull, os.O_RDONLY), sys.stdin.fileno())
            MAIN[name](words)  # which ends the process
        print(child, flush=True)
    with contextlib.suppress(ChildProcessError):
        while True:
            os.wait()
