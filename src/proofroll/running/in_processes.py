"""A function of many items, computed in several processes."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import active_children, get_context, parent_process
from typing import TypeVar

from proofroll.running.process_end import end_with, interrupt_held

Item = TypeVar("Item")
Found = TypeVar("Found")


def in_processes(function: Callable[[Item], Found], items: Sequence[Item], workers: int) -> Iterator[Found]:
    """Yields a function's result for each item, in order, computed in ``workers`` processes; 1: in this one.

    The function and its results must be picklable. Ctrl-C ends the processes.
    """
    if workers == 1:
        yield from map(function, items)
        return
    with process_pool(workers) as pool:
        try:
            # Not pool.map: when interrupted it cancels the rest, and the pool complains when its processes are killed.
            with interrupt_held():
                futures = [pool.submit(function, item) for item in items]
            for future in futures:
                yield future.result()
        except BaseException:
            for process in active_children():
                process.kill()
            raise


def process_pool(workers: int) -> ProcessPoolExecutor:
    """Pool of processes that end with this process.

    They are spawned, not forked: a parent that shows progress has threads, and a fork would copy their held locks.
    """
    return ProcessPoolExecutor(workers, get_context("spawn"), initializer=_end_with_pool)


def _end_with_pool() -> None:
    """Makes a process of a pool end with its parent.

    Otherwise it would wait for ever, on a pipe that all of the pool's processes hold open, if the parent is killed.
    """
    owner = parent_process()
    if owner is not None and owner.pid is not None:
        end_with(owner.pid)
