"""Pytest fixture, and last words of a conformance test; proofroll is loaded only when a test uses it."""

import sys
from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(scope="session")
def assert_agrees() -> Callable[..., Any]:
    """:func:`proofroll.testing.assert_agrees`: an engine, or a trajectory, against the truth of a scene."""
    from proofroll.testing import assert_agrees as function

    return function


def pytest_terminal_summary(terminalreporter: Any, exitstatus: int) -> None:
    """Names the next command for each engine whose conformance checks have passed."""
    module = sys.modules.get("proofroll.conformance.checks")
    if module is not None and exitstatus == 0:
        for name in sorted(name for name, passes in module.checked.items() if passes):
            terminalreporter.write_line(f"{name} passes the conformance checks; proofroll fuzz {name} next")
            if left := module.not_looked_at[name]:
                terminalreporter.write_line(f"provided and never looked at: {', '.join(sorted(left))}")
