"""What every page is made with."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
import pytest

from proofroll.report.pages import environment, rendered


def test_a_template_is_compiled_once_and_says_what_each_page_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pages with other words and other functions share nothing but what was compiled; another text is compiled anew."""
    compiled = []
    compile_ = jinja2.Environment.compile

    def counted(self: jinja2.Environment, *arguments: Any, **more: Any) -> Any:
        compiled.append(arguments)
        return compile_(self, *arguments, **more)

    monkeypatch.setattr(jinja2.Environment, "compile", counted)
    folders = [tmp_path / "a", tmp_path / "b"]
    for folder in folders:
        folder.mkdir()
        (folder / "said.html").write_text("{{ word | shown }} {{ told }}")

    def said(folder: Path, word: str, shown: Any, told: str) -> str:
        made = environment(folder)
        made.filters["shown"], made.globals["told"] = shown, told
        return rendered(made, "said.html", word=word)

    assert said(folders[0], "<One", str.lower, "here") == "&lt;one here"
    assert said(folders[0], "<Two", str.upper, "there") == "&lt;TWO there"
    assert len(compiled) == 1
    assert said(folders[1], "Three", str.lower, "there") == "three there"
    (folders[0] / "said.html").write_text("now {{ word | shown }}")
    assert said(folders[0], "One", str.lower, "here") == "now one"
    assert len(compiled) == 3
