"""A function of many arguments, computed in several processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import active_children, get_context, parent_process
from typing import TypeVar

from proofroll.running.ending import end_with, interrupt_held

Item = TypeVar("Item")
Found = TypeVar("Found")


def in_processes(function: Callable[[Item], Found], items: Sequence[Item], workers: int) -> Iterator[Found]:
    """Results of a function for each item, in order, from some processes; 1 computes in this one.

    The function and its results can be pickled. Ctrl-C ends the processes that compute.
    """
    if workers == 1:
        yield from map(function, items)
        return
    # Not forked: a parent that shows progress has threads, and a fork copies their locks as they are.
    with ProcessPoolExecutor(workers, get_context("spawn"), initializer=end_with_pool) as pool:
        try:
            # Not map, which cancels the rest when interrupted: a pool whose processes are then ended complains.
            with interrupt_held():
                futures = [pool.submit(function, item) for item in items]
            for one in futures:
                yield one.result()
        except BaseException:
            for process in active_children():
                process.kill()
            raise


def end_with_pool() -> None:
    """Variant of :func:`proofroll.running.ending.end_with` for a process of a ``ProcessPoolExecutor``.

    Such a process waits on a pipe that all of them hold open, and so for ever when their parent is killed.
    """
    owner = parent_process()
    if owner is not None and owner.pid is not None:
        end_with(owner.pid)
