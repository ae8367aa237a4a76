"""The engine keeps every promise of the protocol."""

import pytest
from proofroll_dart import Dart

from proofroll.conformance import checks


@pytest.mark.parametrize("check", checks(Dart), ids=lambda check: check.name)
def test_engine(check):
    check()
