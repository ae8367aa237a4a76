"""What every page is made with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
import pytest

from proofroll.report.page import html
from proofroll.report.pages import environment, rendered


def test_a_template_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pages of a process share what was compiled for the first."""
    compiled = []
    compile_ = jinja2.Environment.compile

    def counted(self: jinja2.Environment, *arguments: Any, **more: Any) -> Any:
        compiled.append(arguments)
        return compile_(self, *arguments, **more)

    monkeypatch.setattr(jinja2.Environment, "compile", counted)
    html._templates.cache_clear()
    for _ in range(2):
        html.templates().get_template("common.html")
    assert len(compiled) == 1


def test_words_are_escaped(tmp_path: Path) -> None:
    """What a page is told is text, and a name that nobody gave is an error."""
    (tmp_path / "said.html").write_text("{{ word }}")
    assert rendered(environment(tmp_path), "said.html", word="<One") == "&lt;One"
    with pytest.raises(jinja2.UndefinedError):
        rendered(environment(tmp_path), "said.html")
