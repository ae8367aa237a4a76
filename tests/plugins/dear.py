"""A line at the end about tests that take long and are no drills; none fails, for no test hangs on a clock."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

import pytest

# Processor time [s] above which a test is a drill (CONTRIBUTING.md).
LIMIT = 1.5
# Of so many the line tells.
_MOST = 10
_BEGAN = pytest.StashKey[float]()
_TOOK = "processor_seconds"


def _spent() -> float:
    """Processor time of this process and of those that it has waited for [s]."""
    return sum(os.times()[:4])


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Notes when a test begins, with the fixtures that it is the first to need."""
    item.stash[_BEGAN] = _spent()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item) -> Iterator[None]:
    """Notes what it took."""
    result = yield
    now = _spent()
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
