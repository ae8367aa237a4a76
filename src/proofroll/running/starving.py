"""How long a process was ready to compute while others had the processor: no limit of time may count that.

On a machine with other work a wall clock says more about that work than about an engine. The kernel counts how long
every thread waited in the queue of a processor (``/proc/PID/task/TID/schedstat``, second number); a process that hangs
asleep waits in none, so that a limit of wall seconds less these still ends it.
"""

from __future__ import annotations

import contextlib
from pathlib import Path

from proofroll.running.memory import descendants


def starved(process: int) -> float:
    """Seconds that the process or a descendant of it, whichever waited longest, was ready and had no processor.

    0 where the system does not count it; then a limit of time is one of wall seconds.
    """
    longest = 0
    for one in (process, *descendants(process)):
        with contextlib.suppress(OSError, ValueError, IndexError):  # it has just ended, or there is no such file
            for task in Path(f"/proc/{one}/task").iterdir():
                longest = max(longest, int((task / "schedstat").read_text(encoding="ascii").split()[1]))
    return longest * 1e-9
