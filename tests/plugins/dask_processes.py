"""Forks processes of Dask: the words of each command line come as a line of standard input, its number goes back.

To import Dask costs each of them more than all that tests want of it.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys

from distributed.cli import dask_scheduler, dask_worker

import proofroll.running.cluster_task  # noqa: F401 -- what workers of tests import as soon as they run anything

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
