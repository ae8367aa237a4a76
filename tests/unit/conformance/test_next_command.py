"""Last words of a conformance test."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar
from unittest import SkipTest

import pytest
from tiny import Tiny

from proofroll.conformance import checks
from proofroll.conformance.checks import Check, checked, not_looked_at
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
    monkeypatch.setitem(not_looked_at, "tiny", set())
    assert _lines(0) == []
    _run("version_is_told")
    assert _lines(0) == ["tiny passes the conformance checks; proofroll fuzz tiny next"]
    assert _lines(1) == []
    with pytest.raises(AssertionError):
        Check(Tiny, "wrong", "", lambda: (_ for _ in ()).throw(AssertionError("no")))()
    assert _lines(0) == []
    with pytest.raises(SkipTest):
        Check(Tiny, "known", "its reason", lambda: (_ for _ in ()).throw(AssertionError("no")))()


def test_what_no_run_needed_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Capabilities of an engine leave the line as runs against the truth need them, known to fail or not."""

    class Provides(Tiny):
        name = "provides"
        provides: ClassVar = {"euler": frozenset({"free bodies", "bushings", "gears"})}

    for name in list(checked):
        monkeypatch.delitem(checked, name)
    monkeypatch.setitem(checked, "provides", True)

    def check(known: str, needs: str, error: Exception | None = None) -> Check:
        def run() -> None:
            if error is not None:
                raise error

        return Check(Provides, "moves", known, run, frozenset({needs}))

    check("", "free bodies")()
    assert _lines(0)[-1] == "provided and never looked at: bushings, gears"
    with pytest.raises(SkipTest):
        check("its reason", "gears", AssertionError("no"))()
    with pytest.raises(SkipTest):
        check("", "bushings", SkipTest("refused"))()
    assert _lines(0)[-1] == "provided and never looked at: bushings"
    check("", "bushings")()
    assert _lines(0)[-1] == "provides passes the conformance checks; proofroll fuzz provides next"
