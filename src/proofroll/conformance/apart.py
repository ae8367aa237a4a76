"""Checks in processes of their own, one for each formulation and preset of an engine.

What an engine sets for its whole process, as JAX its precision, is then set by one formulation alone.
"""

from __future__ import annotations

import atexit
import multiprocessing
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any
from unittest import SkipTest

_PASSED, _SKIPPED, _FAILED = "passed", "skipped", "failed"
_processes: dict[str, ProcessPoolExecutor] = {}


def run_apart(engine: Any, key: str, name: str) -> None:
    """Runs the check of this name in the process for ``key``, which stays for the next one.

    Raises:
        AssertionError: it failed there, or the process ended.
        SkipTest: it has nothing to look at.
    """
    place = f"{engine.__module__}.{engine.__qualname__}: {key}"
    if place not in _processes:
        _processes[place] = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
        atexit.register(_processes[place].shutdown, wait=False, cancel_futures=True)
    try:
        how, text = _processes[place].submit(_outcome, engine, name).result()
    except BrokenProcessPool:
        del _processes[place]
        raise AssertionError("its process ended without a word, as an engine's own crash ends it") from None
    if how == _SKIPPED:
        raise SkipTest(text)
    if how == _FAILED:
        raise AssertionError(text)


def _outcome(engine: Any, name: str) -> tuple[str, str]:
    """Outcome of a check with its text, in the process that runs it."""
    from proofroll.conformance.checks import runs, told

    run: Callable[[], None] = dict(runs(engine))[name]
    try:
        run()
    except SkipTest as why:
        return _SKIPPED, str(why)
    except Exception as error:
        return _FAILED, told(error)
    return _PASSED, ""
