"""Line at the end of a test run about slow tests without the mark ``drill``; no test fails for its duration."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest

# Processor time [s] above which a test is a drill (CONTRIBUTING.md).
LIMIT = 1.5
# Largest number of tests named in the line.
_MOST = 10
_BEGAN = pytest.StashKey[float]()
_TICKS = os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else 1
_TOOK, _MARKED = "processor_seconds", "marked_drill"


def _of_children(process: str) -> float:
    """Processor time of a process's living descendants [s]; 0 except on Linux."""
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
    """Processor time of this process and all its descendants, living and ended [s].

    Living ones count because a worker serves many tests: counted at its end, its time would fall on one test.
    """
    return sum(os.times()[:4]) + _of_children("self")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Notes when a test begins, with the fixtures that it is the first to need: where the one before it ended."""
    item.stash[_BEGAN] = item.session.stash.get(_BEGAN, None) or _spent()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Records the processor time that a test took."""
    result = yield
    now = item.session.stash[_BEGAN] = _spent()
    item.user_properties.append((_TOOK, now - item.stash.get(_BEGAN, now)))  # a skipped test has no start
    # Keywords of a report hold names of folders too: a test in tests/drill has the word, not the mark.
    item.user_properties.append((_MARKED, item.get_closest_marker("drill") is not None))
    return result


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Prints the slow tests without the mark ``drill``, the slowest first."""
    reports = [report for found in terminalreporter.stats.values() for report in found if hasattr(report, "when")]
    told = {report.nodeid: dict(report.user_properties) for report in reports if report.when == "teardown"}
    took = {name: properties.get(_TOOK, 0.0) for name, properties in told.items() if not properties.get(_MARKED)}
    dear = sorted((name for name in took if took[name] > LIMIT), key=lambda name: -took[name])
    if dear:
        names = ", ".join(f"{name} ({took[name]:.1f} s)" for name in dear[:_MOST])
        terminalreporter.write_line(
            f"{len(dear)} without the mark drill took more than {LIMIT} s of processor: {names}"
        )
