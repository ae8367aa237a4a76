"""Failure instead of skip for tests if ``PROOFROLL_NO_SKIPS`` is set, as ``.ci/run`` does.

A developer may lack an engine, heyoka or a browser. In CI all are installed, and a skip would hide that one is missing.
A conformance check that does not apply raises ``unittest.SkipTest``, which stays a skip.
"""

from __future__ import annotations

import os
import unittest
from collections.abc import Iterator
from typing import Any

import pytest

VARIABLE = "PROOFROLL_NO_SKIPS"
# Reasons of skips that no installation changes.
_EXCUSED = ("root may write anywhere", "this system lets nobody mount a small disk")


def _unexcused(report: Any) -> str:
    """Reason of a skip that is not excused; empty if there is none."""
    if not os.environ.get(VARIABLE) or report.outcome != "skipped" or hasattr(report, "wasxfail"):
        return ""
    reason = str(report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr)
    return "" if any(text in reason for text in _EXCUSED) else f"{reason} ({VARIABLE} is set, so this is a failure)"


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(call: pytest.CallInfo[None]) -> Iterator[None]:
    """Turns the skip of a test, or of a fixture, into a failure."""
    nothing_to_see = call.excinfo is not None and call.excinfo.errisinstance(unittest.SkipTest)  # pytest replaces it
    report: Any = yield
    if not nothing_to_see and (reason := _unexcused(report)):
        report.outcome, report.longrepr = "failed", reason
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Iterator[None]:
    """Turns the skip of a whole module, by ``importorskip`` at its head, into a failure."""
    report: Any = yield
    if reason := _unexcused(report):
        report.outcome, report.longrepr = "failed", reason
    return report
