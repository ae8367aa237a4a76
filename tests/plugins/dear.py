"""A line at the end about tests that take long and are no drills; none fails, for no test hangs on a clock."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

# Processor time [s] above which a test is a drill (CONTRIBUTING.md).
LIMIT = 1.5
# Of so many the line tells.
_MOST = 10
_BEGAN = pytest.StashKey[float]()
_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 1
_TOOK = "processor_seconds"


def _of_children(process: str) -> float:
    """Processor time of the processes that a process has begun and not waited for, and of theirs [s]; Linux alone."""
    spent, children = 0.0, ""
    with suppress(OSError):  # a thread or a process that ends meanwhile: who waits for it counts it
        for thread in os.listdir(f"/proc/{process}/task"):
            children += _read(f"/proc/{process}/task/{thread}/children")
    for child in children.split():
        with suppress(OSError):
            fields = _read(f"/proc/{child}/stat").rpartition(")")[2].split()
            spent += sum(map(int, fields[11:15])) / _TICKS + _of_children(child)
    return spent


def _read(file: str) -> str:
    with open(file) as lines:
        return lines.read()


def _spent() -> float:
    """Processor time of this process and of all that it has begun [s].

    A worker serves many tests and is waited for in one of them, which would count for all.
    """
    return sum(os.times()[:4]) + _of_children("self")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Notes when a test begins, with the fixtures that it is the first to need: where the one before it ended."""
    item.stash[_BEGAN] = item.session.stash.get(_BEGAN, None) or _spent()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Notes what it took."""
    result = yield
    now = item.session.stash[_BEGAN] = _spent()
    item.user_properties.append((_TOOK, now - item.stash.get(_BEGAN, now)))  # who is skipped never began
    return result


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Names them, the longest first."""
    reports = [report for found in terminalreporter.stats.values() for report in found if hasattr(report, "when")]
    took = {
        report.nodeid: dict(report.user_properties).get(_TOOK, 0.0)
        for report in reports
        if report.when == "teardown" and "drill" not in report.keywords
    }
    dear = sorted((name for name in took if took[name] > LIMIT), key=lambda name: -took[name])
    if dear:
        names = ", ".join(f"{name} ({took[name]:.1f} s)" for name in dear[:_MOST])
        terminalreporter.write_line(
            f"{len(dear)} without the mark drill took more than {LIMIT} s of processor: {names}"
        )
