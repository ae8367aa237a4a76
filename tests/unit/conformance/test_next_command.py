"""Last words of a conformance test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from unittest import SkipTest

import pytest
from tiny import Tiny

from proofroll.conformance import checks
from proofroll.conformance.checks import Check, checked
from proofroll.pytest_plugin import pytest_terminal_summary


class _Reporter:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def write_line(self, line: str) -> None:
        """Keeps a line."""
        self.lines.append(line)


def _lines(exit_status: int) -> list[str]:
    reporter = _Reporter()
    pytest_terminal_summary(reporter, exit_status)
    return reporter.lines


def _run(*names: str) -> None:
    for check in checks(Tiny):
        if check.name in names:
            check()


def test_an_engine_that_passes_is_sent_to_random_scenes(
    install_engines: Callable[[Mapping[str, str]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A passed check names the next command, a failed one takes it back, and so does a failed session."""
    install_engines({"tiny": "tiny:Tiny"})
    for name in list(checked):
        monkeypatch.delitem(checked, name)
    assert _lines(0) == []
    _run("version_is_told")
    assert _lines(0) == ["tiny passes the conformance checks; proofroll fuzz tiny next"]
    assert _lines(1) == []
    with pytest.raises(AssertionError):
        Check(Tiny, "wrong", "", lambda: (_ for _ in ()).throw(AssertionError("no")))()
    assert _lines(0) == []
    with pytest.raises(SkipTest):
        Check(Tiny, "known", "its reason", lambda: (_ for _ in ()).throw(AssertionError("no")))()
