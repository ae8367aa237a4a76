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


def run_apart(
    run: Callable[[Any, str], None], failure_text: Callable[[Exception], str], engine: Any, key: str, name: str
) -> None:
    """Runs the check of this name in the process for ``key``, which stays for the next one.

    Args:
        run: runs a check by the engine and the check's name; a function of a module.
        failure_text: text of a failed check; a function of a module.
        engine: the engine's class.
        key: names the process among those of the engine.
        name: of the check.

    Raises:
        AssertionError: it failed there, or the process ended.
        SkipTest: it has nothing to look at.
    """
    place = f"{engine.__module__}.{engine.__qualname__}: {key}"
    if place not in _processes:
        _processes[place] = ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn"))
        atexit.register(_processes[place].shutdown, wait=False, cancel_futures=True)
    try:
        how, text = _processes[place].submit(_outcome, run, failure_text, engine, name).result()
    except BrokenProcessPool:
        del _processes[place]
        raise AssertionError("its process ended without a word, as an engine's own crash ends it") from None
    if how == _SKIPPED:
        raise SkipTest(text)
    if how == _FAILED:
        raise AssertionError(text)


def _outcome(
    run: Callable[[Any, str], None], failure_text: Callable[[Exception], str], engine: Any, name: str
) -> tuple[str, str]:
    """Outcome of a check with its text, in the process that runs it."""
    try:
        run(engine, name)
    except SkipTest as why:
        return _SKIPPED, str(why)
    except Exception as error:
        return _FAILED, failure_text(error)
    return _PASSED, ""
