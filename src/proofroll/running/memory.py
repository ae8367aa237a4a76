"""Limit on the memory of a worker and its descendants, which are killed beyond it.

Resident memory is watched from outside, at each tick of the parent. A limit on the address space instead would kill
engines that merely reserve it (just-in-time compilers, arenas, threads' stacks), and allocations would fail inside
libraries without a clear message. If memory fills faster than a tick, the kernel kills: workers offer themselves first
(``oom_score_adj``).
"""

import contextlib
import math
import os
from pathlib import Path

from proofroll.core.errors import InputError

VARIABLE = "PROOFROLL_MEMORY"
# More than ten times what our own engines and truths need; the most was 0.23 GB, for a truth with slip.
_USUAL_GB = 4.0
# One engine must leave a small machine to the others.
_SHARE = 0.5
GB = 1e9


def memory_limit() -> float:
    """Memory that one worker with its descendants may use [GB].

    The value of ``PROOFROLL_MEMORY``, or 4 GB and at most half the memory of the machine.

    Raises:
        InputError: the variable holds no positive number.
    """
    text = os.environ.get(VARIABLE)
    if text is None:
        return min(_USUAL_GB, _SHARE * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / GB)
    try:
        limit = float(text)
    except ValueError:
        limit = math.nan
    if not limit > 0:
        raise InputError(VARIABLE, text, "give a positive number of GB, or leave it out")
    return limit


def resident_gb(process: int) -> float:
    """Resident memory of a process and its descendants [GB]; 0 where the system has no ``/proc``."""
    pages = 0
    for member in (process, *descendants(process)):
        with contextlib.suppress(OSError, ValueError, IndexError):  # it has just ended
            pages += int(Path(f"/proc/{member}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / GB


def descendants(process: int) -> list[int]:
    """Process numbers of the children of a process, and of theirs; none where the system has no ``/proc``."""
    processes: list[int] = []
    queue = [process]
    while queue:
        with contextlib.suppress(OSError):
            for task in Path(f"/proc/{queue.pop()}/task").iterdir():
                children = (task / "children").read_text(encoding="ascii").split()
                processes += map(int, children)
                queue += map(int, children)
    return processes


def volunteer() -> None:
    """Makes the kernel choose this process first when memory runs out, and prevents core files."""
    import resource

    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
