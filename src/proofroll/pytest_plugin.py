"""Pytest fixture; it loads proofroll only when a test uses it."""

from collections.abc import Callable
from typing import Any

import pytest


@pytest.fixture(scope="session")
def assert_agrees() -> Callable[..., Any]:
    """:func:`proofroll.testing.assert_agrees`: an engine, or a trajectory, against the truth of a scene."""
    from proofroll.testing import assert_agrees as function

    return function
